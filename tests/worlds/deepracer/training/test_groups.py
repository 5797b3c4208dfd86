"""Groups of cars as typed, tracks that are held out, and a training of both: found in what is really driven."""

import csv
import json

import numpy as np
import polars
import pytest
from tests.worlds.deepracer.training.test_courses import FOUR_CARS

from racecraft.contract.errors import RunFolderError, SettingError, TrackError, UserInputError
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.deepracer.files.generalisation import COLUMNS, read_generalisation
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names
from racecraft.worlds.deepracer.training.groups import read_groups, requested_groups
from racecraft.worlds.deepracer.training.hold_out import are_alike, twins_of
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car, plan_resume

MIXED = (
    "track=Oval_track cars=1",
    "track=Vegas_track race=object-avoidance boxes.number=2 cars=2",
    {"track": "Oval_track", "race": "HEAD_TO_BOT", "direction": "reverse", "bots": {"number": 1}, "cars": 1},
)


def planned(**words):
    words.setdefault("overrides", FOUR_CARS)
    return plan_car(RaceRequest(**words))


def laid(plan):
    return [(one.track.name, one.race.type, one.race.reverse, one.cars) for one in plan.courses]


def test_what_a_racer_asked_for_one_doing_time_trials_one_boxes_two_bots():
    plan = planned(groups=MIXED)
    assert laid(plan) == [
        ("Oval_track", "TIME_TRIAL", False, 1),
        ("Vegas_track", "OBJECT_AVOIDANCE", False, 2),
        ("Oval_track", "HEAD_TO_BOT", True, 1),
    ]
    assert plan.courses[1].settings.boxes.number == 2
    assert plan.courses[2].settings.bots.number == 1
    assert plan.track.name == "Oval_track", "the first group's is the training's own"
    assert [one.label for one in plan.courses] == ["Oval_track", "Vegas_track boxes", "Oval_track reversed bots"]


def test_a_group_without_a_track_races_on_every_track_named():
    plan = planned(tracks=("Oval_track,Vegas_track",), groups=("cars=1", "race=OBJECT_AVOIDANCE cars=1"))
    assert [one[:2] for one in laid(plan)] == [
        ("Oval_track", "TIME_TRIAL"),
        ("Vegas_track", "TIME_TRIAL"),
        ("Oval_track", "OBJECT_AVOIDANCE"),
        ("Vegas_track", "OBJECT_AVOIDANCE"),
    ]


def test_one_name_among_several_words_is_the_training_s_track():
    plan = planned(tracks=("Oval_track",))
    assert (plan.track.name, plan.courses) == ("Oval_track", ())
    plan = planned(tracks=("Oval_track",), hold_out=("LGSWide",))
    assert (plan.track.name, plan.courses, [one.name for one in plan.held_out]) == ("Oval_track", (), ["LGSWide"])


def test_both_directions_share_a_group_s_cars():
    assert laid(planned(groups=("direction=both cars=3", "track=Oval_track cars=1"))) == [
        ("reinvent_base", "TIME_TRIAL", False, 2),
        ("reinvent_base", "TIME_TRIAL", True, 1),
        ("Oval_track", "TIME_TRIAL", False, 1),
    ]


def test_groups_that_name_no_number_share_what_is_left():
    from racecraft.worlds.deepracer.players.run_courses import cars_on

    plan = planned(groups=("track=Oval_track cars=1", "track=Vegas_track", "track=LGSWide"))
    assert cars_on(plan.courses, 4) == [1, 2, 1]
    assert cars_on(plan.courses, 11) == [1, 5, 5]


def test_all_is_the_catalogue_without_the_roads_held_out():
    plan = plan_car(RaceRequest(tracks=("all",), hold_out=("reinvent_base",)))
    trained = {one.track.name for one in plan.courses}
    away = {"reinvent_base", "reinvent_carpet", "reinvent_concrete", "reinvent_wood"}
    assert trained == set(names()) - away
    assert plan.settings.rollout.num_worlds == 4 * len(trained), "a few cars on each"
    assert (plan.settings.evaluation.every, plan.settings.evaluation.share) == (10, 0.25), "evaluations are long"
    assert planned(tracks=("Oval_track,Vegas_track",)).settings.rollout.num_worlds == 4, "but as is set"


