"""Checkpoints: what is saved comes back, what is damaged is refused."""

import json

import numpy as np
import pytest

from racecraft.contract.errors import ContractError
from racecraft.formats.checkpoint import (
    CheckpointEntry,
    CheckpointError,
    Checkpoints,
    load_policy,
    load_state,
    save_policy,
    save_state,
)

KINDS = [
    "bool", "uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float16", "float32", "float64",
]  # fmt: skip
WEIGHTS = {"conv.weight": np.arange(24, dtype=np.float32).reshape(2, 3, 4), "bias": np.zeros(0, np.float32)}


def same(left, right):
    """Whether two trees are equal, types and kinds of numbers included."""
    assert type(left) is type(right)
    if isinstance(left, dict):
        assert list(left) == list(right)
        return all(same(left[key], right[key]) for key in left)
    if isinstance(left, list | tuple):
        assert len(left) == len(right)
        return all(same(a, b) for a, b in zip(left, right, strict=True))
    if isinstance(left, np.ndarray | np.generic):
        assert left.dtype == right.dtype
        assert left.shape == right.shape
        return np.array_equal(left, right)
    return left == right


def test_weights_and_card_come_back(tmp_path):
    save_policy(tmp_path / "p.safetensors", WEIGHTS, {"iteration": 3, "spec": {"hidden": [128]}})
    weights, card = load_policy(tmp_path / "p.safetensors")
    assert same(dict(sorted(WEIGHTS.items())), dict(sorted(weights.items())))
    assert card == {"iteration": 3, "spec": {"hidden": [128]}}


def test_any_tree_comes_back_as_it_was_types_included(tmp_path):
    state = {
        "kinds": {kind: np.array([[0, 1], [1, 0]]).astype(kind) for kind in KINDS},
        "counters": np.array([2**64 - 1, 0], np.uint64),
        "scalar": np.array(2.5),
        "number": np.float32(0.1),
        "turned": np.arange(6.0).reshape(2, 3).T,
        "strided": np.arange(10)[::3],
        "optimizer": {0: {"step": 7, "exp_avg": np.ones(3, np.float32)}, "lr": 1e-4, "betas": (0.9, 0.999)},
        "list": [1, None, True, "text", -0.0, 2**70, [np.zeros(2)]],
        "empty": {},
        "$odd": {"$array": "a name of ours, used by somebody else"},
    }
    save_state(tmp_path / "s.safetensors", state)
    assert same(load_state(tmp_path / "s.safetensors"), state)


def test_names_with_dots_do_not_run_into_each_other(tmp_path):
    state = {"a.b": np.zeros(2), "a": {"b": np.ones(3)}}
    save_state(tmp_path / "s.safetensors", state)
    assert same(load_state(tmp_path / "s.safetensors"), state)


@pytest.mark.parametrize("value", [object(), {1, 2}, np.array(["a"]), np.array([1j]), b"bytes"])
def test_what_a_file_cannot_hold_is_named_by_its_place(tmp_path, value):
    with pytest.raises(ContractError, match=r"state\.learner\.2"):
        save_state(tmp_path / "s.safetensors", {"learner": [1, 2, value]})


def test_safetensors_itself_reads_what_is_written(tmp_path):
    import safetensors.numpy

    weights = {**WEIGHTS, "n": np.array(3, np.int64), "turned": np.arange(6, dtype=">f8").reshape(2, 3).T}
    save_policy(tmp_path / "p.safetensors", weights, {"umlaut": "Zürich"})
    read = safetensors.numpy.load_file(tmp_path / "p.safetensors")
    assert set(read) == set(weights)
    assert all(np.array_equal(read[name], weights[name]) for name in weights)
    length = int.from_bytes((tmp_path / "p.safetensors").read_bytes()[:8], "little")
    assert length % 8 == 0


