"""SAC by hand and by law: what each loss may move, what is refused, the exact continuation; and by learning."""

import math

import numpy as np
import pytest
import torch
from toy_world import Walk

from racecraft.algorithms.learner import DivergedError
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.registry import find_algorithm, require_fit
from racecraft.algorithms.replay_sampler import Transitions
from racecraft.algorithms.sac import SacConfig, SacLearner
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, WorldSpec
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.replay import Replay
from racecraft.rollout.replay_settings import ReplayConfig
from racecraft.rollout.statistics import summarise

STATE = ArraySpec((5,), np.float32)
FRAME = ArraySpec((30, 40), np.uint8, 0, 255)
SECRET = ArraySpec((6,), np.float32, privileged=True)
STEERING = ContinuousActions((-0.5, 1.0), (0.5, 4.0))
B = 12


def a_learner(observations=None, actions=STEERING, network=None, seed=3, **settings):
    spec = WorldSpec("toy", 4, 1, observations or {"state": STATE}, actions)
    return SacLearner(spec, network or NetworkConfig(hidden_units=(16,)), SacConfig(**settings), seed)


def made_up(learner, seed=0, **parts):
    rng = np.random.default_rng(seed)

    def numbers(part):
        size = (B, *part.shape)
        drawn = rng.integers(0, 256, size) if part.dtype == np.uint8 else rng.normal(size=size)
        return drawn.astype(part.dtype)

    def seen():
        return {name: numbers(part) for name, part in learner.spec.observations.items()}

    low, high = learner.spec.actions.low, learner.spec.actions.high
    whole = {
        "observations": seen(),
        "actions": rng.uniform(low, high, (B, len(low))).astype(np.float32),
        "reward": rng.normal(size=B).astype(np.float32),
        "discount": np.full(B, 0.9, np.float32),
        "next_observations": seen(),
        "action_mask": None,
        "next_action_mask": None,
        "weights": np.ones(B, np.float32),
        "index": np.arange(B),
    }
    return Transitions(**(whole | parts))


class Given:
    """Gives the same transitions, over and over."""

    def __init__(self, transitions, new):
        self.transitions, self.new_transitions, self.told = transitions, new, []

    def __len__(self):
        return B

    def sample(self, batch_size, generator):
        return self.transitions

    def set_priorities(self, index, errors):
        self.told.append((index, errors))


def noise(learner, seed=0):
    size = (2, B, len(learner.spec.actions.low))
    return torch.randn(size, generator=torch.Generator().manual_seed(seed))


# By hand


def test_actions_keep_within_their_bounds_and_reach_all_of_them():
    learner = a_learner()
    decided = learner.act({"state": np.random.default_rng(0).normal(size=(2000, 5)).astype(np.float32)}).actions
    assert decided.dtype == np.float32
    assert (decided >= STEERING.low).all()
    assert (decided <= STEERING.high).all()
    spread = decided.max(axis=0) - decided.min(axis=0)
    assert (spread > 0.95 * np.subtract(STEERING.high, STEERING.low)).all()


def test_where_the_story_ends_a_critic_learns_the_reward_alone():
    learner = a_learner(learning_rate=3e-2, temperature="0.5")
    ended = made_up(learner, discount=np.zeros(B, np.float32))
    for seed in range(300):
        learner.step(ended, noise(learner, seed))
    units = (torch.from_numpy(ended.actions) - learner.centre) / learner.scale
    with torch.no_grad():
        values = learner.network.critics(
            learner.network.eyes({"state": torch.from_numpy(ended.observations["state"])}), units
        )
    np.testing.assert_allclose(values.numpy(), np.stack([ended.reward] * 2), atol=0.1)


