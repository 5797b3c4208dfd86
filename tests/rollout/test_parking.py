"""A car whose quota is full parks: nothing is driven, counted or thought for it."""

import math

import numpy as np
import torch

from racecraft.algorithms.learner import Decision
from racecraft.rollout.collector import Collector
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.recorder import EpisodeRecorder

ACTIONS = ActionTable.of([(math.radians(angle), 1.0) for angle in (-30, 0, 30)])


class Dice:
    """Chooses at random and counts whom it was asked about."""

    device = torch.device("cpu")
    columns = {}

    def __init__(self):
        self.asked = 0

    def act(self, observations, action_mask=None, *, generator=None, rows=None):
        count = len(observations["FRONT_FACING_CAMERA"])
        assert rows is None or len(rows) == count, "who is asked about is told"
        self.asked += count
        return Decision(torch.randint(0, 3, (count,), generator=generator).numpy(), {})

    def reset_state(self, rows):
        pass


def make_collector(num_cars, recorder=None, fidelity="aws"):
    world = RaceWorld(
        load_track("reinvent_base"), ACTIONS, lambda params: 1.0, race_config=RaceConfig(fidelity=fidelity),
        camera_config=CameraConfig(16, 12), num_cars=num_cars,
    )  # fmt: skip
    return Collector(world, Dice(), 1, seed=5, observers=[recorder] if recorder else [])


def test_every_car_drives_exactly_its_quota():
    recorder = EpisodeRecorder()
    collector = make_collector(4, recorder)
    for iteration in (1, 2):
        before = collector.steps_taken, collector.actor.asked
        kept = collector.collect_episodes(3)
        episodes = collector.pop_episodes()
        lengths = sum(episode.steps for episode in episodes)
        assert sorted(episode.world for episode in episodes) == [0] * 3 + [1] * 3 + [2] * 3 + [3] * 3
        assert collector.steps_taken - before[0] == collector.actor.asked - before[1] == lengths
        assert kept.num_active == lengths, "at AWS every tick is learned from, the prepare tick included"
        columns = recorder.pop(iteration)
        assert len(columns["tick"]) == lengths
        assert "park" not in set(columns["status"])
        assert columns["done"].sum() == 12


def test_twenty_episodes_start_all_round_the_track_however_many_cars_share_them():
    for num_cars in (1, 4, 20):
        collector = make_collector(num_cars)
        for _ in range(2):
            starts = set()
            collector.observers = [
                lambda world, *_, seen=starts: seen.update(np.round(world.reports["start_share"], 6).flat)
            ]
            collector.collect_episodes(20 // num_cars)
            assert starts == set(np.round(np.arange(20) / 20, 6))


def test_a_parked_car_stands_and_is_paid_nothing():
    collector = make_collector(2)
    world, rewards, standing = collector.world, [], []

    def watch(world, buffers, actions):
        parked = world.reports["status"] == race.PARK
        rewards.extend(buffers.reward[parked])
        standing.extend((n, world.cars["x"][n, 0], world.cars["ticks"][n, 0]) for n in np.flatnonzero(parked))

    collector.observers = [watch]
    while not rewards:
        collector.collect_episodes(1)
    assert set(rewards) == {0.0}
    for n in {n for n, _, _ in standing}:
        assert {ticks for m, _, ticks in standing if m == n} == {0}
    collector.collect_episodes(1)
    assert (world.cars["episode"] == world.cars["episode"][0]).all()


def test_a_restored_collector_goes_on_bit_by_bit_after_parking():
    first, second = make_collector(3), make_collector(3)
    first.collect_episodes(2)
    second.restore(first.state())
    left, right = first.collect_episodes(2), second.collect_episodes(2)
    assert first.steps_taken == second.steps_taken
    for name in ("actions", "reward", "terminated", "active"):
        assert (getattr(left, name) == getattr(right, name)).all(), name
    assert (left.observations["FRONT_FACING_CAMERA"] == right.observations["FRONT_FACING_CAMERA"]).all()
