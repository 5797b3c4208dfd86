"""DQN by hand, by twin (Stable-Baselines3), by law and by learning."""

import gymnasium
import numpy as np
import pytest
import torch
from toy_world import CopyTheNumber

from racecraft.algorithms.dqn import DqnConfig, DqnLearner, Minibatch
from racecraft.algorithms.learner import DivergedError
from racecraft.algorithms.networks import Architecture, NetworkConfig
from racecraft.algorithms.q_network import load_q_policy
from racecraft.algorithms.replay_sampler import Transitions
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.replay import Replay
from racecraft.rollout.replay_settings import ReplayConfig
from racecraft.rollout.statistics import summarise

B, DISCOUNT, RATE = 32, 0.9, 1e-2
SPEC = WorldSpec("toy", 1, 1, {"state": ArraySpec((3,), np.float32)}, DiscreteActions(4))


def learner(architecture=None, spec=SPEC, **settings):
    config = DqnConfig(**({"batch_size": B, "discount": DISCOUNT, "learning_rate": RATE, "train_every": 1} | settings))
    return DqnLearner(spec, architecture or Architecture(trunk_units=(8,), activation="relu"), config, seed=1)


class Given:
    """A replay that always gives the same transitions."""

    new_transitions, prioritised = 1, True

    def __init__(self, transitions):
        self.transitions, self.errors = transitions, None

    def __len__(self):
        return len(self.transitions.index)

    def sample(self, batch_size, generator):
        assert batch_size == len(self)
        return self.transitions

    def set_priorities(self, index, errors):
        self.errors = errors


def transitions(count=B, mask=None, next_mask=None):
    rng = np.random.default_rng(0)
    ended = rng.random(count) < 0.2
    return Transitions(
        observations={"state": rng.normal(size=(count, 3)).astype(np.float32)},
        actions=rng.integers(0, 4, count),
        reward=rng.normal(size=count).astype(np.float32),
        discount=np.where(ended, 0.0, DISCOUNT).astype(np.float32),
        next_observations={"state": rng.normal(size=(count, 3)).astype(np.float32)},
        action_mask=mask,
        next_action_mask=next_mask,
        weights=np.ones(count, np.float32),
        index=np.arange(count),
    )


class Still(gymnasium.Env):
    """Stands there to lend its spaces."""

    observation_space = gymnasium.spaces.Box(-5, 5, (3,), np.float32)
    action_space = gymnasium.spaces.Discrete(4)

    def reset(self, *, seed=None, options=None):
        return np.zeros(3, np.float32), {}


@pytest.mark.parametrize("largest_norm", [0.1, 10.0])
def test_the_same_transitions_give_the_loss_gradients_and_step_of_stable_baselines3(largest_norm):
    stable_baselines3 = pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.type_aliases import ReplayBufferSamples

    twin = stable_baselines3.DQN(
        "MlpPolicy", Still(), learning_rate=RATE, batch_size=B, gamma=DISCOUNT, max_grad_norm=largest_norm,
        buffer_size=100, policy_kwargs={"net_arch": [8]}, device="cpu",
    )  # fmt: skip
    ours = learner(optimiser="adam", max_grad_norm=largest_norm)
    mine, its = (dict(net.named_parameters()) for net in (ours.network, twin.q_net))
    pairs = {
        "body.trunk.0.weight": "q_net.0.weight", "body.trunk.0.bias": "q_net.0.bias",
        "choices.0.weight": "q_net.2.weight", "choices.0.bias": "q_net.2.bias",
    }  # fmt: skip
    assert set(mine) == set(pairs)
    assert set(its) == set(pairs.values())
    torch.manual_seed(0)
    with torch.no_grad():
        for net, other in ((ours.network, twin.q_net), (ours.target, twin.q_net_target)):
            for name, its_name in pairs.items():
                drawn = torch.randn_like(dict(net.named_parameters())[name])
                dict(net.named_parameters())[name].copy_(drawn)
                dict(other.named_parameters())[its_name].copy_(drawn)
    drawn = transitions()
    twin.replay_buffer.sample = lambda *_, **__: ReplayBufferSamples(
        torch.from_numpy(drawn.observations["state"]), torch.from_numpy(drawn.actions)[:, None],
        torch.from_numpy(drawn.next_observations["state"]), torch.from_numpy(drawn.discount == 0.0).float()[:, None],
        torch.from_numpy(drawn.reward)[:, None],
    )  # fmt: skip
    twin._logger = stable_baselines3.common.logger.configure(None, [])
    twin._current_progress_remaining = 1.0
    for _ in range(3):
        twin.train(gradient_steps=1, batch_size=B)
        told = ours.update(Given(drawn))
        assert told["loss"] == pytest.approx(twin.logger.name_to_value["train/loss"], rel=1e-5)
        for name, its_name in pairs.items():
            torch.testing.assert_close(mine[name].grad, its[its_name].grad, rtol=1e-4, atol=1e-7, msg=name)
            torch.testing.assert_close(mine[name], its[its_name], rtol=1e-4, atol=1e-6, msg=name)


