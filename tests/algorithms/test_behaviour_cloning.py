"""Behavioural cloning by hand, by law, and by what it learns from another's episodes."""

import copy
import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from toy_world import CopyTheNumber, Expert, Walk

from racecraft.algorithms.behaviour_cloning import BcConfig, BcLearner, DemonstrationBatch, cloning_loss, to_raw
from racecraft.algorithms.distributions import Categorical, distribution_for
from racecraft.algorithms.learner import DivergedError, Learner
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import SettingError
from racecraft.contract.world import (
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
    WorldSpec,
)
from racecraft.formats.demonstrations import Demonstrations, write_demonstrations
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.demonstrate import demonstrate
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise

NETWORK = NetworkConfig(hidden_units=(16,), activation="tanh")


class Up:
    """Walks up by numbers."""

    def act(self, observations, action_mask=None):
        return np.full((len(observations["clock"]), 1), 0.8, np.float32)

    def reset_state(self, rows):
        pass


class UpByChoice:
    """Walks up by choices, and looks at the mask."""

    def act(self, observations, action_mask=None):
        assert action_mask is not None
        return np.full(len(observations["clock"]), 2)

    def reset_state(self, rows):
        pass


class Fixed(torch.nn.Module):
    """Always the same logits."""

    log_std = None

    def policy(self, observations):
        return torch.tensor([[0.0, math.log(3.0)]]).expand(len(observations["x"]), 2)


def test_the_loss_is_what_a_pencil_says():
    shown = DemonstrationBatch({"x": torch.zeros(4, 1)}, torch.tensor([0, 1, 1, 1]), None)
    loss, agreement = cloning_loss(Fixed(), Categorical(DiscreteActions(2)), shown)
    assert loss.item() == pytest.approx(-(math.log(0.25) + 3 * math.log(0.75)) / 4)
    assert agreement.item() == 0.75


@pytest.mark.parametrize(
    "spec",
    [
        DiscreteActions(3),
        MultiDiscreteActions((3, 2)),
        ContinuousActions((-2.0, 1.0), (2.0, 3.0)),
        HybridActions(ContinuousActions((-2.0,), (6.0,)), MultiDiscreteActions((3,))),
    ],
)
def test_raw_actions_are_the_way_back_from_actions(spec):
    kind, chance = distribution_for(spec), torch.Generator().manual_seed(1)
    from racecraft.algorithms.distributions import numbers_width, params_width

    numbers = numbers_width(spec)
    log_std = torch.full((numbers,), -1.5) if numbers else None
    raw, _ = kind.sample(torch.zeros(32, params_width(spec)), log_std, None, chance)
    raw = raw.clamp(-1, 1) if isinstance(spec, ContinuousActions) else raw
    told = kind.to_actions(raw)
    assert torch.allclose(kind.to_actions(to_raw(told, spec)).float(), told.float(), atol=1e-6)
    if isinstance(spec, ContinuousActions):
        assert torch.allclose(to_raw(told, spec), raw, atol=1e-6)


def test_whole_episodes_are_recorded_in_order():
    shown = demonstrate(UpByChoice(), Walk(3, masked=True), 7, seed=5)
    assert shown.num_episodes == 7
    clocks = shown.observations["clock"][:, 0]
    begins = np.flatnonzero(np.diff(shown.episode, prepend=-1))
    assert (clocks[begins] == 0).all()
    assert (np.diff(clocks)[np.diff(shown.episode) == 0] == 1).all()
    squares = shown.observations["square"].argmax(axis=1)
    assert (shown.reward == np.minimum(squares + 1, 8)).all(), "a reward stands beside what was seen before it"
    assert shown.action_mask.shape == (len(shown), 3)


def test_a_clone_copies_the_number_as_its_expert_does():
    shown = demonstrate(Expert(), CopyTheNumber(4), 20, seed=1)
    learner = BcLearner(CopyTheNumber(4).spec, NETWORK, BcConfig(learning_rate=1e-2, batch_size=16), shown, seed=1)
    first = learner.update(None)
    for _ in range(20):
        last = learner.update(None)
    assert last["loss"] < 0.2 < first["loss"]
    assert last["held_out_agreement"] == 1.0
    assert last["transitions"] == (shown.episode < 18).sum()
    greedy = summarise(play_episodes(GreedyPolicy(learner), CopyTheNumber(4), episodes_each=4, seed=2))
    assert greedy.mean_reward == 8.0


def test_a_clone_of_numbers_hits_them_and_stays_curious():
    world = Walk(4, continuous=True)
    shown = demonstrate(Up(), world, 8, seed=1)
    learner = BcLearner(world.spec, NETWORK, BcConfig(learning_rate=1e-2, batch_size=16), shown, seed=1)
    for _ in range(60):
        figures = learner.update(None)
    seen = {"square": np.eye(9, dtype=np.float32), "clock": np.zeros((9, 1), np.uint8)}
    assert learner.choose(seen)[3:, 0] == pytest.approx(0.8, abs=0.05)
    assert figures["agreement"] == 1.0
    assert learner.network.log_std.item() == pytest.approx(math.log(0.1), abs=1e-6), "sure, and not surer than allowed"


def test_what_is_restored_goes_on_bit_for_bit():
    shown = demonstrate(Expert(), CopyTheNumber(4), 8)
    one, two = (BcLearner(CopyTheNumber(4).spec, NETWORK, BcConfig(), shown, seed=seed) for seed in (1, 2))
    one.update(None)
    two.load_state_dict(one.state_dict())
    assert one.update(None) == two.update(None)
    assert isinstance(one, Learner)


