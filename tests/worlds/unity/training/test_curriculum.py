"""Lessons advance when what they ask for is reached, and a run goes on at the lesson where it was."""

from types import SimpleNamespace

import pytest

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import EpisodeRecord
from racecraft.worlds.unity.env.side_channels import Uniform
from racecraft.worlds.unity.files.trainer_config import Lesson, Sampler
from racecraft.worlds.unity.training.curriculum import Curriculum
from racecraft.worlds.unity.training.plan import UnityRequest, plan_unity


def lessons(**criteria):
    return {
        "wall": (
            Lesson("low", 1.0, behavior="Jump", **{"measure": "reward", "threshold": 0.5, **criteria}),
            Lesson("middle", Sampler("uniform", (1.0, 3.0)), "reward", "Jump?team=0", 0.5),
            Lesson("high", 4.0),
        )
    }


def opened(told, run=None, steps=1000):
    """Return a curriculum over two worlds, what they are set to, and what is said."""
    values, said = [], []
    worlds = [SimpleNamespace(set_parameter=lambda name, value, at=at: values.append((at, value))) for at in (0, 1)]
    rows = {"Jump": slice(0, 2), "Other": slice(2, 4)}
    curriculum = Curriculum(told, worlds, rows, {"Jump": steps, "Other": steps}, said.append)
    if run is not None:
        curriculum.keep_in(run)
    return curriculum, values, said


def ended(*rewards, world=0, steps=10):
    return [EpisodeRecord(world, 0, steps, reward, "ended") for reward in rewards]


def test_a_lesson_ends_when_the_mean_of_so_many_episodes_exceeds_its_threshold():
    curriculum, values, said = opened(lessons(min_episodes=3, is_smoothed=False))
    curriculum.watch(ended(0.9, 0.9))
    curriculum.watch(ended(9.0, 9.0, 9.0, world=3))  # another behavior's
    assert values == []
    for reward in (-0.6, 0.9, 0.9):  # the mean of the latest three is 0.4 each time
        curriculum.watch(ended(reward))
        assert values == []
    curriculum.watch(ended(0.9))
    assert values == [(0, Uniform(1.0, 3.0)), (1, Uniform(1.0, 3.0))]
    assert said == ["wall: lesson 2 of 3, 'middle', begins"]
    curriculum.watch([])
    assert len(values) == 2  # what was earned in the lesson before does not count
    curriculum.watch(ended(1.0))
    assert values[2:] == [(0, 4.0), (1, 4.0)]
    curriculum.watch(ended(9.0))
    assert len(values) == 4  # the last lesson stays


def test_a_smoothed_measure_keeps_a_quarter_of_the_one_before():
    curriculum, values, _ = opened(lessons())
    curriculum.watch(ended(0.0))
    curriculum.watch(ended(0.6))
    assert values == []  # 0.45
    curriculum.watch(ended(0.6))
    assert len(values) == 2  # 0.5625


def test_progress_is_the_share_of_max_steps():
    curriculum, values, _ = opened(lessons(measure="progress", is_smoothed=False), steps=100)
    curriculum.watch(ended(0.0, 0.0, steps=25))
    assert values == []
    curriculum.watch(ended(0.0, steps=1))
    assert len(values) == 2


def test_a_run_goes_on_at_its_lesson(tmp_path):
    curriculum, _, _ = opened(lessons(is_smoothed=False), tmp_path)
    curriculum.watch(ended(1.0))
    _, values, _ = opened(lessons(is_smoothed=False), tmp_path)
    assert values == [(0, Uniform(1.0, 3.0)), (1, Uniform(1.0, 3.0))]


@pytest.mark.parametrize("text", ["trainer_type: poca", "self_play: {window: 10}"])
def test_other_ways_of_learning_are_refused_unless_the_nearest_is_wanted(tmp_path, text):
    path = tmp_path / "game.yaml"
    path.write_text(f"behaviors:\n  Basic:\n    {text}\n")
    with pytest.raises(UserInputError, match="behaviors.Basic asks for .*(poca|self_play).*--nearest"):
        plan_unity(UnityRequest("builtin:Basic", path))
    planned = plan_unity(UnityRequest("builtin:Basic", path, nearest=True))
    assert planned.algorithm.name == "ppo"
    assert any("PPO learns instead" in note or "one policy" in note for note in planned.config.notes)
