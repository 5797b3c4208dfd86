"""Several learners as one: each is its own twin, whatever rows the others have."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.multi_policy import Committee, merged
from racecraft.algorithms.ppo import PpoLearner, PpoLosses
from racecraft.algorithms.rollout_batch import Experience
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, WorldSpec
from racecraft.settings.groups import NetworkConfig, PpoConfig

T, WHOSE, ALLOWED = 6, "whose", "allowed"
A = WorldSpec("a", 3, 1, {"x": ArraySpec((2,), np.float32)}, DiscreteActions(4), has_action_mask=True)
B = WorldSpec("b", 2, 1, {"y": ArraySpec((3,), np.float32)}, ContinuousActions((-1.0,) * 2, (1.0,) * 2))
JOINT = WorldSpec(
    "a+b",
    5,
    1,
    {
        WHOSE: ArraySpec((), np.int64),
        "A/x": ArraySpec((2,), np.float32),
        f"A/{ALLOWED}": ArraySpec((4,), bool),
        "B/y": ArraySpec((3,), np.float32),
    },
    ContinuousActions((-np.inf,) * 2, (np.inf,) * 2),
)
NETWORK = NetworkConfig(hidden_units=(8,))


def members():
    return {
        "A": PpoLearner(A, NETWORK, PpoConfig(batch_size=6, epochs=2), seed=1),
        "B": PpoLearner(B, NETWORK, PpoConfig(batch_size=4, epochs=3, learning_rate=1e-3), seed=2),
    }


def committee():
    return Committee(JOINT, members(), WHOSE, ALLOWED)


def seen(rng, shape=()):
    """Rows A B A A B, mixed on purpose."""
    allowed = rng.random((*shape, 5, 4)) < 0.6
    allowed[..., 1] = True
    return {
        WHOSE: np.broadcast_to(np.array([0, 1, 0, 0, 1]), (*shape, 5)).copy(),
        "A/x": rng.random((*shape, 5, 2), np.float32),
        f"A/{ALLOWED}": allowed,
        "B/y": rng.random((*shape, 5, 3), np.float32),
    }


IN_A, IN_B = np.array([0, 2, 3]), np.array([1, 4])


def test_every_row_is_decided_by_its_own_member():
    shown, alone = seen(np.random.default_rng(0)), members()
    together = committee().act(shown, generator=torch.Generator().manual_seed(7))
    chance = torch.Generator().manual_seed(7)
    mine = alone["A"].act({"x": shown["A/x"][IN_A]}, shown[f"A/{ALLOWED}"][IN_A], generator=chance)
    theirs = alone["B"].act({"y": shown["B/y"][IN_B]}, generator=chance)
    np.testing.assert_array_equal(together.actions[IN_A, 0], mine.actions)
    np.testing.assert_array_equal(together.samples[IN_B], theirs.samples)
    np.testing.assert_array_equal(together.log_prob[IN_A], mine.log_prob)
    np.testing.assert_array_equal(together.value[IN_B], theirs.value)
    assert np.take_along_axis(shown[f"A/{ALLOWED}"][IN_A], mine.actions[:, None], axis=1).all()


def test_any_rows_may_be_asked_about_even_of_one_member_alone():
    shown = seen(np.random.default_rng(1))
    asked = committee()
    some = {name: array[[4, 0]] for name, array in shown.items()}
    np.testing.assert_allclose(asked.values(some), asked.values(shown)[[4, 0]], rtol=1e-6)
    only = {name: array[IN_B] for name, array in shown.items()}
    np.testing.assert_allclose(asked.choose(only), asked.choose(shown)[IN_B], rtol=1e-6)


def experience(rng):
    shown = seen(rng, (T,))
    drawn = [committee().act({name: array[t] for name, array in shown.items()}) for t in range(T)]
    flags = np.zeros((T, 5), bool)
    return Experience(
        observations=shown,
        samples=np.stack([one.samples for one in drawn]),
        log_prob=np.stack([one.log_prob for one in drawn]),
        value=np.stack([one.value for one in drawn]),
        reward=rng.random((T, 5), np.float32),
        terminated=flags,
        truncated=flags.copy(),
        active=rng.random((T, 5)) < 0.8,
        final_value=np.zeros((T, 5), np.float32),
        last_value=rng.random(5, np.float32),
    )


def test_a_member_learns_as_it_would_alone():
    kept, together, alone = experience(np.random.default_rng(2)), committee(), members()
    told = together.update(kept)
    whole = ("log_prob", "value", "reward", "terminated", "truncated", "active", "final_value")
    for name, rows, part in (("A", IN_A, "x"), ("B", IN_B, "y")):
        samples = kept.samples[:, rows]
        mine = Experience(
            observations={part: kept.observations[f"{name}/{part}"][:, rows]},
            samples=samples[..., 0].astype(np.int64) if name == "A" else samples,
            last_value=kept.last_value[rows],
            action_mask=kept.observations[f"A/{ALLOWED}"][:, rows] if name == "A" else None,
            **{field: getattr(kept, field)[:, rows] for field in whole},
        )
        alone[name].update(mine)
        for key, weight in alone[name].state_dict()["network"].items():
            torch.testing.assert_close(together.state_dict()["network"][f"{name}/{key}"], weight, rtol=0, atol=0)
    assert told.transitions == kept.active.sum()


def test_a_state_goes_round():
    taught, fresh = committee(), committee()
    taught.update(experience(np.random.default_rng(3)))
    fresh.load_state_dict(taught.state_dict())
    again = experience(np.random.default_rng(4))
    assert fresh.update(again) == taught.update(again)


def test_counts_are_added_and_means_weighed():
    one = PpoLosses(1.0, 2.0, 0.5, 0.1, 0.2, 1.0, 0.5, 0.0, transitions=30, minibatches=3)
    two = PpoLosses(5.0, 2.0, 0.5, 0.1, 0.2, 1.0, 0.5, 0.0, transitions=10, minibatches=2)
    both = merged([one, two])
    assert (both.transitions, both.minibatches) == (40, 5)
    assert both.policy_loss == pytest.approx(2.0)  # (30 * 1 + 10 * 5) / 40
