"""The habits of the AWS learner, by hand: the floor, Adam's epsilon, losses and batches, e-greedy exploration."""

import math

import numpy as np
import pytest
import torch
from torch.nn import functional

from racecraft.algorithms.distributions import Categorical
from racecraft.algorithms.half_precision import processor_precision
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import LOG_PROB, RAW_ACTION, VALUE, PpoConfig, PpoLearner
from racecraft.algorithms.ppo_batch import Minibatch
from racecraft.algorithms.ppo_loss import ppo_loss
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec

SPEC = WorldSpec("toy", 4, 1, {"state": ArraySpec((5,), np.float32)}, DiscreteActions(3))
NETWORK = NetworkConfig(hidden_units=(16,), separate_networks=True, privileged_critic=False, initialisation="glorot")
AWS = {
    "value_weight": 1.0, "value_loss": "huber", "max_grad_norm": None, "standardise": "rollout",
    "drop_remainder": True, "probability_floor": 1e-8, "adam_form": "tensorflow", "batch_size": 64,
}  # fmt: skip


def a_learner(seed=3, **settings):
    return PpoLearner(SPEC, NETWORK, PpoConfig(**{**AWS, **settings}), seed)


def experience_of(learner, ticks, rows=4, seed=0):
    rng = np.random.default_rng(seed)
    shape = (ticks, rows)
    seen = rng.normal(size=(*shape, 5)).astype(np.float32)
    decided = learner.act({"state": seen.reshape(-1, 5)}, generator=torch.Generator().manual_seed(seed))
    ended = np.zeros(shape, bool)
    ended[-1] = True
    return RolloutBatch(
        observations={"state": seen},
        actions=decided.actions.reshape(shape),
        reward=rng.normal(size=shape).astype(np.float32),
        terminated=ended,
        truncated=np.zeros(shape, bool),
        active=np.ones(shape, bool),
        last_observations={"state": rng.normal(size=(rows, 5)).astype(np.float32)},
        last_active=np.ones(rows, bool),
        columns={name: part.reshape(shape) for name, part in decided.columns.items()},
    )


def test_no_choice_counts_as_less_likely_than_the_floor_and_the_others_keep_theirs():
    kind = Categorical(DiscreteActions(3), 1e-8)
    logits = torch.tensor([[0.0, -math.log(4.0), -100.0]], requires_grad=True)
    log_prob, entropy = kind.log_prob_and_entropy(logits.expand(3, 3), None, None, torch.tensor([0, 1, 2]))
    assert log_prob.tolist() == pytest.approx([math.log(0.8), math.log(0.2), math.log(1e-8)])
    by_hand = -(0.8 * math.log(0.8) + 0.2 * math.log(0.2) + 1e-8 * math.log(1e-8))
    assert entropy[0].item() == pytest.approx(by_hand)
    log_prob[2].backward()
    assert (logits.grad == 0).all(), "what lies below the floor pulls at no weight"


def test_a_forbidden_choice_stays_forbidden_under_a_floor():
    kind = Categorical(DiscreteActions(3), 1e-3)
    mask = torch.tensor([[True, False, True]])
    log_prob, _ = kind.log_prob_and_entropy(torch.zeros(1, 3), None, mask, torch.tensor([1]))
    assert log_prob.exp().item() == 0.0
    drawn, _ = kind.sample_greedily(torch.zeros(500, 3), mask.expand(500, 3), 1.0, torch.Generator().manual_seed(1))
    assert set(drawn.tolist()) == {0, 2}


class Fixed(torch.nn.Module):
    log_std = None

    def __init__(self, logits, values):
        super().__init__()
        self.logits, self.values = torch.tensor(logits), torch.tensor(values)

    def forward(self, observations):
        return self.logits, self.values