def test_double_values_by_the_target_what_the_network_chooses_among_what_is_allowed():
    next_mask = np.ones((B, 4), bool)
    next_mask[:, 2] = False
    drawn = transitions(next_mask=next_mask)
    errors = {}
    for double in (False, True):
        ours = learner(double=double)
        torch.manual_seed(2)
        for net in (ours.network, ours.target):
            for part in net.parameters():
                torch.nn.init.normal_(part.data)
        now, then = (
            ours.network({"state": torch.from_numpy(drawn.observations["state"])}).detach().numpy(),
            torch.from_numpy(drawn.next_observations["state"]),
        )
        chooses, values = (
            np.where(next_mask, net({"state": then}).detach().numpy(), -np.inf) for net in (ours.network, ours.target)
        )
        best = (chooses if double else values).argmax(axis=1)
        target = drawn.reward + drawn.discount * values[np.arange(B), best]
        replay = Given(drawn)
        ours.update(replay)
        errors[double] = now[np.arange(B), drawn.actions] - target
        np.testing.assert_allclose(replay.errors, errors[double], rtol=1e-4, atol=1e-5)
    assert abs(errors[True] - errors[False]).max() > 0.1


def test_the_target_follows_after_so_many_gradient_steps_and_not_before():
    ours = learner(target_every=3)
    first = ours.state_dict()["target"]["choices.0.weight"]
    for step in range(1, 7):
        ours.update(Given(transitions()))
        target, network = (ours.state_dict()[which]["choices.0.weight"] for which in ("target", "network"))
        assert torch.equal(target, network) == (step % 3 == 0)
        assert torch.equal(target, first) == (step < 3)


def test_gradient_steps_go_in_proportion_to_what_was_collected_and_nothing_is_forgotten():
    ours = learner(train_every=4, gradient_steps=2)
    replay, taken = Given(transitions()), []
    for new in (3, 3, 3, 8, 0):
        replay.new_transitions = new
        taken.append(ours.update(replay)["gradient_steps"])
    assert taken == [0, 2, 2, 4, 0]


def test_exploration_falls_in_a_straight_line_and_obeys_the_mask():
    ours = learner(epsilon_first=1.0, epsilon_last=0.2, epsilon_steps=1000)
    mask = np.array([[True, False, True, False]])
    seen = {"state": np.zeros((500, 3), np.float32)}
    assert set(ours.act(seen, mask.repeat(500, axis=0)).actions) == {0, 2}
    assert ours.epsilon == pytest.approx(0.6)
    ours.act(seen)
    ours.act(seen)
    assert ours.epsilon == pytest.approx(0.2)
    best = ours.choose({"state": seen["state"][:1]})[0]
    shares = np.bincount(np.concatenate([ours.act(seen).actions for _ in range(40)]), minlength=4) / 20_000
    assert shares[best] == pytest.approx(0.8 + 0.05, abs=0.01)


