"""A run that is kept in a bucket while it trains: what the bucket holds, at each moment and in the end."""

import json
import threading
import time

import numpy as np
import pytest
from tests.storage.servers import Wire, needs_s3

from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.storage.address import Address
from racecraft.storage.mirror import Mirror
from racecraft.storage.object_store import NetworkError, StoredObject
from racecraft.storage.transfer import files_below

AT = Address("bucket", "fast-car")
INDEX = "fast-car/checkpoints/checkpoints.json"


class Shelf:
    """A store in memory that remembers whether its index ever named what was not there, and breaks as told."""

    def __init__(self):
        self.objects, self.broken, self.slow, self.lies = {}, False, threading.Event(), []
        self.slow.set()

    def listed(self, place):
        self._reach()
        return {place.name(key): StoredObject(len(data), "unknown") for key, data in self.objects.items()}

    def put(self, bucket, key, path):
        self.write(bucket, key, path.read_bytes())

    def write(self, bucket, key, data):
        self._reach()
        self.objects[key] = data
        self._look()

    def remove(self, bucket, keys):
        self._reach()
        for key in keys:
            self.objects.pop(key, None)
        self._look()

    def _reach(self):
        self.slow.wait()
        if self.broken:
            raise NetworkError("the wire is cut; expected it whole.")

    def _look(self):
        if INDEX in self.objects:
            entries = json.loads(self.objects[INDEX])["checkpoints"]
            named = {
                f"fast-car/checkpoints/{name}" for one in entries for name in (one["policy"], one["state"]) if name
            }
            self.lies += sorted(named - set(self.objects))


@pytest.fixture
def run(tmp_path):
    return RunFolder.create(tmp_path / "run", {"kind": "deepracer"})


def train(run, iteration):
    run.append_metrics({"iteration": iteration})
    weights = {"w": np.full(8, iteration, np.float32)}
    Checkpoints(run.checkpoints).save(iteration, iteration, weights, {}, {"at": iteration})


def as_found(run):
    return {f"fast-car/{name}": path.read_bytes() for name, path in files_below(run.path).items()}


def until(done, seconds=60.0):
    end = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.01)


def test_the_bucket_holds_the_run_in_the_end_and_no_old_states(run):
    store = Shelf()
    mirror = Mirror(run.path, AT, store)
    for iteration in range(6):
        train(run, iteration)
        mirror.changed()
        time.sleep(0.01)
    done = mirror.close()
    assert (done.missing, done.trouble) == ((), "")
    assert store.objects == as_found(run)
    assert store.lies == []


def test_a_broken_network_stops_nothing_and_is_tried_again(run):
    store = Shelf()
    store.broken = True
    mirror = Mirror(run.path, AT, store, rest_seconds=0.0)
    train(run, 0)
    mirror.changed()
    time.sleep(0.05)
    store.broken = False
    train(run, 1)
    mirror.changed()
    assert mirror.close().missing == ()
    assert store.objects == as_found(run)


def test_what_the_bucket_lacks_in_the_end_is_said(run):
    store = Shelf()
    mirror = Mirror(run.path, AT, store)
    train(run, 0)
    mirror.changed()
    until(lambda: store.objects == as_found(run))
    store.broken = True
    train(run, 1)
    done = mirror.close()
    assert "checkpoints/1.policy.safetensors" in done.missing
    assert "job.json" not in done.missing
    assert "the wire is cut" in done.trouble
    assert store.lies == []


def test_a_slow_network_is_not_waited_for(run):
    store = Shelf()
    store.slow.clear()
    mirror = Mirror(run.path, AT, store, last_seconds=0.1)
    train(run, 0)
    began = time.monotonic()
    mirror.changed()
    done = mirror.close()
    assert time.monotonic() - began < 20
    assert "slow" in done.trouble
    assert done.missing
    store.slow.set()


def test_a_run_that_is_gone_on_with_takes_up_what_the_bucket_holds(run):
    store = Shelf()
    for iterations in (range(0, 4), range(4, 7)):
        mirror = Mirror(run.path, AT, store)
        for iteration in iterations:
            train(run, iteration)
        mirror.changed()
        mirror.close()
    assert store.objects == as_found(run)


@needs_s3
def test_over_a_wire_that_breaks(store, run):
    with Wire(store.url, [4_000, 2_000, 9_000]) as wire:
        mirror = Mirror(run.path, Address(store.bucket, "fast-car"), store.open(wire.url), rest_seconds=0.0)
        for iteration in range(3):
            train(run, iteration)
            mirror.changed()
        assert mirror.close().missing == ()
    assert store.contents() == as_found(run)


@needs_s3
def test_a_run_that_was_killed_before_its_first_iteration_comes_back_from_its_bucket_and_goes_on(moto_store, tmp_path):
    from racecraft.storage.transfer import pull
    from racecraft.training import worlds
    from racecraft.training.callbacks import NullCallback
    from racecraft.worlds.gymnasium.training.trainer import GymRequest

    class Killed(NullCallback):
        def run_made(self, path):
            self.mirror = Mirror(path, Address("bucket", "cart"), moto_store.open())

        def begin(self, *told):
            self.mirror.changed()
            assert self.mirror.close().missing == ()
            raise SystemExit

    small = ("rollout.num_worlds=2", "rollout.horizon=8", "evaluation.episodes=1", "runtime.threads=1")
    asked = GymRequest("CartPole-v1", run=tmp_path / "a", stops=("iterations=1",), overrides=small)
    with pytest.raises(SystemExit):
        worlds.train(asked, Killed(), lambda text: None)
    pull(moto_store.open(), Address("bucket", "cart"), tmp_path / "b")
    assert not (tmp_path / "b" / "episodes").exists(), "a bucket keeps no empty folders"
    worlds.resume(tmp_path / "b", (), NullCallback(), lambda text: None)
    assert [row["iteration"] for row in RunFolder.open(tmp_path / "b").read_metrics()] == [1]
