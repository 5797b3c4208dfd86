"""Imitation beside reward: what is shown is done where nobody pays, it fades as asked, and goes on bit for bit."""

import math

import pytest
import torch
from toy_world import CopyTheNumber, Expert, Unpaid, Walk

from racecraft.algorithms.building import build_learner, signal_groups
from racecraft.algorithms.imitation import ImitationConfig, ImitationWrapper
from racecraft.algorithms.learner import DivergedError
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig
from racecraft.algorithms.registry import find_algorithm
from racecraft.contract.errors import SettingError
from racecraft.formats.demonstrations import write_demonstrations
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.demonstrate import demonstrate
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise
from racecraft.settings.composition import Settings
from racecraft.training.settings import RuntimeConfig


@pytest.fixture
def shown(tmp_path):
    path = tmp_path / "shown.safetensors"
    write_demonstrations(path, demonstrate(Expert(), CopyTheNumber(4), 40, seed=1))
    return path


def learner(path, world, ppo=None, memory="none", algorithm="ppo", **values):
    groups = signal_groups() | {"imitation": ImitationConfig(demonstrations=path and str(path), **values)}
    ppo = ppo or PpoConfig(learning_rate=1e-3, batch_size=64)
    network = NetworkConfig(hidden_units=(32,), activation="tanh", memory=memory)
    own = {algorithm: ppo if algorithm == "ppo" else find_algorithm(algorithm).config_class()()}
    settings = Settings(network=network, runtime=RuntimeConfig(), **own, **groups)
    return build_learner(find_algorithm(algorithm), world.spec, settings, 1)


def rollout(pupil, world, ticks=16):
    return Collector(world, pupil, ticks, seed=1).collect()


@pytest.mark.parametrize("precision", ["float32", "bfloat16"])
def test_what_nobody_pays_for_is_done_as_it_was_shown(shown, precision):
    ppo = PpoConfig(learning_rate=1e-3, batch_size=64, precision=precision)
    found = {}
    for strength in (1.0, 0.0):
        world = Unpaid(8)
        pupil = learner(shown, world, ppo, strength=strength, learning_rate=1e-2, batch_size=32)
        collector = Collector(world, pupil, 32, seed=1)
        for _ in range(6):
            told = pupil.update(collector.collect())
        greedy = play_episodes(GreedyPolicy(pupil), CopyTheNumber(4), episodes_each=4, seed=2)
        found[strength] = summarise(greedy).mean_reward
        assert isinstance(pupil, ImitationWrapper) == ("imitation_loss" in told) == bool(strength)
        assert set(told) == set(pupil.figures)
    assert found[1.0] > 7.5 > 5.0 > found[0.0], found


def test_what_acts_takes_over_what_was_imitated(shown):
    """The copy of half the precision acts: it must be the whole network, rounded."""
    pupil = learner(shown, CopyTheNumber(4), PpoConfig(precision="bfloat16"), strength=1.0, learning_rate=1e-2)
    pupil.update(rollout(pupil, CopyTheNumber(4)))
    for _, whole, half in pupil.learner.half._pairs:
        assert torch.equal(whole.to(torch.bfloat16), half)


def test_its_steps_fall_in_a_straight_line_to_nothing(shown):
    pupil, world = learner(shown, CopyTheNumber(4), strength=0.5, steps=200, learning_rate=1e-2), CopyTheNumber(4)
    sizes = []
    for _ in range(4):
        told = pupil.update(rollout(pupil, world))  # 64 steps each
        sizes.append(round(pupil.optimiser.learning_rate, 8))
    assert sizes == [0.005, round(0.005 * (1 - 64 / 200), 8), round(0.005 * (1 - 128 / 200), 8), 0.0002]
    told = pupil.update(rollout(pupil, world))
    assert (pupil.share, told["imitation_loss"]) == (0.0, 0.0)


def test_no_more_than_asked_is_taken_of_what_was_shown(shown):
    pupil = learner(shown, CopyTheNumber(4), strength=1.0, samples_per_update=48, batch_size=32, epochs=2)
    taken = []
    pupil._step = lambda rows: taken.append(len(rows)) or torch.zeros(2)
    pupil.update(rollout(pupil, CopyTheNumber(4)))
    assert taken == [32, 16, 32, 16]


def test_what_is_restored_goes_on_bit_for_bit(shown):
    one, two = (learner(shown, CopyTheNumber(4), strength=1.0, steps=1000) for _ in range(2))
    batch = rollout(one, CopyTheNumber(4))
    one.update(batch)
    two.load_state_dict(one.state_dict())
    assert one.update(batch) == two.update(batch)
    assert two.collected == 128


def test_what_cannot_be_imitated_is_refused(shown):
    with pytest.raises(SettingError, match=r"imitation\.demonstrations=FILE"):
        learner(None, CopyTheNumber(4), strength=1.0)
    with pytest.raises(SettingError, match="beside ppo without a memory"):
        learner(shown, CopyTheNumber(4), memory="lstm", strength=1.0)
    with pytest.raises(SettingError, match="beside ppo without a memory"):
        learner(shown, CopyTheNumber(4), algorithm="reinforce", strength=1.0)
    with pytest.raises(SettingError, match=r"imitation\.demonstrations: the recorded"):
        learner(shown, Walk(4), strength=1.0)


def test_without_a_limit_every_recorded_tick_is_taken_once_in_a_pass(shown):
    pupil = learner(shown, CopyTheNumber(4), strength=1.0, batch_size=7, epochs=3)
    taken = []
    pupil._step = lambda rows: taken.append(rows) or torch.zeros(2)
    pupil.update(rollout(pupil, CopyTheNumber(4)))
    per_pass = math.ceil(len(pupil.shown) / 7)
    assert len(taken) == 3 * per_pass
    for begin in (0, per_pass, 2 * per_pass):
        assert sorted(torch.cat(taken[begin : begin + per_pass]).tolist()) == list(range(len(pupil.shown)))


def test_a_loss_that_is_no_number_is_named(shown):
    pupil = learner(shown, CopyTheNumber(4), strength=1.0, epochs=1, samples_per_update=40, batch_size=32)
    pupil._step = lambda rows: torch.tensor([math.nan, 0.0])
    with pytest.raises(DivergedError, match="After 2 minibatches of what was shown the loss is nan"):
        pupil.update(rollout(pupil, CopyTheNumber(4)))


def test_a_step_goes_down_the_gradient_of_this_minibatch_alone(shown):
    """What the learner left with the weights does not count; twice the same step falls twice."""
    pupil = learner(shown, CopyTheNumber(4), strength=1.0, learning_rate=1e-2)
    rows = torch.arange(32)
    for one in pupil.learner.network.parameters():
        one.grad = torch.full_like(one, 1e6)
    losses = [pupil._step(rows)[0].item() for _ in range(4)]
    assert losses == sorted(losses, reverse=True)
    assert losses[0] == pytest.approx(math.log(4), rel=0.05)  # at first all four numbers are nearly as likely
    assert losses[-1] < losses[0] - 0.01


def test_weights_alone_begin_imitation_anew(shown):
    taught, fresh = (learner(shown, CopyTheNumber(4), strength=1.0) for _ in range(2))
    taught.update(rollout(taught, CopyTheNumber(4)))
    fresh.load_state_dict({"network": taught.state_dict()["network"]})
    assert fresh.collected == 0
    assert fresh.state_dict()["imitation"]["collected"].item() == 0
    assert taught.state_dict()["imitation"]["collected"].item() == 64
    mine, its = taught.state_dict()["network"], fresh.state_dict()["network"]
    assert all(torch.equal(mine[name], its[name]) for name in mine)