def test_weights_scale_what_a_transition_counts_and_errors_go_back_to_their_places():
    learner = a_learner()
    heavy = made_up(learner, weights=np.eye(B, dtype=np.float32)[3])
    losses, errors = learner.step(heavy, noise(learner))
    assert errors.shape == (B,)
    plain, again = made_up(learner), a_learner()
    _, same = again.step(plain, noise(again))
    torch.testing.assert_close(same, errors)
    # Half of a^2 + b^2 lies between the square of the mean of |a| and |b| and twice that.
    square = float(errors[3]) ** 2
    assert square * (1 - 1e-5) <= float(losses.critic) * B <= 2 * square * (1 + 1e-5)


def test_the_temperature_rises_while_the_policy_is_too_decided_and_falls_while_it_is_not():
    for target, direction in ((50.0, 1), (-50.0, -1)):
        learner = a_learner(target_entropy=target, learning_rate=1e-2)
        learner.step(made_up(learner), noise(learner))
        assert math.log(learner.temperature) == pytest.approx(direction * 1e-2, rel=1e-3)  # Adam's first step


def test_a_fixed_temperature_stays():
    learner = a_learner(temperature="0.2")
    for seed in range(3):
        learner.step(made_up(learner), noise(learner, seed))
    assert learner.temperature == 0.2


def test_slow_critics_are_copied_whole_after_every_interval():
    learner = a_learner(target_rate=1.0, target_interval=3)
    began = [one.clone() for one in learner.slow.parameters()]
    for k in range(1, 4):
        learner.step(made_up(learner, seed=k), noise(learner, k))
        wanted = learner.network.critics.parameters() if k == 3 else began
        for slow, one in zip(learner.slow.parameters(), wanted, strict=True):
            assert torch.equal(slow, one)


@pytest.mark.parametrize(("per_step", "taken"), [(1.0, [5, 5, 5]), (0.5, [2, 3, 2]), (2.0, [10, 10, 10])])
def test_gradient_steps_go_with_what_was_collected_and_fractions_are_carried_over(per_step, taken):
    learner = a_learner(gradient_steps_per_step=per_step)
    given = Given(made_up(learner), new=5)
    assert [learner.update(given)["gradient_steps"] for _ in taken] == taken
    assert len(given.told) == sum(taken)


def test_correlated_noise_remembers_each_row_and_each_number_is_still_standard_normal():
    learner = a_learner(noise_correlation=0.8)
    learner.reset_state(np.ones(4000, bool))
    fresh = torch.zeros(4000, 2)
    before = learner.noise.clone()
    torch.testing.assert_close(learner._carried(fresh, None), 0.8 * before)
    for _ in range(20):
        before = learner.noise.clone()
        learner._carried(torch.randn(4000, 2, generator=learner.generator), None)
    assert learner.noise.std().item() == pytest.approx(1.0, abs=0.03)
    assert (learner.noise * before).mean().item() == pytest.approx(0.8, abs=0.03)
    over = np.zeros(4000, bool)
    over[7] = True
    before = learner.noise.clone()
    learner.reset_state(over)
    changed = (learner.noise != before).any(dim=1).numpy()
    assert np.array_equal(changed, over)
    kept = learner.noise.clone()
    learner._carried(torch.zeros(1, 2), np.array([7]))
    torch.testing.assert_close(learner.noise[7], 0.8 * kept[7])
    assert torch.equal(learner.noise[:7], kept[:7])


def test_before_anything_was_carried_noise_is_standard_normal_too():
    """Nobody was told to forget: the first tick begins with what it draws, and the next one carries that over."""
    learner = a_learner(noise_correlation=0.8)
    drawn = torch.randn(50, 2, generator=torch.Generator().manual_seed(1))
    assert torch.equal(learner._carried(drawn.clone(), None), drawn)
    nothing = torch.zeros(50, 2)
    torch.testing.assert_close(learner._carried(nothing, None), 0.8 * drawn)
    torch.testing.assert_close(learner._carried(nothing[:3], np.array([4, 0, 9])), 0.64 * drawn[[4, 0, 9]])


