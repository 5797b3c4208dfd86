"""Every script in examples/ runs as a stranger would run it: a program of its own, in an empty folder."""

from pathlib import Path

import pytest
from tests.forked import ran

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))


def name_of(path):
    return path.stem


@pytest.mark.parametrize("script", SCRIPTS, ids=name_of)
def test_an_example_runs_and_says_something(script, tmp_path):
    done = ran([str(script)], tmp_path, PYTHONWARNINGS="error")
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert list(tmp_path.iterdir()) == [], "an example leaves nothing behind unless it is given a file"


def test_the_fast_car_is_a_folder_that_trains():
    from racecraft.worlds.deepracer.env.vehicle import MAX_SPEED_MPS
    from racecraft.worlds.deepracer.files.reward_file import racing_reward_source
    from racecraft.worlds.deepracer.training.trainer import RaceRequest, plan_car

    folder = EXAMPLES / "fast_car"
    plan = plan_car(RaceRequest(folder=folder))
    assert max(plan.actions.speed) == MAX_SPEED_MPS
    assert (plan.settings.race.car, plan.request.preset) == ("v5-classic", "race")
    assert (folder / "reward_function.py").read_text(encoding="utf-8") == racing_reward_source()


CARS = {"six_boxes": "OBJECT_AVOIDANCE", "three_bots": "HEAD_TO_BOT", "overtaking": "HEAD_TO_MODEL"}


@pytest.mark.parametrize("name", CARS)
def test_a_car_among_others_is_a_folder_that_trains(name):
    from racecraft.worlds.deepracer.training.trainer import RaceRequest, plan_car

    planned = plan_car(RaceRequest(folder=EXAMPLES / name))
    assert planned.settings.race.type == CARS[name]
    assert planned.track.name == "reInvent2019_wide"
    assert planned.stops, "it ends by itself"
    assert not [note for note in planned.notes if "a time trial" in note or "centre line" in note]


def test_the_overtaking_car_is_paid_by_the_default_of_its_race():
    from racecraft.worlds.deepracer.files.reward_file import default_reward_source

    text = (EXAMPLES / "overtaking" / "reward_function.py").read_text(encoding="utf-8")
    assert text == default_reward_source(has_objects=True, has_rivals=True)