def test_the_same_road_is_known_whichever_way_round_and_however_painted():
    assert set(twins_of([load_track("2024_reinvent_champ_cw")])) == {
        "2022_summit_speedway", "2022_summit_speedway_ccw", "2022_summit_speedway_cw",
        "2024_reinvent_champ_ccw", "2024_reinvent_champ_cw",
    }  # fmt: skip
    assert are_alike(load_track("LGSWide"), load_track("LGSWide").reversed())
    assert not are_alike(load_track("Spain_track"), load_track("Monaco")), "60.0 m and 60.3 m, and another shape"
    assert not are_alike(load_track("Straight_track"), load_track("Oval_track"))
    (note,) = (
        one for one in planned(track="2022_june_open", hold_out=("2022_june_open_cw",)).notes if "yet known" in one
    )
    assert "2022_june_open_cw is the road of 2022_june_open" in note


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    place = tmp_path_factory.mktemp("runs")
    rows = np.load(_waypoints(place))
    assert len(rows) > 50
    request = RaceRequest(
        run=place / "run",
        overrides=(*FOUR_CARS, "evaluation.every=2"),
        stops=("iterations=2",),
        groups=(*MIXED[:2], {"track": str(place / "garage.npy"), "cars": 1}),
        hold_out=("reinvent_base", "LGSWide"),
    )
    return train(request, NullCallback(), lambda _: None)


def _waypoints(place):
    """A circuit of the user's own, which the catalogue does not have."""
    rows = load_track("reInvent2019_wide").rows
    np.save(place / "garage.npy", 1.1 * rows)
    return place / "garage.npy"


def test_each_group_drives_on_its_own_road(trained):
    ticks = polars.read_parquet(trained.run.episodes / "1.parquet")
    driven = dict(ticks.group_by("world").agg(polars.col("track_length_m").first()).iter_rows())
    roads = [load_track(name).as_filed().length for name in ("Oval_track", "Vegas_track", "Vegas_track")]
    assert [driven[world] for world in range(3)] == pytest.approx(roads)
    assert driven[3] == pytest.approx(1.1 * load_track("reInvent2019_wide").as_filed().length, rel=1e-3)


def test_the_table_says_how_it_drives_on_each_track(trained):
    iteration, results = read_generalisation(trained.run.generalisation)
    assert iteration == 2
    assert [(one.label, one.role, one.laps) for one in results] == [
        ("Oval_track", "trained", 2),
        ("Vegas_track boxes", "trained", 2),
        ("garage", "trained", 2),
        ("reinvent_base", "held_out", 2),
        ("LGSWide", "held_out", 2),
    ]
    with open(trained.run.generalisation, newline="") as file:
        assert tuple(next(csv.reader(file))) == COLUMNS
    told = json.loads((trained.run.evaluations / "2.json").read_text())
    assert len(told["laps"]) == 6, "laps of the tracks that are trained on"
    means = [float(np.mean([lap["progress_percent"] for lap in told["laps"][k : k + 2]])) for k in (0, 2, 4)]
    assert [one.mean_progress_percent for one in results[:3]] == pytest.approx(means, abs=1e-3)
    first, second = trained.run.read_metrics()
    assert "held_out_progress" not in first, "evaluated in every second iteration"
    assert second["evaluation_score"] == pytest.approx(np.mean(means)), "the held-out ones count not"
    assert second["trained_worst_progress"] == pytest.approx(min(means), abs=1e-3)
    assert second["held_out/LGSWide"] == results[4].mean_progress_percent
    assert second["held_out_progress"] == pytest.approx(
        np.mean([one.mean_progress_percent for one in results[3:]]), abs=1e-3
    )


def test_nobody_trains_on_what_is_held_out(trained):
    away = {round(load_track(name).as_filed().length, 3) for name in ("reinvent_base", "LGSWide")}
    for path in trained.run.episodes.iterdir():
        assert not away & set(polars.read_parquet(path)["track_length_m"].round(3))


