"""Cars on several courses, carried by workers: every car is on the course, and has the number, that it has on one
machine."""

import json
import os
import shutil
import time

import numpy as np
import polars
import pytest
from tests.cluster.test_spread_training import SMALL, assert_same
from tests.cluster.workers_here import spread_here

from racecraft.cluster.shares import parts_of, plan_of_share, shares_of
from racecraft.formats import live_ticks
from racecraft.formats.episodes import columns_of_all
from racecraft.formats.live_ticks import request_ticks
from racecraft.formats.run_folder import RunFolder
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.deepracer.analysis.watching.playback import iteration_playback, live_playback
from racecraft.worlds.deepracer.players.run_courses import cars_on, courses_of_run
from racecraft.worlds.deepracer.training import live
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car

FEW = (*(word for word in SMALL if "num_worlds" not in word), "evaluation.episodes=1")
GROUPS = ("track=Oval_track cars=2", "track=Vegas_track race=OBJECT_AVOIDANCE boxes.number=2 cars=3")
ASKED = {
    "tracks": {"tracks": ("Oval_track,Vegas_track",), "overrides": (*FEW, "rollout.num_worlds=5")},
    "groups": {"groups": GROUPS, "overrides": FEW},
    "one car of a kind": {
        "groups": ("track=Vegas_track race=OBJECT_AVOIDANCE boxes.number=1 cars=1", "track=Oval_track cars=3"),
        "overrides": FEW,
    },
}


def request(name, run, *more, stops="iterations=2"):
    asked = ASKED[name]
    return RaceRequest(run=run, stops=(stops,), **{**asked, "overrides": (*asked["overrides"], *more)})


def trained(name, run, workers=None, *more, stops="iterations=2", **words):
    spread = None if workers is None else spread_here(workers, **words)[0]
    train(request(name, run, *more, stops=stops), NullCallback(), lambda text: None, spread)


def first_ticks(ticks):
    """Return where each world's first car stands before anybody has decided anything."""
    return ticks.filter(polars.col("tick") == 1).group_by("world", maintain_order=True).first()


@pytest.fixture(scope="module")
def run_of(tmp_path_factory):
    """Return the run of a name that was trained by so many workers; None: in one process."""
    runs = tmp_path_factory.mktemp("runs")

    def path_of(name, workers=None):
        run = runs / f"{name} {workers}"
        if not run.exists():
            trained(name, run, workers)
        return run

    return path_of


def ticks_of(run):
    return polars.read_parquet(run / "episodes" / "1.parquet")


@pytest.mark.parametrize("workers", [2, 4])
@pytest.mark.parametrize("name", ASKED)
def test_every_car_is_where_it_is_on_one_machine(run_of, name, workers):
    here, there = ticks_of(run_of(name)), ticks_of(run_of(name, workers))
    assert here.schema == there.schema
    assert here["world"].to_list() == there["world"].to_list(), "ticks are in the order of the worlds"
    mine, theirs = first_ticks(here), first_ticks(there)
    for column in ("world", "x_m", "y_m", "yaw_rad", "track_length_m"):
        assert np.array_equal(mine[column], theirs[column]), column
    if "objects" in here:  # which places are drawn hangs on the worker's chance; how many there are, on the course
        one, other = (table["objects"].struct.unnest().to_numpy() for table in (mine, theirs))
        assert np.array_equal(np.isnan(one), np.isnan(other))


@pytest.mark.parametrize("workers", [2, 4])
@pytest.mark.parametrize("name", ASKED)
def test_what_a_run_says_of_its_courses_holds_for_the_worlds_of_workers(run_of, name, workers):
    """This is what a page goes by when it draws a car on a map."""
    ticks, run = ticks_of(run_of(name, workers)), RunFolder.open(run_of(name, workers))
    courses = courses_of_run(run)
    counts = cars_on(courses, run.read_job()["settings"]["rollout"]["num_worlds"])
    lengths = np.repeat([course.track.length for course in courses], counts)
    told = ticks.group_by("world", maintain_order=True).first()["track_length_m"].to_numpy()
    assert np.allclose(told, lengths)


@pytest.mark.parametrize("name", ["tracks", "groups"])
def test_one_worker_gives_the_curve_of_one_process(run_of, name):
    assert_same(run_of(name), run_of(name, 1))


def test_lost_workers_change_nothing_and_a_run_goes_on(run_of, tmp_path):
    quiet, wild, broken = tmp_path / "quiet", tmp_path / "wild", tmp_path / "broken"
    trained("groups", quiet, 2, stops="iterations=4")
    trained("groups", wild, 2, stops="iterations=4", lost_at=(1, 3))
    assert_same(quiet, wild)
    shutil.copytree(run_of("groups", 2), broken)
    resume(broken, ("iterations=4",), NullCallback(), lambda text: None, spread=spread_here(2)[0])
    assert_same(quiet, broken)


def test_a_page_is_told_of_every_car_on_its_course(tmp_path, monkeypatch):
    monkeypatch.setattr(live, "PART_SECONDS", 1e6)
    monkeypatch.setattr(live_ticks, "LIVE_SECONDS", 1e6)

    class Watcher(NullCallback):
        def run_made(self, path):
            self.run, self.reels = RunFolder(path), []
            self.wish()

        def wish(self):
            request_ticks(self.run)
            moment = time.time_ns() + 10**11
            os.utime(self.run.watched, ns=(moment, moment))

        def iteration(self, report):
            self.reels.append(live_playback(self.run, self.reels[-1]["last"] if self.reels else 0))
            self.wish()

    watcher = Watcher()
    train(request("groups", tmp_path / "run"), watcher, lambda text: None, spread_here(2)[0])
    kept = iteration_playback(watcher.run, 2)
    told = watcher.reels[1]
    assert told["cars"] == kept["cars"]
    assert {world: stands for world, stands in told["objects"].items() if stands} == {
        world: stands for world, stands in kept["objects"].items() if stands
    }
    assert sorted(int(world) for world, stands in kept["objects"].items() if stands) == [2, 3, 4]


def test_shares_have_cars_of_every_course_and_as_many_each():
    plan = plan_car(RaceRequest(tracks=("Oval_track,Vegas_track,LGSWide",), overrides=("rollout.num_worlds=14",)))
    shares = shares_of(parts_of(plan), 4, plan.seed)
    assert parts_of(plan) == (5, 5, 4)
    assert [[block.count for block in share.blocks] for share in shares] == [[2, 1, 1], [1, 2, 1], [1, 1, 1], [1, 1, 1]]
    assert sorted(np.concatenate([share.worlds for share in shares])) == list(range(14))
    assert plan_of_share(plan, shares[0]).settings.rollout.num_worlds == 4


def test_tables_with_other_objects_stand_below_each_other():
    def table(worlds, **records):
        columns = {"episode": np.zeros(len(worlds), int), "world": np.array(worlds)}
        return columns | {
            name: np.ones(len(worlds), [(number, "f4") for number in numbers]) for name, numbers in records.items()
        }

    parts = [table([0, 1]), table([2], objects=("x_0", "x_1"), variation=("a",)), table([3], objects=("x_0",))]
    joined = columns_of_all(parts)
    assert joined["world"].tolist() == [0, 1, 2, 3]
    assert np.array_equal(joined["objects"]["x_0"], [np.nan, np.nan, 1, 1], equal_nan=True)
    assert np.array_equal(joined["objects"]["x_1"], [np.nan, np.nan, 1, np.nan], equal_nan=True)
    assert joined["variation"]["a"].tolist() == [0, 0, 1, 0]
    assert json.dumps(list(joined)) == '["episode", "world", "objects", "variation"]'
