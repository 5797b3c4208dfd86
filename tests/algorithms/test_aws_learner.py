"""The habits of the AWS learner, by hand: the floor, losses, e-greedy exploration, half the precision."""

import math

import numpy as np
import pytest
import torch

from racecraft.algorithms.distributions import Categorical
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import LOG_PROB, RAW_ACTION, PpoConfig, PpoLearner
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