def damaged(data, how):
    cut = {"empty": b"", "half": data[: len(data) // 2], "one byte short": data[:-1], "text": b"hello world, no file"}
    return cut[how] if how in cut else data[:-3] + bytes([data[-3] ^ 1]) + data[-2:]


@pytest.mark.parametrize("how", ["empty", "half", "one byte short", "text", "one bit"])
def test_a_damaged_file_is_refused_with_a_letter(tmp_path, how):
    path = tmp_path / "p.safetensors"
    save_policy(path, WEIGHTS, {})
    path.write_bytes(damaged(path.read_bytes(), how))
    with pytest.raises(CheckpointError, match="damaged") as letter:
        load_policy(path)
    assert str(letter.value).startswith(str(path))
    assert "expected a racecraft policy in safetensors" in str(letter.value)


def test_files_of_another_kind_are_refused(tmp_path):
    import safetensors.numpy

    save_state(tmp_path / "s.safetensors", {})
    with pytest.raises(CheckpointError, match="says it is 'racecraft trainer state'"):
        load_policy(tmp_path / "s.safetensors")
    safetensors.numpy.save_file({"w": np.zeros(2)}, tmp_path / "other.safetensors")
    with pytest.raises(CheckpointError, match="says it is 'unnamed'"):
        load_policy(tmp_path / "other.safetensors")
    with pytest.raises(CheckpointError, match="no such file"):
        load_state(tmp_path / "nothing.safetensors")


def test_the_oldest_weights_go_when_all_together_are_too_large(tmp_path):
    """Room for five files: the untrained, the best and the last two stay, and of the others the newest."""
    weights = {"w": np.zeros(1000, np.float32)}
    save_policy(tmp_path / "one", weights, {"iteration": 0, "steps": 0})
    shelf = Checkpoints(tmp_path, weights_budget=5 * (tmp_path / "one").stat().st_size + 100)
    for iteration in range(9):
        shelf.save(iteration, iteration, weights, {}, {"n": iteration}, best=iteration == 2)
    assert [entry.iteration for entry in shelf.entries()] == [0, 2, 6, 7, 8]
    assert sorted(path.name for path in tmp_path.glob("*.policy.*")) == [
        f"{k}.policy.safetensors" for k in (0, 2, 6, 7, 8)
    ]
    assert shelf.find("best").iteration == 2
    with pytest.raises(CheckpointError, match="no checkpoint '5'; expected .*0, 2, 6 to 8"):
        shelf.find("5")


def test_no_more_weights_go_than_have_to(tmp_path):
    weights = {"w": np.zeros(1000, np.float32)}
    save_policy(tmp_path / "one", weights, {"iteration": 0, "steps": 0})
    shelf = Checkpoints(tmp_path, weights_budget=7 * (tmp_path / "one").stat().st_size + 100)
    for iteration in range(9):
        shelf.save(iteration, iteration, weights, {}, best=iteration == 2)
    assert [entry.iteration for entry in shelf.entries()] == [0, 2, 4, 5, 6, 7, 8]


@pytest.mark.parametrize("first_is_best", [False, True], ids=["of today", "of older runs"])
def test_before_any_was_evaluated_the_last_is_the_best_that_is_known(tmp_path, first_is_best):
    shelf = Checkpoints(tmp_path)
    for iteration in range(3):
        shelf.save(iteration, iteration, {"w": np.zeros(2)}, {}, best=first_is_best and not iteration)
    assert shelf.find("best").iteration == 2
    shelf.mark(1, 0.5, best=True)
    assert shelf.find("best").iteration == 1


def test_best_last_and_numbers_are_found_and_only_two_states_are_kept(tmp_path):
    shelf = Checkpoints(tmp_path)
    for iteration in range(5):
        weights = {"w": np.full(2, iteration, np.float32)}
        shelf.save(iteration, 100 * iteration, weights, {}, {"n": iteration}, best=iteration in (0, 2))
    found = {which: shelf.load_policy(which)[0]["w"][0] for which in ("best", "last", "3")}
    assert found == {"best": 2.0, "last": 4.0, "3": 3.0}
    assert shelf.load_state() == {"n": 4}
    assert shelf.load_state("3") == {"n": 3}
    assert sorted(path.name for path in tmp_path.glob("*.state.*")) == ["3.state.safetensors", "4.state.safetensors"]
    with pytest.raises(
        CheckpointError, match="state of checkpoint 2 was not kept; expected one of the iterations: 3, 4"
    ):
        shelf.load_state("2")
    shelf.mark(1, 0.75, best=True)
    assert (shelf.find("best").iteration, shelf.find("best").score) == (1, 0.75)
    assert shelf.find("best").steps == 100


def test_what_an_evaluation_changes_takes_the_place_of_what_was_saved_and_nothing_else(tmp_path):
    shelf = Checkpoints(tmp_path)
    for iteration in (1, 2, 3):
        shelf.save(iteration, 0, WEIGHTS, {}, {"loop": {"at": 1}, "learner": {"n": iteration}})
    shelf.mark(3, 0.5, state={"loop": {"at": 2}})
    assert shelf.load_state("3") == {"loop": {"at": 2}, "learner": {"n": 3}}
    shelf.mark(1, 0.25, state={"loop": {"at": 2}})
    assert shelf.find("1").score == 0.25, "its state is gone, which is no error"
    assert shelf.load_state("2")["loop"] == {"at": 1}


def test_saving_an_iteration_again_replaces_it(tmp_path):
    shelf = Checkpoints(tmp_path)
    for value in (1, 2):
        shelf.save(7, 70, {"w": np.full(1, value)}, {}, {"n": value})
    assert [entry.iteration for entry in shelf.entries()] == [7]
    assert shelf.load_state() == {"n": 2}


def test_a_checkpoint_that_is_not_there_gets_a_letter(tmp_path):
    shelf = Checkpoints(tmp_path)
    with pytest.raises(CheckpointError, match="no checkpoint 'best'; expected best, last, .*none yet"):
        shelf.find("best")
    shelf.save(3, 0, WEIGHTS, {})
    with pytest.raises(CheckpointError, match="no checkpoint '9'; expected .*: 3"):
        shelf.load_policy("9")
    (tmp_path / "checkpoints.json").write_text('{"version": 1')
    (tmp_path / "3.policy.safetensors").unlink()
    with pytest.raises(CheckpointError, match=r"checkpoints\.json: damaged"):
        shelf.entries()


def test_a_checkpoint_is_the_best_only_where_that_is_said(tmp_path):
    shelf = Checkpoints(tmp_path)
    entry = shelf.save(1, 10, {"w": np.zeros(1)}, {"spec": 1}, score=0.5, best=True)
    assert entry == CheckpointEntry(1, 10, 0.5, "1.policy.safetensors", None)
    assert shelf.save(2, 20, {"w": np.zeros(1)}, {}, {"n": 2}).state == "2.state.safetensors"
    shelf.mark(2, 0.25)
    assert [(one.score, one.steps) for one in shelf.entries()] == [(0.5, 10), (0.25, 20)]
    assert (shelf.find("best").iteration, shelf.find("last").iteration) == (1, 2)
    assert shelf.load_policy("1")[1] == {"spec": 1, "iteration": 1, "steps": 10}
    index = json.loads((tmp_path / "checkpoints.json").read_text())
    assert (index["version"], index["best"], index["last"]) == (1, 1, 2)
    assert (tmp_path / "checkpoints.json").read_text().startswith('{\n  "version": 1,')


@pytest.mark.parametrize(
    ("index", "letter"),
    [
        ({"version": 2, "best": None, "last": None, "checkpoints": []}, "version is 2; expected version 1"),
        ({"version": 1, "last": None, "checkpoints": []}, "version is 1; expected version 1"),
        ([], "damaged"),
    ],
)
def test_an_index_of_another_version_or_shape_is_refused(tmp_path, index, letter):
    (tmp_path / "checkpoints.json").write_text(json.dumps(index))
    with pytest.raises(CheckpointError, match=rf"checkpoints\.json: {letter}"):
        Checkpoints(tmp_path).entries()


def test_weights_that_somebody_took_away_are_in_nobodys_way(tmp_path):
    shelf = Checkpoints(tmp_path, weights_budget=1)
    for iteration in (1, 2, 3):
        shelf.save(iteration, 0, {"w": np.zeros(1)}, {}, {"n": iteration})
    (tmp_path / "2.policy.safetensors").unlink()
    shelf.save(4, 0, {"w": np.zeros(1)}, {}, {"n": 4})
    assert [entry.iteration for entry in shelf.entries()] == [3, 4]
    (tmp_path / "4.state.safetensors").unlink()
    with pytest.raises(CheckpointError, match="no such file"):
        shelf.load_state("4")


def test_a_file_of_another_version_or_with_other_numbers_than_were_written_is_refused(tmp_path):
    import safetensors.numpy

    path = tmp_path / "p.safetensors"
    for told, letter in (
        ({"version": "2", "digest": "", "card": "{}"}, "version 2; expected version 1. Upgrade racecraft"),
        ({"version": "1", "digest": "0" * 64, "card": "{}"}, "its digest does not match"),
    ):
        safetensors.numpy.save_file({"w": np.zeros(2)}, path, {"format": "racecraft policy", **told})
        with pytest.raises(CheckpointError, match=letter):
            load_policy(path)
    with pytest.raises(CheckpointError, match=r"cannot be read \(Is a directory\)"):
        load_policy(tmp_path)
