"""Checkpoints in order of merit, by hand; and which of them stay on the disk."""

import dataclasses
import json

import numpy as np
import pytest

from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.checkpoint_ranking import MERITS, find_checkpoint, load_weights, ranked, split_source
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.tensor_file import CheckpointError


def lap(progress, seconds=None, reward=None):
    return {"progress_percent": progress, "seconds": seconds, "reward": reward}


EVALUATIONS = {  # iteration: laps, mean reward of training
    1: ([lap(90), lap(80)], 9.0),  # steadier than fast, but no lap
    2: ([lap(100, 9.0), lap(60)], 5.0),  # the fastest lap, and a failure
    3: ([lap(100, 12.0), lap(100, 15.0)], 7.0),  # of two that always lap the one with the faster lap: the best
    4: ([lap(100, 13.0), lap(100, 13.5)], 6.0),  # laps alike
}
ORDER = {"progress": [3, 4, 1, 2, 0], "reward": [1, 3, 4, 2, 0], "laptime": [2, 3, 4, 1, 0],
         "steadiness": [4, 3, 1, 2, 0]}  # fmt: skip


@pytest.fixture
def run(tmp_path):
    run = RunFolder.create(tmp_path / "run", {"kind": "deepracer"})
    shelf = Checkpoints(run.checkpoints)
    shelf.save(0, 0, {"w": np.zeros(3)}, {})
    for iteration, (laps, reward) in EVALUATIONS.items():
        score = float(np.mean([one["progress_percent"] for one in laps]))
        shelf.save(iteration, 10 * iteration, {"w": np.ones(3)}, {}, score=score)
        (run.evaluations / f"{iteration}.json").write_text(json.dumps({"laps": laps}))
        run.append_metrics({"iteration": iteration, "mean_reward": reward})
    return run


@pytest.mark.parametrize("by", MERITS)
def test_each_merit_has_an_order_of_its_own(run, by):
    assert [one.entry.iteration for one in ranked(run, by)] == ORDER[by]


def test_a_reward_that_was_asked_for_in_the_evaluation_counts_before_training_s(run):
    (run.evaluations / "2.json").write_text(json.dumps({"laps": [lap(100, 9.0, 50.0), lap(60, None, 30.0)]}))
    assert [(one.entry.iteration, one.reward) for one in ranked(run, "reward")][0] == (2, 40.0)


def test_a_merit_nobody_knows_is_refused_with_the_nearest_and_a_damaged_evaluation_by_name(run):
    with pytest.raises(SettingError, match="--by 'lap time': .* Did you mean 'laptime'"):
        ranked(run, "lap time")
    (run.evaluations / "3.json").write_text("{")
    with pytest.raises(RunFolderError, match="3.json: damaged"):
        ranked(run)


def test_only_every_so_many_weights_stay_beside_first_best_and_the_last_two(tmp_path):
    shelf = Checkpoints(tmp_path, keep_every=4)
    for iteration in range(12):
        shelf.save(iteration, iteration, {"w": np.ones(3)}, {}, best=iteration == 5)
    assert [entry.iteration for entry in shelf.entries()] == [0, 4, 5, 8, 10, 11]
    assert {path.name for path in tmp_path.glob("*.safetensors")} == {
        f"{iteration}.policy.safetensors" for iteration in (0, 4, 5, 8, 10, 11)
    }


@pytest.mark.parametrize("by", MERITS)
def test_a_merit_names_the_checkpoint_that_is_first_by_it(run, by):
    assert find_checkpoint(run, by).iteration == ORDER[by][0]
    assert load_weights(run, by)[1]["iteration"] == ORDER[by][0]
    assert find_checkpoint(run, "3").iteration == 3


def test_a_merit_that_no_checkpoint_has_is_refused(run):
    for path in run.evaluations.glob("*.json"):
        path.write_text(json.dumps({"laps": [lap(40)]}))
    with pytest.raises(CheckpointError, match="no checkpoint has what 'laptime' asks for .*racecraft checkpoints"):
        find_checkpoint(run, "laptime")


