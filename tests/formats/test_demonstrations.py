"""Files of demonstrations: episodes counted by hand, and what a file may lack."""

import dataclasses

import numpy as np
import pytest

from racecraft.contract.errors import ContractError
from racecraft.formats.demonstrations import Demonstrations, read_demonstrations, write_demonstrations
from racecraft.formats.tensor_file import CheckpointError, write_tensors

SHOWN = Demonstrations(
    {"camera": np.arange(20, dtype=np.uint8).reshape(5, 2, 2), "speed": np.zeros((5, 1), np.float32)},
    np.array([0, 1, 0, 1, 1]), np.float32([1, 2, 4, 8, 16]), np.int32([0, 0, 1, 1, 2]), {"algorithm": "ppo"},
)  # fmt: skip
NONE = Demonstrations({}, np.zeros(0, int), np.zeros(0, np.float32), np.zeros(0, np.int32), {})


def test_episodes_are_counted_and_paid():
    assert (len(SHOWN), SHOWN.num_episodes, SHOWN.returns.tolist()) == (5, 3, [3, 12, 16])
    assert (len(NONE), NONE.num_episodes) == (0, 0)


@pytest.mark.parametrize("mask", [None, np.eye(5, 2, dtype=bool)])
def test_what_was_shown_comes_back(tmp_path, mask):
    shown = dataclasses.replace(SHOWN, action_mask=mask, source={"by": "me"})
    write_demonstrations(tmp_path / "d", shown)
    read = read_demonstrations(tmp_path / "d")
    assert set(read.observations) == {"camera", "speed"}
    for name, array in shown.observations.items():
        np.testing.assert_array_equal(read.observations[name], array)
    for name in ("actions", "reward", "episode"):
        np.testing.assert_array_equal(getattr(read, name), getattr(shown, name))
    assert (read.spec, read.source) == (shown.spec, shown.source)
    assert (read.action_mask is None) if mask is None else (read.action_mask == mask).all()


def test_arrays_of_several_lengths_are_the_programmers_error(tmp_path):
    with pytest.raises(ContractError, match="'reward': 4.*expected one length"):
        write_demonstrations(tmp_path / "d", dataclasses.replace(SHOWN, reward=np.zeros(4, np.float32)))
    assert list(tmp_path.iterdir()) == []


ARRAYS = {"actions": np.zeros(2), "reward": np.zeros(2), "episode": np.zeros(2)}
LACKING = [
    ({"actions": np.zeros(2)}, {"spec": {}}, "it lacks reward, episode; expected"),
    (ARRAYS, {"source": {}}, "it lacks its spec; expected"),
    ({**ARRAYS, "reward": np.zeros(3)}, {"spec": {}}, "the lengths .*; expected one length, 1 or more"),
    ({name: np.zeros(0) for name in ARRAYS}, {"spec": {}}, "the lengths .*; expected one length, 1 or more"),
]


@pytest.mark.parametrize(("arrays", "card", "letter"), LACKING)
def test_a_file_that_lacks_something_is_refused(tmp_path, arrays, card, letter):
    write_tensors(tmp_path / "d", "racecraft demonstration file", arrays, card)
    with pytest.raises(CheckpointError, match=letter):
        read_demonstrations(tmp_path / "d")
