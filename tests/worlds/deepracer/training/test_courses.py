"""Courses of one training: what worker files and alternating directions ask for, found in what is really driven."""

import json

import polars
import pytest
from tests.worlds.deepracer.training.test_run_env_effects import SMALL

from racecraft.contract.errors import SettingError
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.deepracer.files.run_env import RunEnvError
from racecraft.worlds.deepracer.players.run_courses import shares
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car, plan_resume

FOUR_CARS = (
    *SMALL, "evaluation.episodes=2", "rollout.num_worlds=4", "rollout.horizon=24", "race.max_episode_seconds=1",
)  # fmt: skip


def folder_with(tmp_path, *lines, **workers):
    folder = tmp_path / "my-car"
    folder.mkdir(exist_ok=True)
    (folder / "run.env").write_text("\n".join(lines) + "\n")
    for name, text in workers.items():
        (folder / f"{name.replace('_', '-')}.env").write_text(text)
    return folder


MULTI = ("DR_TRAIN_MULTI_CONFIG=True", "DR_WORKERS=2", "DR_WORLD_NAME=reinvent_base", "RACECRAFT_STOP=iterations=1")


def test_a_worker_file_s_cars_drive_on_its_own_track_and_the_run_goes_on_there(tmp_path):
    folder = folder_with(tmp_path, *MULTI, worker_2="DR_WORLD_NAME=Oval_track\nDR_TRAIN_REVERSE_DIRECTION=True\n")
    trained = train(RaceRequest(folder, run=tmp_path / "run", overrides=FOUR_CARS), NullCallback(), lambda _: None)
    lengths = [load_track(name).as_filed().length for name in ("reinvent_base", "Oval_track")]
    ticks = polars.read_parquet(trained.run.episodes / "1.parquet")
    driven = dict(ticks.group_by("world").agg(polars.col("track_length_m").first()).iter_rows())
    assert [driven[world] for world in range(4)] == pytest.approx([lengths[0]] * 2 + [lengths[1]] * 2)
    assert len(json.loads((trained.run.evaluations / "1.json").read_text())["laps"]) == 4  # two on each course
    told = trained.run.read_job()["courses"]
    assert [(one["track"], one["settings"]["race"]["reverse"]) for one in told] == [
        ("reinvent_base", False),
        ("Oval_track", True),
    ]
    again = resume(tmp_path / "run", ("iterations=2",), NullCallback(), lambda _: None)
    ticks = polars.read_parquet(again.run.episodes / "2.parquet")
    assert set(ticks["track_length_m"].round(3)) == {round(length, 3) for length in lengths}


def test_each_car_drives_one_episode_one_way_and_the_next_the_other_where_directions_alternate(tmp_path):
    folder = folder_with(tmp_path, "DR_TRAIN_ALTERNATE_DRIVING_DIRECTION=True", "RACECRAFT_STOP=iterations=1")
    trained = train(
        RaceRequest(folder, run=tmp_path / "run", overrides=(*FOUR_CARS, "race.max_training_seconds=1")),
        NullCallback(),
        lambda _: None,
    )
    ticks = polars.read_parquet(trained.run.episodes / "1.parquet").filter(polars.col("tick") == 1)
    track = load_track("reinvent_base")
    for world, circuits in ((0, (track, track.reversed())), (1, (track.reversed(), track))):
        for episode, circuit in enumerate(circuits):
            first = ticks.filter(world=world, episode=episode).row(0, named=True)
            assert first["yaw_rad"] == pytest.approx(circuit.pose_at_share(0.25 * world).yaw, abs=1e-6)
    told = trained.run.read_job()
    note = "cars side by side: 4 on reinvent_base in turn each way, episode by episode; each course is judged from 2"
    assert any(note in said for said in told["notes"])
    assert [one["alternates"] for one in told["courses"]] == [True]
    assert len(json.loads((trained.run.evaluations / "1.json").read_text())["laps"]) == 4  # two each way
    assert [one.alternates for one in plan_resume(tmp_path / "run").courses] == [True]
    params = (trained.run.path / "training_params.yaml").read_text()
    assert 'ALTERNATE_DRIVING_DIRECTION: "True"' in params or "ALTERNATE_DRIVING_DIRECTION: 'True'" in params