@pytest.mark.parametrize("word", ["1000000.5", "-1e-9", "nan", "hot"])
def test_a_temperature_is_a_number_from_nothing_to_a_million(word):
    assert [SacConfig(temperature=edge).fixed_temperature for edge in ("0", "1e6")] == [0.0, 1e6]
    with pytest.raises(SettingError, match=r"sac\.temperature"):
        SacConfig(temperature=word)


def test_a_temperature_begins_where_it_is_told_to():
    def logarithm(learner):
        return learner.state_dict()["temperature"]["logarithm"].item()

    assert SacConfig().fixed_temperature is None
    found, fixed = a_learner(initial_temperature=2.0), a_learner(temperature="0.2", initial_temperature=2.0)
    assert (found.temperature, fixed.temperature) == pytest.approx((2.0, 0.2))
    assert (logarithm(found), logarithm(fixed)) == pytest.approx((math.log(2.0), math.log(0.2)))
    assert logarithm(a_learner(temperature="0")) == pytest.approx(math.log(1e-30))
    assert a_learner(temperature="0").temperature == 0.0


def test_without_a_word_the_entropy_held_is_one_less_than_nothing_for_each_number():
    assert a_learner().target_entropy == -2.0
    assert a_learner(target_entropy=0.5).target_entropy == 0.5


def test_figures_are_means_over_the_gradient_steps():
    learner, twin = a_learner(), a_learner()
    batch = made_up(learner)
    told = learner.update(Given(batch, new=2))
    chance, losses = twin.generator, []
    for _ in range(2):
        losses.append(twin.step(batch, torch.randn((2, B, 2), generator=chance))[0])
    for figure, part in (
        ("critic_loss", "critic"),
        ("actor_loss", "actor"),
        ("entropy", "entropy"),
        ("value", "value"),
    ):
        assert told[figure] == pytest.approx(sum(getattr(one, part).item() for one in losses) / 2, rel=1e-5), figure
    assert told["temperature"] == pytest.approx(twin.temperature)


# By law: who is moved by what


def grads(part):
    return [None if one.grad is None else float(one.grad.abs().sum()) for one in part.parameters()]


def test_shared_eyes_learn_from_the_critics_and_not_from_the_actor():
    learner = a_learner({"camera": FRAME, "state": STATE})
    network, batch = learner.network, made_up(a_learner({"camera": FRAME, "state": STATE}))
    seen = {name: torch.from_numpy(array) for name, array in batch.observations.items()}
    for_actor, for_critics = network.features(seen)
    mean, _ = network.decide(for_actor)
    mean.sum().backward()
    assert all(one is None for one in grads(network.eyes))
    assert all(grads(network.actor))
    network.critics(for_critics, mean.detach()).sum().backward()
    assert all(grads(network.eyes))
    before = [one.clone() for one in network.eyes.parameters()]
    learner.step(batch, noise(learner))
    assert all(not torch.equal(old, new) for old, new in zip(before, network.eyes.parameters(), strict=True))


def test_a_privileged_critic_reads_the_true_state_and_the_actor_teaches_its_own_eyes():
    learner = a_learner({"camera": FRAME, "secret": SECRET})
    network = learner.network
    assert network.critic_eyes.names == ("secret",)
    assert network.eyes.names == ("camera",)
    before = [one.clone() for one in network.eyes.parameters()]
    learner.step(made_up(learner), noise(learner))
    assert all(not torch.equal(old, new) for old, new in zip(before, network.eyes.parameters(), strict=True))
    frames = np.random.default_rng(0).integers(0, 256, (4, 30, 40)).astype(np.uint8)
    assert learner.choose({"camera": frames}).shape == (4, 2)  # nothing privileged is asked
    plain = a_learner({"camera": FRAME, "secret": SECRET}, network=NetworkConfig(privileged_critic=False))
    assert plain.network.critic_eyes is None


def test_the_actors_loss_moves_no_critic():
    learner = a_learner()
    network = learner.network
    features = network.eyes({"state": torch.ones(3, 5)})
    actions = torch.zeros(3, 2, requires_grad=True)
    network.critics(features, actions, frozen=True).sum().backward()
    assert all(one is None for one in grads(network.critics))
    assert actions.grad.abs().sum() > 0