SPEC = WorldSpec("toy", 2, 1, {"x": ArraySpec((2,), np.float32)}, DiscreteActions(3))


def recorded(episodes):
    """Return ticks of so many each episode, of random sights and deeds."""
    rng, ticks = np.random.default_rng(1), sum(episodes)
    told = PolicySpec("bc", SPEC.observations, SPEC.actions).as_dictionary()
    seen = {"x": rng.normal(size=(ticks, 2)).astype(np.float32)}
    whose = np.repeat(np.arange(len(episodes)), episodes).astype(np.int32)
    return Demonstrations(seen, rng.integers(0, 3, ticks), np.zeros(ticks, np.float32), whose, told)


def standing(shown, **settings):
    """Return a learner that moves by nearly nothing."""
    return BcLearner(SPEC, NETWORK, BcConfig(learning_rate=1e-8, **settings), shown, seed=1)


def judged(learner, shown, rows):
    """Return the mean surprise at some ticks and how many the clone would do the same, by PyTorch."""
    logits = learner.network.policy({"x": torch.from_numpy(shown.observations["x"][rows])}).detach()
    done = torch.from_numpy(shown.actions[rows])
    agreed = (logits.argmax(dim=1) == done).float().mean().item()
    return [torch.nn.functional.cross_entropy(logits, done).item(), agreed]


def test_the_last_episodes_are_held_out_and_what_it_tells_is_what_a_pencil_says():
    """A quarter of nine episodes is two: the last two, of 3 and 4 ticks, teach nothing and are judged."""
    shown = recorded([2, 3, 2, 4, 2, 3, 4, 3, 4])
    learner = standing(shown, held_out=0.25, batch_size=20)
    told = learner.update(None)
    assert list(told) == ["loss", "agreement", "held_out_loss", "held_out_agreement", "transitions", "minibatches"]
    expected = [*judged(learner, shown, slice(0, 20)), *judged(learner, shown, slice(20, 27)), 20, 1]
    assert list(told.values()) == pytest.approx(expected, rel=1e-5)
    assert learner.columns == {}
    assert standing(shown, batch_size=6).update(None)["minibatches"] == 5


def test_where_nothing_is_held_out_all_is_learned_from():
    told = standing(recorded([4, 5]), held_out=0.0).update(None)
    assert (told["held_out_loss"], told["held_out_agreement"], told["transitions"]) == (0.0, 0.0, 9)
    assert standing(recorded([4, 5])).update(None)["transitions"] == 9, "a tenth of two episodes is none"


def test_numbers_agree_within_a_tenth_of_their_range_all_of_them():
    class Still(torch.nn.Module):
        """Always the same means, and a deviation of one."""

        log_std = torch.zeros(2)

        def policy(self, observations):
            return torch.zeros(len(observations["x"]), 2)

    near = torch.tensor([[0.19, -0.19], [0.21, 0.0], [0.0, -0.21], [0.0, 0.0]])
    kind = distribution_for(ContinuousActions((-1.0, -1.0), (1.0, 1.0)))
    loss, agreement = cloning_loss(Still(), kind, DemonstrationBatch({"x": torch.zeros(4, 1)}, near, None))
    assert agreement.item() == 0.5
    assert loss.item() == pytest.approx(math.log(2 * math.pi) + near.square().sum().item() / 8, rel=1e-6)


def test_a_step_is_adams_and_every_tick_is_learned_from_once():
    shown = recorded([5, 5])
    learner = BcLearner(SPEC, NETWORK, BcConfig(learning_rate=1e-2, batch_size=10, held_out=0.0), shown, seed=1)
    twin = copy.deepcopy(learner.network)
    optimiser = torch.optim.Adam(twin.parameters(), 1e-2, eps=1e-8)
    for _ in range(2):
        optimiser.zero_grad()
        logits = twin.policy({"x": torch.from_numpy(shown.observations["x"])})
        torch.nn.functional.cross_entropy(logits, torch.from_numpy(shown.actions)).backward()
        optimiser.step()
        learner.update(None)
    for mine, its in zip(learner.network.parameters(), twin.parameters(), strict=True):
        torch.testing.assert_close(mine, its, rtol=1e-3, atol=1e-5)


def test_a_loss_that_is_no_number_ends_the_training_with_a_letter():
    shown = recorded([5])
    shown.observations["x"][3] = np.nan
    with pytest.raises(DivergedError, match=r"After 1 minibatches .*Lower bc.learning_rate"):
        standing(shown).update(None)


def test_without_a_file_it_is_refused_and_its_policy_is_rebuilt_from_spec_and_weights(tmp_path):
    def settings(path):
        return SimpleNamespace(network=NETWORK, bc=BcConfig(demonstrations=path), runtime=SimpleNamespace(device="cpu"))

    with pytest.raises(SettingError, match=r"--set bc\.demonstrations=FILE"):
        BcLearner.build(SPEC, settings(None), 1)
    write_demonstrations(tmp_path / "shown.safetensors", recorded([3, 3]))
    learner = BcLearner.build(SPEC, settings(str(tmp_path / "shown.safetensors")), 1)
    seen = {"x": np.random.default_rng(2).normal(size=(9, 2)).astype(np.float32)}
    assert learner.policy_spec.algorithm == "bc"
    again = BcLearner.load_policy(learner.policy_spec, learner.state_dict()["network"])
    assert np.array_equal(again.act(seen), learner.choose(seen))
    decided = learner.act(seen)
    assert np.array_equal(decided.actions, learner.choose(seen))
    assert decided.columns == {}
