"""Live ticks of cars that workers drive: a page is told of them what it would be told if they were driven here."""

import os
import sys
import time
from pathlib import Path

import numpy as np
import polars
import pytest
from tests.cluster.workers_here import spread_here

from racecraft.formats import live_ticks
from racecraft.formats.live_ticks import WISH_SECONDS, read_live_ticks, request_ticks
from racecraft.formats.run_folder import RunFolder
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.analysis.watching.playback import iteration_playback, live_playback
from racecraft.worlds.deepracer.training import live
from racecraft.worlds.deepracer.training.live import RING_TICKS, LivePublisher
from racecraft.worlds.deepracer.training.plan import RaceRequest
from racecraft.worlds.deepracer.training.recorder import EpisodeRecorder
from racecraft.worlds.deepracer.training.remote_live import RemoteLiveTicks

sys.path.append(str(Path(__file__).resolve().parents[3]))
from kept_run import drive, make_courses, make_world  # noqa: E402


@pytest.fixture(autouse=True)
def _no_hurry(monkeypatch):
    """However slow this machine is, ticks are left whole and stay live."""
    monkeypatch.setattr(live, "PART_SECONDS", 1e6)
    monkeypatch.setattr(live_ticks, "LIVE_SECONDS", 1e6)


@pytest.fixture
def run(tmp_path):
    return RunFolder.create(tmp_path / "r", {"kind": "deepracer"})


def wish(run, seconds=60.0):
    """Wish for ticks as of a moment so far in the future: whatever must be compiled meanwhile, the wish holds."""
    request_ticks(run)
    moment = time.time_ns() + int(seconds * 1e9)
    os.utime(run.watched, ns=(moment, moment))


def driven(world, ticks=RING_TICKS, observers=()):
    """Drive and return the ticks as a worker keeps them, the first tick left out: a publisher here does so, too."""
    recorder = EpisodeRecorder()
    buffers = drive(world, 1, observers)
    drive(world, ticks, [*observers, recorder], 1, buffers)
    return recorder.pop(1)


def shared_out(columns, shares):
    """Return the ticks of so many worlds each, as if a worker had driven them."""
    return [
        {name: column[np.isin(columns["world"], worlds)] for name, column in columns.items()}
        for worlds in np.split(np.unique(columns["world"]), np.cumsum(shares)[:-1])
    ]


@pytest.mark.parametrize(
    ("make", "shares"), [(make_courses, (3, 2)), (lambda: make_world(4, 2), (1, 2, 1))], ids=["courses", "races"]
)
def test_a_page_is_told_what_it_is_told_of_cars_driven_here(run, monkeypatch, make, shares):
    monkeypatch.setattr(live, "LOOK_SECONDS", 0.0)
    here = LivePublisher(run)
    wish(run)
    columns = driven(make(), observers=[here])
    expected = live_playback(run, 0)
    wish(run)
    hears = RemoteLiveTicks(run)
    hears(shared_out(columns, shares))
    told = live_playback(run, 0)
    assert told["last"] == RING_TICKS == told["ticks"]
    told["objects"] = {world: stands for world, stands in told["objects"].items() if stands}
    for name in ("cars", "objects", "endings", "ticks"):
        assert told[name] == expected[name], name


def test_nothing_is_left_unless_somebody_wishes_and_ticks_are_numbered_through(run):
    hears, parts = RemoteLiveTicks(run), shared_out(driven(make_world(2), 20), (1, 1))
    hears(parts)
    assert read_live_ticks(run) is None
    wish(run)
    hears(parts)
    assert read_live_ticks(run).last == 40
    hears(parts)
    assert read_live_ticks(run).last == 40, "one wish is answered once"
    wish(run)
    hears(parts)
    assert live_playback(run, 60)["first"] == 61
    wish(run, -WISH_SECONDS - 1)
    hears(parts)
    assert read_live_ticks(run).last == 80, "nobody is answered who wished long ago"


def test_a_car_that_was_parked_before_the_others_stands_at_the_end(run):
    columns = driven(make_world(2), 30)
    short = (columns["world"] == 0) & (np.arange(len(columns["world"])) >= 10)
    wish(run)
    RemoteLiveTicks(run)(shared_out({name: column[~short] for name, column in columns.items()}, (1, 1)))
    first, second = live_playback(run, 0)["cars"]
    assert [x is None for x in first["x"]] == [False] * 10 + [True] * 20
    assert None not in second["x"]


def test_a_training_on_a_cluster_is_watched(tmp_path):
    class Watcher(NullCallback):
        """Looks at every iteration, and wishes for the next."""

        def run_made(self, path):
            self.run, self.reels = RunFolder(path), []
            wish(self.run)

        def iteration(self, report):
            self.reels.append(live_playback(self.run, self.reels[-1]["last"] if self.reels else 0))
            wish(self.run)

    watcher = Watcher()
    small = ("rollout.num_worlds=5", "rollout.horizon=30", "evaluation.every=1", "evaluation.episodes=1")
    overrides = (*small, "runtime.threads=1", "race.type=OBJECT_AVOIDANCE")
    request = RaceRequest(run=tmp_path / "run", stops=("iterations=3",), overrides=overrides)
    train(request, watcher, lambda text: None, spread_here(2)[0])
    assert [(reel["first"], reel["last"]) for reel in watcher.reels] == [(1, 30), (31, 60), (61, 90)]
    kept = iteration_playback(watcher.run, 3)
    assert watcher.reels[2]["cars"] == kept["cars"]
    assert watcher.reels[2]["objects"] == kept["objects"]
    assert len(kept["objects"]) == 5
    ticks = polars.read_parquet(tmp_path / "run" / "episodes" / "3.parquet")
    assert sorted(ticks["world"].unique()) == [0, 1, 2, 3, 4]