def test_workers_of_both_directions_are_judged_on_four_courses(tmp_path):
    folder = folder_with(
        tmp_path, *MULTI, "DR_TRAIN_ALTERNATE_DRIVING_DIRECTION=True", worker_2="DR_WORLD_NAME=Oval_track"
    )
    planned = plan_car(RaceRequest(folder, overrides=FOUR_CARS))
    assert [(course.label, course.alternates) for course in planned.courses] == [
        ("reinvent_base both ways", True),
        ("Oval_track both ways", True),
    ]
    laid = [(course.track.name, course.race.reverse) for course in planned.judged_courses]
    assert laid == [("reinvent_base", False), ("reinvent_base", True), ("Oval_track", False), ("Oval_track", True)]


def test_workers_that_drive_nothing_are_named(tmp_path):
    """DR_WORKERS without courses changes nothing; a worker file beyond DR_WORKERS neither."""
    single = plan_car(RaceRequest(folder_with(tmp_path, "DR_WORKERS=12"), overrides=FOUR_CARS))
    assert any(
        note.startswith("DR_WORKERS=12: not used, as DR_TRAIN_MULTI_CONFIG is not True") for note in single.notes
    )
    files = {f"worker_{number}": "DR_WORLD_NAME=Oval_track\n" for number in (2, 3)}
    several = plan_car(RaceRequest(folder_with(tmp_path, *MULTI, **files), overrides=FOUR_CARS))
    assert "worker-3.env: not driven, as DR_WORKERS is 2" in several.notes
    assert not any("worker-2.env" in note for note in several.notes)


WRONG = [  # lines of run.env, worker-2.env, file, what the message holds
    (MULTI, None, "run.env:1", "DR_WORKERS asks for 2 courses and there is no worker-2.env"),
    ((*MULTI[:1], "DR_WORKERS=1.5"), None, "run.env:2", "DR_WORKERS: '1.5'; expected a whole number"),
    (MULTI, "\nDR_RACE_TYPE=HEAD_TO_MODEL", "worker-2.env:2", "'HEAD_TO_MODEL' races on one course only"),
    (MULTI, "DR_RACE_TYPE=OBJECT_AVOIDANCE\nDR_OA_NUMBER_OF_OBSTACLES=x", "worker-2.env:2", "DR_OA_NUMBER_OF"),
    (MULTI, "DR_TRAIN_REVERSE_DIRECTION=left", "worker-2.env:1", "expected True or False"),
    (("DR_TRAIN_ALTERNATE_DRIVING_DIRECTION=both",), None, "run.env:1", "'both'; expected True or False"),
]  # fmt: skip


@pytest.mark.parametrize(("lines", "worker", "place", "found"), WRONG)
def test_what_cannot_be_laid_out_gets_a_letter_with_file_and_line(tmp_path, lines, worker, place, found):
    folder = folder_with(tmp_path, *lines, **({} if worker is None else {"worker_2": worker}))
    with pytest.raises(RunEnvError) as caught:
        plan_car(RaceRequest(folder))
    assert str(caught.value).startswith(str(folder / place))
    assert found in str(caught.value)


def test_cars_are_shared_out_evenly_and_no_course_goes_empty():
    assert shares(5, 2) == [3, 2]
    with pytest.raises(SettingError, match="rollout.num_worlds is 1, and 2 courses are to be driven"):
        shares(1, 2)


def test_a_worker_may_race_among_boxes_beside_a_time_trial(tmp_path):
    """What racers asked for: one course bare, one with boxes."""
    boxes = "DR_RACE_TYPE=OBJECT_AVOIDANCE\nDR_OA_NUMBER_OF_OBSTACLES=2\n"
    folder = folder_with(tmp_path, *MULTI, worker_2=boxes)
    planned = plan_car(RaceRequest(folder, overrides=FOUR_CARS))
    assert [course.race.type for course in planned.courses] == ["TIME_TRIAL", "OBJECT_AVOIDANCE"]
    assert planned.courses[1].settings.boxes.number == 2