@pytest.mark.parametrize("settings", [{}, {"temperature": "0.1"}, {"noise_correlation": 0.9}])
def test_a_continuation_is_exact(settings):
    one, other = a_learner(**settings), a_learner(seed=8, **settings)
    seen = {"state": np.random.default_rng(1).normal(size=(4, 5)).astype(np.float32)}
    for _ in range(2):
        one.update(Given(made_up(one), new=3))
        one.act(seen)
    state = {group: {name: part.clone() for name, part in parts.items()} for group, parts in one.state_dict().items()}
    other.load_state_dict(state)
    for learner in (one, other):
        learner.told = [learner.update(Given(made_up(learner, seed=5), new=3)), learner.act(seen).actions.tolist()]
    assert one.told == other.told
    for (name, mine), its in zip(
        one.state_dict()["network"].items(), other.state_dict()["network"].values(), strict=True
    ):
        assert torch.equal(mine, its), name


def test_weights_alone_begin_the_slow_critics_where_the_critics_are():
    one, other = a_learner(), a_learner(seed=8)
    other.load_state_dict({"network": one.state_dict()["network"]})
    for slow, fast in zip(other.slow.parameters(), one.network.critics.parameters(), strict=True):
        assert torch.equal(slow, fast)


def test_a_policy_is_rebuilt_from_its_spec_and_weights_alone():
    learner = a_learner({"camera": FRAME, "secret": SECRET})
    told = PolicySpec.from_dictionary(learner.policy_spec.as_dictionary())
    policy = find_algorithm(told.algorithm).learner_class().load_policy(told, learner.state_dict()["network"])
    seen = {"camera": np.random.default_rng(0).integers(0, 256, (6, 30, 40)).astype(np.uint8)}
    assert np.array_equal(policy.act(seen), learner.choose(seen))
    drawn = policy.sample(seen, None, torch.Generator().manual_seed(1))
    assert drawn.shape == (6, 2)
    assert not np.array_equal(drawn, policy.act(seen))


# Bad input


def test_a_loss_that_is_no_number_is_named():
    learner = a_learner()
    broken = made_up(learner, reward=np.full(B, np.nan, np.float32))
    with pytest.raises(DivergedError, match=r"sac\.learning_rate"):
        learner.update(Given(broken, new=2))


def test_actions_that_do_not_fit_are_refused_with_the_reason():
    with pytest.raises(SettingError, match="expected finite ones"):
        a_learner(actions=ContinuousActions((-math.inf,), (1.0,)))
    with pytest.raises(SettingError, match=r"decides numbers; an action of CartPole-v1 is one choice.*ppo"):
        require_fit(find_algorithm("sac"), DiscreteActions(2), "CartPole-v1")


# By learning


class Up:
    """Walks up, always."""

    def act(self, observations, action_mask=None):
        return np.ones((len(observations["clock"]), 1), np.float32)

    def reset_state(self, rows):
        pass


def mean_reward(policy):
    return summarise(play_episodes(policy, Walk(4, continuous=True), episodes_each=4, seed=2)).mean_reward


@pytest.mark.parametrize("settings", [{}, {"target_rate": 1.0, "target_interval": 50, "n_step": 3}])
def test_it_walks_up(settings):
    world = Walk(8, continuous=True)
    config = SacConfig(**({"learning_rate": 1e-2, "batch_size": 64, "discount": 0.9} | settings))
    learner = SacLearner(world.spec, NetworkConfig(hidden_units=(16,)), config, seed=1)
    collector = Collector(world, learner, horizon=4, seed=1)
    replay = Replay(world.spec, ReplayConfig(learning_starts=64), learner.discount, learner.n_step)
    for _ in range(16):
        experience = replay.add(collector.collect())
        if experience is not None:
            learner.update(experience)
    assert mean_reward(GreedyPolicy(learner)) >= 0.97 * mean_reward(Up())
