"""Workers that send what was done: the learner's machine sees what they saw, bit by bit, whatever is on the road."""

import dataclasses
import json
import re

import numpy as np
import pytest
import torch
from tests.cluster.test_spread_training import assert_same
from tests.cluster.workers_here import spread_here

from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.cluster.collector import ClusterCollector
from racecraft.cluster.transport import ClusterError
from racecraft.cluster.worker import Worker
from racecraft.contract.errors import SettingError
from racecraft.training.callbacks import Silent
from racecraft.training.worlds import resume, train
from racecraft.worlds.deepracer.training.plan import RaceRequest

SMALL = (
    "rollout.num_worlds=6",
    "rollout.horizon=40",
    "evaluation.every=2",
    "evaluation.episodes=1",
    "runtime.threads=1",
    "race.max_episode_seconds=4",
    "network.hidden_units=8",
    "network.conv_filters=4",
    "network.conv_kernels=4",
    "network.conv_strides=2",
    "ppo.epochs=1",
)
LIDAR_AND_TWO_EYES = ["STEREO_CAMERAS", "LIDAR"]
DRIVES = {
    "time trial": ((), {}),
    "full frames of an older car": (("camera.width=160", "camera.height=120", "race.car=v4"), {}),
    "boxes that change places": (("race.type=OBJECT_AVOIDANCE", "boxes.random=true"), {}),
    "bots that change lanes, two eyes and a LiDAR": (
        ("race.type=HEAD_TO_BOT", "bots.lane_change=true", "bots.lane_change_after_low=0.2"),
        {"eyes": True},
    ),
    "all that varies": (("variation.level=strong", "race.type=OBJECT_AVOIDANCE"), {}),
    "two courses, one with boxes": ((), {"tracks": ("reinvent_base", "Bowtie_track")}),
    "whole episodes": (("rollout.episodes_per_iteration=12",), {}),
    "a learner beside": (("ppo.asynchronous=true",), {}),
}


@pytest.fixture(autouse=True)
def _threads_as_before():
    threads = torch.get_num_threads()
    yield
    torch.set_num_threads(threads)


def asked(place, name, send, iterations=4):
    more, told = DRIVES[name]
    folder = None
    if told.get("eyes"):
        folder = place.with_name(f"{place.name} car")
        folder.mkdir()
        actions = [{"steering_angle": angle, "speed": 1.0} for angle in (-30, 0, 30)]
        metadata = {"action_space": actions, "sensor": LIDAR_AND_TWO_EYES, "version": "6"}
        (folder / "model_metadata.json").write_text(json.dumps(metadata))
    return RaceRequest(
        folder,
        run=place,
        tracks=told.get("tracks", ()),
        stops=(f"iterations={iterations}",),
        overrides=(*SMALL, *more, f"cluster.send={send}"),
    )


@pytest.fixture
def collected(monkeypatch):
    """Everything that a cluster's collector handed to its learner, copied."""
    batches, collect = [], ClusterCollector._collect

    def noted(self, quota):
        batches.append(copied(collect(self, quota)))
        return batches[-1]

    monkeypatch.setattr(ClusterCollector, "_collect", noted)
    return batches


def copied(part):
    if isinstance(part, RolloutBatch):
        return dataclasses.replace(part, **{name: copied(value) for name, value in vars(part).items()})
    if isinstance(part, dict):
        return {name: copied(value) for name, value in part.items()}
    return None if part is None else part.copy()


def arrays(batch):
    for name, part in vars(batch).items():
        parts = {f"{name}.{key}": value for key, value in part.items()} if isinstance(part, dict) else {name: part}
        yield from parts.items()


def trained(request, workers=2, **more):
    told = []
    spread, transport = spread_here(workers, **more)
    train(request, Silent(), told.append, spread)
    return told, transport


def bytes_a_step(told):
    return int(re.search(r"cluster: ([\d,]+) bytes came", "\n".join(told))[1].replace(",", ""))


@pytest.mark.parametrize("name", DRIVES)
def test_what_is_seen_again_is_what_was_seen(tmp_path, collected, name):
    frames, _ = trained(asked(tmp_path / "frames", name, "frames"))
    seen, collected[:] = list(collected), []
    actions, _ = trained(asked(tmp_path / "actions", name, "actions"))
    assert len(seen) == len(collected) == 4
    assert any(batch.terminated.any() or batch.truncated.any() for batch in seen), "episodes end, and others begin"
    for one, other in zip(seen, collected, strict=True):
        mine, theirs = dict(arrays(one)), dict(arrays(other))
        assert mine.keys() == theirs.keys()
        differing = [key for key in mine if not np.array_equal(mine[key], theirs[key])]
        assert not differing
    assert_same(tmp_path / "frames", tmp_path / "actions")
    assert bytes_a_step(actions) < 0.2 * bytes_a_step(frames)
    assert re.search(r"seen again here in \d", "\n".join(actions))


def test_ticks_for_the_episode_files_are_kept_where_it_is_seen_again(tmp_path):
    import polars

    name = "bots that change lanes, two eyes and a LiDAR"
    for send in ("frames", "actions"):
        trained(asked(tmp_path / send, name, send, iterations=2))
    files = [polars.read_parquet(tmp_path / send / "episodes" / "2.parquet") for send in ("frames", "actions")]
    assert files[0].equals(files[1])
    assert files[0]["reward"].sum() > 0


def test_lost_workers_and_a_resumed_run_change_nothing(tmp_path):
    name = "all that varies"
    trained(asked(tmp_path / "quiet", name, "actions"))
    _, transport = trained(asked(tmp_path / "wild", name, "actions"), lost_at=(1, 4, 5))
    assert transport.ended == 3
    assert_same(tmp_path / "quiet", tmp_path / "wild")
    trained(asked(tmp_path / "broken", name, "actions", iterations=2))
    told = []
    resume(tmp_path / "broken", ("iterations=4",), Silent(), told.append, spread=spread_here(2)[0])
    assert "goes on after iteration 2" in told
    assert_same(tmp_path / "quiet", tmp_path / "broken")


def test_a_worker_that_calculates_differently_is_found_out(tmp_path, monkeypatch):
    state_of = Worker._state

    def elsewhere(self):
        state = state_of(self)
        state["collector"]["world"]["car.x"] = np.nextafter(state["collector"]["world"]["car.x"], 9.0)
        return state

    monkeypatch.setattr(Worker, "_state", elsewhere)
    with pytest.raises(ClusterError, match=r"worker 0 on .* stands elsewhere .*\(car.x\).* cluster.send=frames"):
        trained(asked(tmp_path / "run", "time trial", "actions"))


def test_races_against_others_keep_their_frames(tmp_path):
    request = RaceRequest(run=tmp_path / "run", against=("self",), overrides=(*SMALL, "cluster.send=actions"))
    spread, transport = spread_here(2)
    with pytest.raises(SettingError, match=r"races against others .* cluster.send=frames"):
        train(request, Silent(), lambda text: None, spread)
    assert not transport.asked