def test_a_run_goes_on_with_its_groups_and_its_own_copy_of_a_track(trained):
    before = trained.run.read_job()
    assert (trained.run.tracks / "garage.npy").is_file()
    again = plan_resume(trained.run.path)
    assert [one.as_dictionary() for one in again.courses] == before["courses"]
    assert [track.name for track in again.held_out] == ["reinvent_base", "LGSWide"]
    resume(trained.run.path, ("iterations=4",), NullCallback(), lambda _: None)
    iteration, results = read_generalisation(trained.run.generalisation)
    assert (iteration, len(results)) == (4, 5)


def test_a_held_out_track_that_has_changed_is_named(trained):
    job = trained.run.read_job()
    held_out = job["held_out"]
    trained.run.write_job(job | {"held_out": [held_out[0] | {"hash": "another"}, held_out[1]]})
    try:
        with pytest.raises(RunFolderError, match="its course on 'reinvent_base' has changed since the run began"):
            plan_resume(trained.run.path)
    finally:
        trained.run.write_job(job)


WRONG = [  # words of a request, what the message holds
    ({"groups": ("race=OBJECT_AVOIDENCE",)}, "Did you mean 'OBJECT_AVOIDANCE'?"),
    ({"groups": ("race=HEAD_TO_BOT boxes.number=2",)}, "boxes.number is of"),
    ({"groups": ("boxes.number=2",)}, "--group 'boxes.number=2': There is no setting 'boxes.number'"),
    ({"groups": ("cars=0",)}, "cars=0; expected a whole number from 1"),
    ({"groups": ("direction=both cars=1",)}, "one car cannot drive both ways"),
    ({"groups": ("sensors=LIDAR",)}, "one network drives every group; expected groups with the same sensors"),
    ({"groups": ("camera.width=80",)}, "camera.width is one for the whole training"),
    ({"groups": ("race.type=HEAD_TO_BOT",)}, "race.type is not said so; expected race="),
    ({"groups": ("colour=red",)}, "a group knows no 'colour'"),
    ({"groups": ("cars",)}, "'cars' says nothing; expected word=value"),
    ({"groups": ("cars=3",)}, "rollout.num_worlds is 4, the groups ask for 3 cars; expected 3"),
    ({"groups": ("cars=4", "track=Oval_track")}, "the groups ask for 4 cars and 1 more are to be driven on; expected"),
    ({"track": "Oval_track", "tracks": ("Vegas_track",)}, "--track and --tracks were given"),
    ({"hold_out": ("all",)}, "leaves no track to train on"),
    ({"track": "Oval_track", "hold_out": ("oval_track",)}, "--hold-out Oval_track: cars are trained on it too"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "found"), WRONG)
def test_what_cannot_be_trained_gets_a_letter(words, found):
    with pytest.raises((SettingError, TrackError)) as caught:
        planned(**words)
    assert any(part in str(caught.value) for part in found.split("|"))


def test_boxes_that_do_not_fit_on_a_held_out_track_are_named_before_the_training():
    overrides = (*FOUR_CARS, "race.type=OBJECT_AVOIDANCE", "boxes.number=12", "boxes.min_distance=1.5")
    with pytest.raises(SettingError, match="Bowtie_track"):
        planned(track="2022_june_open", hold_out=("Bowtie_track",), overrides=overrides)


def test_a_file_of_groups(tmp_path):
    path = tmp_path / "groups.json"
    path.write_text(json.dumps([{"track": "Oval_track", "cars": 3}, "track=Vegas_track cars=1"]))
    assert [(one.track, one.cars) for one in requested_groups((), read_groups(path))] == [
        ("Oval_track", 3),
        ("Vegas_track", 1),
    ]
    for text in ("{}", "[1]", "[]", "["):
        path.write_text(text)
        with pytest.raises(UserInputError, match=r"groups\.json:"):
            read_groups(path)


def test_from_python_a_word_alone_is_a_list_of_one(tmp_path):
    import racecraft as rc

    trained = rc.train(
        "deepracer",
        tracks="Oval_track,Vegas_track",
        group={"cars": 2},
        hold_out="LGSWide",
        settings=FOUR_CARS,
        stops="iterations=1",
        run=tmp_path / "run",
        quiet=True,
    )
    told = rc.evaluate(trained.run.path, tracks="held-out,Oval_track", laps=2)
    assert [(one["label"], one["role"]) for one in told["tracks"]] == [
        ("LGSWide", "held_out"),
        ("Oval_track", "trained"),
    ]