@pytest.mark.parametrize(("loss", "by_hand"), [("mse", (0.25 + 9.0) / 2), ("huber", (0.125 + 2.5) / 2)])
def test_the_critics_error_counts_whole_and_the_entropy_by_its_weight(loss, by_hand):
    """Errors 0.5 and 3: squares 0.25 and 9 without a half; Huber with delta 1: 0.125 and 3 - 0.5."""
    network = Fixed([[0.0, 0.0]] * 2, [0.5, 3.0])
    batch = Minibatch({}, torch.tensor([0, 1]), torch.full((2,), math.log(0.5)), torch.zeros(2), torch.zeros(2))
    settings = PpoConfig(**{**AWS, "value_loss": loss, "entropy_weight": 0.01})
    total, _ = ppo_loss(network, Categorical(DiscreteActions(2), 1e-8), batch, settings)
    assert total.item() == pytest.approx(by_hand - 0.01 * math.log(2.0))


def test_advantages_are_standardised_over_the_iteration_before_it_is_cut_into_minibatches():
    learner = a_learner()
    kept = experience_of(learner, 30)
    whole, _, (_, mean) = learner._prepare(kept)
    assert whole.advantages.mean().item() == pytest.approx(0.0, abs=1e-6)
    assert whole.advantages.std(correction=0).item() == pytest.approx(1.0, abs=1e-5)
    # an episode that ended brings nothing of what follows: the last row's advantage is reward - value
    raw = kept.reward[-1] - learner._values_of(kept)[-1]
    found = whole.advantages.reshape(30, 4)[-1].numpy()
    spread = (raw - mean) / found
    assert spread == pytest.approx(np.full(4, spread[0]), rel=1e-3)


@pytest.mark.parametrize(
    ("ticks", "rows", "size", "count"), [(40, 4, 64, 2), (10, 4, 32, 1), (32, 4, 64, 2), (1, 1, 1, 1)]
)
def test_the_remainder_is_dropped_and_a_small_iteration_has_a_smaller_batch(ticks, rows, size, count):
    """160 transitions: 2 of 64, 32 left out. 40: lowered to 2^floor(log2 40) = 32, 8 left out. 128: 2 of 64."""
    learner = a_learner()
    batches = list(learner._minibatches(torch.arange(ticks * rows)))
    assert [len(batch) for batch in batches] == [size] * count


def test_adam_takes_tensorflows_steps():
    """By hand: lr * sqrt(1 - b2^t) / (1 - b1^t) * m / (sqrt(v) + epsilon), epsilon outside of the correction."""
    learner = a_learner(learning_rate=1e-2, adam_epsilon=1e-2, batch_size=32, epochs=1)
    weight = learner.network.value_head.weight
    expected = weight.detach().double().clone()
    m, v = torch.zeros_like(expected), torch.zeros_like(expected)
    whole, rows, _ = learner._prepare(experience_of(learner, 8))
    for t in range(1, 6):
        loss, _ = ppo_loss(learner.network, learner.distribution, whole.take(rows), learner.config)
        (slope,) = torch.autograd.grad(loss, weight)
        slope = slope.double()
        m, v = 0.9 * m + 0.1 * slope, 0.999 * v + 0.001 * slope**2
        rate = 1e-2 * math.sqrt(1 - 0.999**t) / (1 - 0.9**t)
        expected -= rate * m / (v.sqrt() + 1e-2)
        learner.steps.run([rows], whole.take, learner.now)
        assert torch.allclose(weight.detach().double(), expected, atol=1e-6)


