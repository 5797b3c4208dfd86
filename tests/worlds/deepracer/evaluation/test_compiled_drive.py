"""Drives in compiled code are those that the policy drives tick by tick; who is not plain is asked tick by tick."""

import numpy as np
import pytest
import torch
from torch import nn

from racecraft.algorithms.architecture import Architecture
from racecraft.algorithms.compiled_policy import MAX_PRODUCTS, compile_policy
from racecraft.algorithms.kernels.greedy_action import argmax_action
from racecraft.algorithms.ppo import PpoLearner
from racecraft.algorithms.ppo_config import PpoConfig
from racecraft.contract.world import allocate
from racecraft.players.trained import GreedyPolicy
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME
from racecraft.worlds.deepracer.env.sensors import FRONT
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.variation import VariationConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation import compiled_drive as drives
from racecraft.worlds.deepracer.evaluation import laps
from racecraft.worlds.deepracer.evaluation.compiled_drive import compiled_drive
from racecraft.worlds.deepracer.evaluation.laps import judge_laps, judge_starts
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(-0.35, 1.0), (0.0, 1.0), (0.35, 1.0)])
NETWORK = Architecture(convolutions=((8, 6, 3), (16, 3, 2)), trunk_units=(32,), privileged_critic=True)


def world_of(cars, episode_laps=1, **asked):
    return RaceWorld(
        load_track("reinvent_base"), ACTIONS, num_cars=cars, laps=episode_laps, camera_config=CameraConfig(40, 30),
        **asked,
    )  # fmt: skip


@pytest.fixture(scope="module")
def learner():
    """A learner that has learned from a plain rule, so that it gets round: its laps end in every way."""
    world = world_of(16)
    learner = PpoLearner(world.spec, NETWORK, PpoConfig(), seed=1)
    frames, choices = driven_by_rule(world, 220)
    optimiser = torch.optim.Adam(learner.network.parameters(), 3e-3)
    chance = torch.Generator().manual_seed(0)
    for _ in range(100):
        rows = torch.randint(len(frames), (128,), generator=chance)
        loss = nn.functional.cross_entropy(learner.network.policy({FRONT: frames[rows]}), choices[rows])
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    return learner


def driven_by_rule(world, ticks):
    """What cars see that keep to the road by a plain rule, (T * N, H, W), and what they choose."""
    buffers, frames, choices = allocate(world.spec), [], []
    world.reset(buffers, 0)
    for _ in range(ticks):
        told = buffers.observations[CRITIC_NAME]
        wanted = told[..., 7] - 0.5 * told[..., 0]
        chosen = np.where(wanted > 0.1, 2, np.where(wanted < -0.1, 0, 1))
        frames.append(buffers.observations[FRONT][:, 0].copy())
        choices.append(chosen[:, 0])
        world.step(chosen, buffers)
    return torch.from_numpy(np.concatenate(frames)), torch.from_numpy(np.concatenate(choices))


def both_ways(monkeypatch, judge):
    """What is judged in compiled code, and what is judged tick by tick."""
    compiled = judge()
    with monkeypatch.context() as patch:
        patch.setattr(laps, "compiled_drive", lambda policy, world: None)
        return compiled, judge()


@pytest.mark.parametrize(
    "asked",
    [
        {},
        {"race_config": RaceConfig(fidelity="aws")},
        {"race_config": RaceConfig(type="OBJECT_AVOIDANCE"), "objects": BoxesConfig()},
        {"race_config": RaceConfig(max_episode_seconds=5.0)},
    ],
    ids=["alone", "aws", "boxes", "cut"],
)
def test_a_compiled_drive_is_the_drive_tick_by_tick(learner, monkeypatch, asked):
    policy = GreedyPolicy(learner)
    starts, flying = world_of(4, **asked), world_of(1, 2, start_shares=[0.0], **asked)
    assert compiled_drive(policy, starts) is not None
    compiled, by_ticks = both_ways(monkeypatch, lambda: judge_starts(policy, starts, seed=7))
    assert compiled == by_ticks
    assert max(lap.steps for lap in compiled.laps) > 20
    compiled, by_ticks = both_ways(monkeypatch, lambda: judge_laps(policy, flying, 2))
    assert compiled == by_ticks
    assert asked or compiled.full_laps  # it goes on behind a full lap, too


def test_a_compiled_drive_comes_back_to_python_and_goes_on(learner, monkeypatch):
    policy, world = GreedyPolicy(learner), world_of(3)
    whole = judge_starts(policy, world)
    monkeypatch.setattr(drives, "TICKS_AT_ONCE", 7)
    assert judge_starts(policy, world) == whole


def test_a_drive_has_the_weights_of_its_moment(learner):
    policy, world = GreedyPolicy(learner), world_of(3)
    before = judge_starts(policy, world)
    bias = learner.network.policy_head.bias
    with torch.no_grad():
        bias[0] += 100.0
        turned = judge_starts(policy, world)
        bias[0] -= 100.0
    assert turned != before
    assert judge_starts(policy, world) == before


@pytest.mark.parametrize(
    "network",
    [
        NETWORK,
        Architecture(convolutions=((5, 4, 3),), image_units=(9,), trunk_units=(7, 11), activation="tanh"),
        Architecture(convolutions=(), trunk_units=()),
    ],
    ids=["default's kind", "tanh and odd widths", "no layers"],
)
def test_a_compiled_look_chooses_as_pytorch_does(network):
    world = world_of(1)
    learner = PpoLearner(world.spec, network, PpoConfig(), seed=3)
    with torch.no_grad():
        learner.network.policy_head.weight.mul_(100.0)
    look = learner.compile_policy(FRONT, (30, 40))
    frames = np.random.default_rng(0).integers(0, 256, (200, 30, 40), np.uint8)
    buffer = np.zeros((3, look.buffer_size), np.float32)
    found = [argmax_action(look.layers, look.weights, look.scale, frame, buffer) for frame in frames]
    assert found == learner.choose({FRONT: frames}).tolist()
    assert len(set(found)) > 1


def test_what_is_not_plain_is_asked_tick_by_tick(learner):
    policy = GreedyPolicy(learner)

    class Rule:
        def act(self, observations, action_mask=None): ...

        def reset_state(self, rows): ...

    assert compiled_drive(policy, world_of(1)) is not None
    assert compiled_drive(Rule(), world_of(1)) is None
    assert compiled_drive(policy, world_of(1, cars_per_world=2)) is None
    assert compiled_drive(policy, world_of(1, reward=lambda params: 1.0)) is None
    assert compiled_drive(policy, world_of(1, variation=VariationConfig(lamps=True))) is None
    assert compile_policy(learner.network, learner.distribution, "another camera", (30, 40)) is None
    wide = PpoLearner(world_of(1).spec, Architecture(trunk_units=(MAX_PRODUCTS // 1200 + 1,)), PpoConfig(), seed=1)
    assert wide.compile_policy(FRONT, (30, 40)) is None