def test_what_an_evaluation_came_to_is_told_in_figures(run):
    found = {one.entry.iteration: dataclasses.astuple(one)[1:] for one in ranked(run)}
    assert found == {  # score, reward, fastest lap, mean of laps, worst progress, spread of laps
        0: (None, None, None, None, None, None),
        1: (85.0, 9.0, None, None, 80, None),
        2: (80.0, 5.0, 9.0, 9.0, 60, None),
        3: (100.0, 7.0, 12.0, 13.5, 100, 3.0),
        4: (100.0, 6.0, 13.0, 13.25, 100, 0.5),
    }
    assert found == {one.entry.iteration: dataclasses.astuple(one)[1:] for one in ranked(run, "progress")}


def test_of_equals_and_of_those_that_nobody_judged_the_newest_is_first(tmp_path):
    run = RunFolder.create(tmp_path / "run")
    shelf = Checkpoints(run.checkpoints)
    for iteration, score in enumerate((None, 5.0, None, 5.0)):
        shelf.save(iteration, 0, {"w": np.zeros(1)}, {}, score=score)
    assert [one.entry.iteration for one in ranked(run)] == [3, 1, 2, 0]


@pytest.mark.parametrize("text", ["[]", '{"laps": [3]}'])
def test_an_evaluation_of_another_shape_is_damaged(run, text):
    (run.evaluations / "3.json").write_text(text)
    with pytest.raises(RunFolderError, match=r"3\.json: damaged"):
        ranked(run)


def test_an_evaluation_that_is_no_cars_has_no_laps(run):
    for text in ('{"games": 3}', '{"laps": [{"length": 3}]}'):
        (run.evaluations / "3.json").write_text(text)
        assert next(one for one in ranked(run) if one.entry.iteration == 3).worst_progress_percent is None


def test_a_colon_counts_only_before_a_checkpoints_name():
    """A drive has one, too, and a folder may be called as a checkpoint is."""
    assert [split_source(source) for source in ("C:/runs/oval", "last", "C:/oval:12", "oval:fast")] == [
        ("C:/runs/oval", "best"), ("last", "best"), ("C:/oval", "12"), ("oval:fast", "best"),
    ]  # fmt: skip


@pytest.mark.parametrize("is_later", [False, True])
def test_so_many_weights_stay_spread_over_the_training(tmp_path, is_later):
    shelf = Checkpoints(tmp_path, keep_count=None if is_later else 3)
    for iteration in range(41):
        shelf.save(iteration, iteration, {"w": np.ones(3)}, {}, score=1.0, best=iteration == 5)
    if is_later:
        a_file = (tmp_path / "7.policy.safetensors").stat().st_size
        freed = Checkpoints(tmp_path, keep_count=3).prune()
        assert freed == pytest.approx(34 * a_file, rel=0.05)
        assert (shelf.find("best").iteration, shelf.find("last").iteration) == (5, 40)
    kept = [entry.iteration for entry in shelf.entries()]
    assert len(kept) == 7
    assert {0, 5, 39, 40} < set(kept)
    gaps = np.diff(kept)
    assert gaps[1:-1].max() <= 16  # 34 iterations between the best and the last two, three of them kept
    assert len(list(tmp_path.glob("*.policy.safetensors"))) == 7


def test_of_many_weights_those_that_were_evaluated_stay(tmp_path):
    shelf = Checkpoints(tmp_path, keep_count=4)
    for iteration in range(31):
        shelf.save(iteration, iteration, {"w": np.ones(3)}, {})
        if iteration % 10 == 7:
            shelf.mark(iteration, 50.0)
    kept = [entry.iteration for entry in shelf.entries()]
    assert {0, 7, 17, 27, 29, 30} < set(kept)
    assert len(kept) == 7