def test_its_policy_is_rebuilt_from_spec_and_weights_and_is_certain():
    ours = learner(dueling=True)
    policy = load_q_policy(ours.policy_spec, ours.state_dict()["network"])
    seen = {"state": np.random.default_rng(1).normal(size=(9, 3)).astype(np.float32)}
    np.testing.assert_array_equal(policy.act(seen), ours.choose(seen))
    mask = np.zeros((9, 4), bool)
    mask[:, 3] = True
    np.testing.assert_array_equal(policy.probabilities(seen, mask), np.eye(4)[[3] * 9])
    assert policy.values(seen).shape == (9, 4)


def test_a_loss_that_is_no_number_ends_the_training_with_a_letter():
    drawn = transitions()
    drawn.reward[3] = np.nan
    with pytest.raises(DivergedError, match=r"After 1 gradient steps.*Lower dqn.learning_rate"):
        learner().update(Given(drawn))


@pytest.mark.parametrize(
    "switches",
    [{}, {"dueling": True}, {"n_step": 3}, {"prioritised": True}, {"optimiser": "rmsprop"}],
    ids=lambda switches: next(iter(switches), "plain"),
)
def test_it_copies_the_number_it_sees(switches):
    world = CopyTheNumber(16)
    prioritised = {"prioritised": switches.pop("prioritised")} if "prioritised" in switches else {}
    config = DqnConfig(
        **{"learning_rate": 5e-3, "batch_size": 64, "train_every": 4, "target_every": 50, "epsilon_steps": 2000,
           "optimiser": "adam", "discount": 0.5} | switches
    )  # fmt: skip
    ours = DqnLearner(world.spec, NetworkConfig(hidden_units=(32,)), config, seed=1)
    replay = Replay(world.spec, ReplayConfig(capacity=5000, learning_starts=200, **prioritised), 0.5, config.n_step)
    collector = Collector(world, ours, horizon=16, seed=1)
    for _ in range(12):
        if (fed := replay.add(collector.collect())) is not None:
            ours.update(fed)
    reward = summarise(play_episodes(GreedyPolicy(ours), CopyTheNumber(4), episodes_each=4, seed=2)).mean_reward
    assert reward == 8.0  # every number of an episode; guessing brings 2


class Counting(Given):
    """Gives as many transitions as are asked for, and notes how many that were."""

    prioritised = False

    def __init__(self, new):
        super().__init__(transitions())
        self.new_transitions, self.asked = new, []

    def sample(self, batch_size, generator):
        self.asked.append(batch_size)
        return transitions(batch_size)


def test_nothing_is_drawn_ahead_of_a_target_that_follows_meanwhile_or_of_priorities():
    replay, ours = Counting(7), learner(batch_size=1, target_every=3)
    ours.update(replay)
    replay.new_transitions = 4
    ours.update(replay)
    assert replay.asked == [3, 3, 1, 2, 2]
    replay.asked.clear()
    replay.prioritised = True
    replay.set_priorities = lambda index, errors: None
    ours.update(replay)
    assert replay.asked == [1, 1, 1, 1]


@pytest.mark.parametrize("masked", [False, True])
def test_transitions_are_split_in_their_order(masked):
    tensors = [torch.arange(5) + 10 * part for part in range(5)]
    one = Minibatch(
        {"state": torch.arange(5)}, tensors[0], tensors[1], tensors[2], {"state": torch.arange(5) + 50},
        torch.arange(5) + 60 if masked else None, tensors[3], tensors[4],
    )  # fmt: skip
    parts = list(one.split(2))
    assert [part.actions.tolist() for part in parts] == [[0, 1], [2, 3], [4]]
    for name in ("reward", "discount", "weights", "next_worth", *(["next_mask"] if masked else [])):
        assert torch.equal(torch.cat([getattr(part, name) for part in parts]), getattr(one, name))
    assert [part.observations["state"].tolist() for part in parts] == [[0, 1], [2, 3], [4]]
    assert [part.next_observations["state"].tolist() for part in parts] == [[50, 51], [52, 53], [54]]
    assert masked or parts[0].next_mask is None