def test_epsilon_greedy_begins_at_random_and_ends_at_the_likeliest():
    learner = a_learner(exploration="e-greedy", epsilon_last=0.1, epsilon_steps=1000)
    seen = {"state": np.zeros((1000, 5), np.float32)}
    best = learner.choose({"state": np.zeros((1, 5), np.float32)})[0]
    assert learner.epsilon == 1.0
    first = learner.act(seen).columns[RAW_ACTION]
    assert np.bincount(first, minlength=3) / 1000 == pytest.approx([1 / 3] * 3, abs=0.06)
    assert learner.epsilon == pytest.approx(0.1)
    later = learner.act(seen)
    assert (later.columns[RAW_ACTION] == best).mean() == pytest.approx(0.9 + 0.1 / 3, abs=0.03)
    params, chosen = learner.network.policy({"state": torch.zeros(1, 5)}), torch.tensor([int(best)])
    judged, _ = learner.distribution.log_prob_and_entropy(params, None, None, chosen)
    assert later.columns[LOG_PROB][later.columns[RAW_ACTION] == best][0] == pytest.approx(judged.item(), abs=1e-6)


def test_epsilon_goes_on_where_it_stood():
    learner, other = (a_learner(exploration="e-greedy", epsilon_steps=100) for _ in range(2))
    learner.act({"state": np.zeros((40, 5), np.float32)})
    other.load_state_dict(learner.state_dict())
    assert other.epsilon == learner.epsilon < 1.0
    assert "exploration" not in a_learner().state_dict()


def test_huber_is_tensorflows():
    errors = torch.tensor([0.3, -0.9, 1.0, 4.0])
    by_hand = [0.045, 0.405, 0.5, 3.5]
    assert functional.huber_loss(errors, torch.zeros(4), reduction="none").tolist() == pytest.approx(by_hand)


def test_a_critic_of_its_own_is_asked_once_before_the_update():
    learner = a_learner()
    kept = experience_of(learner, 100)
    assert learner.values_later
    assert VALUE not in kept.columns
    kept.active[:, 1] = False
    found = learner._values_of(kept)
    asked = learner.values({"state": kept.observations["state"].reshape(-1, 5)}).reshape(100, 4)
    assert found[:, [0, 2, 3]] == pytest.approx(asked[:, [0, 2, 3]], abs=1e-6)
    assert (found[:, 1] == 0).all()
    assert not PpoLearner(SPEC, NetworkConfig(), PpoConfig(), 1).values_later


def test_half_the_precision_takes_nearly_the_same_step():
    full, coarse = a_learner(batch_size=32), a_learner(batch_size=32, precision="bfloat16")
    kept = experience_of(full, 8)
    losses = [learner.update(kept) for learner in (full, coarse)]
    assert losses[1]["value_loss"] == pytest.approx(losses[0]["value_loss"], rel=0.05)
    assert losses[1]["entropy"] == pytest.approx(losses[0]["entropy"], rel=0.01)
    assert all(numbers.dtype == torch.float32 for numbers in coarse.network.parameters())


def test_the_twin_of_half_the_precision_follows_the_weights_it_teaches():
    learner = a_learner(batch_size=32, precision="bfloat16")
    before = {name: value.clone() for name, value in learner.network.named_parameters()}
    learner.update(experience_of(learner, 8))
    assert any(not torch.equal(before[name], value) for name, value in learner.network.named_parameters())
    for (name, whole), half in zip(learner.network.named_parameters(), learner.working.parameters(), strict=True):
        assert half.dtype == (torch.float32 if "head" in name else torch.bfloat16)
        assert torch.equal(half.float(), whole if "head" in name else whole.to(torch.bfloat16).float()), name
    other = a_learner(batch_size=32, precision="bfloat16", seed=2)
    other.load_state_dict(learner.state_dict())
    assert torch.equal(next(other.working.parameters()), next(learner.working.parameters()))


def test_half_the_precision_is_asked_of_processors_that_have_it(monkeypatch):
    for told, expected in (({"avx512_bf16": True}, "bfloat16"), ({"avx2": True}, "float32")):
        monkeypatch.setattr(torch.cpu, "get_capabilities", lambda told=told: told, raising=False)
        assert processor_precision("auto") == expected
    monkeypatch.delattr(torch.cpu, "get_capabilities")
    assert processor_precision("auto") == "float32"
    assert processor_precision("bfloat16") == "bfloat16"
