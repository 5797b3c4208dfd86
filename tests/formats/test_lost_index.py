"""A run whose checkpoints.json is missing or torn goes on from its newest whole state."""

import json

import numpy as np
import pytest

from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.tensor_file import CheckpointError

WEIGHTS = {"w": np.arange(4, dtype=np.float32)}


def saved(folder, iterations=4):
    checkpoints = Checkpoints(folder)
    for number in range(iterations):
        checkpoints.save(number, 10 * number, WEIGHTS, {"kind": "x"}, state={"number": number})
    return folder / "checkpoints.json"


def lose(index):
    index.unlink()


def tear(index):
    index.write_bytes(index.read_bytes()[:50])


def nest(index):
    index.write_text("[" * 100_000)


@pytest.mark.parametrize("harm", [lose, tear, nest])
def test_the_newest_whole_state_is_found_without_an_index(tmp_path, harm):
    harm(saved(tmp_path))
    checkpoints = Checkpoints(tmp_path)
    assert checkpoints.find("last").iteration == checkpoints.find("best").iteration == 3
    assert checkpoints.load_state() == {"number": 3}
    assert [entry.steps for entry in checkpoints.entries()] == [0, 10, 20, 30]


@pytest.mark.parametrize("harm", [lose, tear])
def test_a_state_that_is_not_whole_is_passed_over(tmp_path, harm):
    harm(saved(tmp_path))
    newest = tmp_path / "3.state.safetensors"
    newest.write_bytes(newest.read_bytes()[:-1])
    assert Checkpoints(tmp_path).load_state("last") == {"number": 2}


def test_the_next_checkpoint_writes_the_index_again(tmp_path):
    lose(saved(tmp_path))
    Checkpoints(tmp_path).save(4, 40, WEIGHTS, {}, state={"number": 4}, best=True)
    index = json.loads((tmp_path / "checkpoints.json").read_text())
    assert [entry["iteration"] for entry in index["checkpoints"]] == [0, 1, 2, 3, 4]
    assert (index["best"], index["last"]) == (4, 4)


def test_a_torn_index_without_any_whole_file_is_refused(tmp_path):
    tear(saved(tmp_path, 1))
    for file in tmp_path.glob("*.safetensors"):
        file.write_bytes(b"")
    with pytest.raises(CheckpointError, match=r"checkpoints\.json: damaged"):
        Checkpoints(tmp_path).entries()