@pytest.mark.parametrize("limit", [None, 1e6])
def test_what_it_tells_is_what_a_pencil_says(limit):
    """The Huber loss of each transition times its weight; two steps so short that they change nothing."""
    drawn = transitions()
    drawn.weights[:] = np.linspace(0.1, 1.0, B)
    drawn.reward[:5] += 4.0  # beyond the square's end
    ours = learner(learning_rate=1e-8, max_grad_norm=limit, epsilon_steps=200)
    assert all(torch.equal(*two) for two in zip(ours.network.parameters(), ours.target.parameters(), strict=True))
    ours.act({"state": np.zeros((50, 3), np.float32)})
    seen, then = (torch.from_numpy(part["state"]) for part in (drawn.observations, drawn.next_observations))
    worth = ours.network({"state": seen})
    q = worth[torch.arange(B), torch.from_numpy(drawn.actions)]
    target = drawn.reward + drawn.discount * ours.network({"state": then}).detach().numpy().max(axis=1)
    away = (q - torch.from_numpy(target)).abs()
    loss = (torch.from_numpy(drawn.weights) * torch.where(away < 1, away**2 / 2, away - 0.5)).mean()
    loss.backward()
    norm = torch.cat([part.grad.flatten() for part in ours.network.parameters()]).norm().item()
    replay = Given(drawn)
    replay.new_transitions = 2
    told = ours.update(replay)
    expected = {
        "loss": loss.item(), "q": q.mean().item(), "td_error": away.mean().item(), "grad_norm": norm if limit else 0.0,
        "epsilon": 1.0 - 0.9 * 50 / 200, "transitions": 2, "remembered": B, "gradient_steps": 2,
    }  # fmt: skip
    assert list(told) == list(expected)
    assert told == pytest.approx(expected, rel=1e-4)


def test_a_target_may_follow_a_part_of_the_way():
    ours = learner(target_every=1, target_share=0.25)
    before = ours.state_dict()["target"]
    ours.update(Given(transitions()))
    now = ours.state_dict()
    for name, part in now["target"].items():
        torch.testing.assert_close(part, before[name] + 0.25 * (now["network"][name] - before[name]))


def test_it_goes_on_from_its_state_and_from_weights_alone():
    ours, other, bare = learner(train_every=3), learner(train_every=3), learner()
    ours.act({"state": np.zeros((7, 3), np.float32)})
    for _ in range(4):
        ours.update(Given(transitions()))
    other.load_state_dict(ours.state_dict())
    assert (other.explored, other.owed, other.steps_taken) == (ours.explored, ours.owed, ours.steps_taken) == (7, 1, 1)
    replay = Given(transitions())
    replay.new_transitions = 6
    assert ours.update(replay) == other.update(replay)
    for name, part in ours.state_dict()["target"].items():
        assert torch.equal(part, other.state_dict()["target"][name])
    seen = {"state": np.zeros((64, 3), np.float32)}
    assert np.array_equal(ours.act(seen).actions, other.act(seen).actions)
    bare.load_state_dict({"network": ours.state_dict()["network"]})
    assert (bare.explored, bare.owed, bare.steps_taken) == (0, 0, 0)
    assert all(torch.equal(*two) for two in zip(bare.target.parameters(), ours.network.parameters(), strict=True))


def test_who_brings_chance_along_explores_by_it():
    seen, drawn = {"state": np.zeros((99, 3), np.float32)}, []
    for given in (None, None, 5, 5):
        torch.manual_seed(len(drawn))  # nobody draws from this one
        chance = None if given is None else torch.Generator().manual_seed(given)
        drawn.append(learner().act(seen, generator=chance).actions.tolist())
    assert drawn[0] == drawn[1] != drawn[2] == drawn[3]
    assert set(drawn[0]) == {0, 1, 2, 3}, "without a mask each may come"
