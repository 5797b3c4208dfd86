"""Several learners as one: each is its own twin, whatever rows the others have."""

import dataclasses

import numpy as np
import pytest
import torch

from racecraft.algorithms.learner import Decision
from racecraft.algorithms.multi_policy import (
    MultiPolicy,
    MultiPolicyLearner,
    merged,
)
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.ppo import RAW_ACTION, VALUE, PpoConfig, PpoLearner
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.world import (
    POLICY_ID,
    AgentGroup,
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    GroupedActions,
    WorldSpec,
)
from racecraft.players.trained import policy_from

T = 6
A = WorldSpec("a", 3, 1, {"x": ArraySpec((2,), np.float32)}, DiscreteActions(4), has_action_mask=True)
B = WorldSpec("b", 2, 1, {"y": ArraySpec((3,), np.float32)}, ContinuousActions((-1.0,) * 2, (1.0,) * 2))
JOINT = WorldSpec(
    "a+b",
    5,
    1,
    {POLICY_ID: ArraySpec((), np.int64), "A/x": ArraySpec((2,), np.float32), "B/y": ArraySpec((3,), np.float32)},
    GroupedActions(2),
    has_action_mask=True,
    groups={
        "A": AgentGroup(A.observations, A.actions, has_action_mask=True),
        "B": AgentGroup(B.observations, B.actions),
    },
)
NETWORK = NetworkConfig(hidden_units=(8,))


def members():
    return {
        "A": PpoLearner(A, NETWORK, PpoConfig(batch_size=6, epochs=2), seed=1),
        "B": PpoLearner(B, NETWORK, PpoConfig(batch_size=4, epochs=3, learning_rate=1e-3), seed=2),
    }


def together():
    return MultiPolicyLearner(JOINT, members())


def seen(rng, shape=()):
    """Rows A B A A B, mixed on purpose, and what they are allowed."""
    allowed = rng.random((*shape, 5, 4)) < 0.6
    allowed[..., 1] = True
    return {
        POLICY_ID: np.broadcast_to(np.array([0, 1, 0, 0, 1]), (*shape, 5)).copy(),
        "A/x": rng.random((*shape, 5, 2), np.float32),
        "B/y": rng.random((*shape, 5, 3), np.float32),
    }, allowed


IN_A, IN_B = np.array([0, 2, 3]), np.array([1, 4])


def test_every_row_is_decided_by_its_own_member():
    (shown, allowed), alone = seen(np.random.default_rng(0)), members()
    decided = together().act(shown, allowed, generator=torch.Generator().manual_seed(7))
    chance = torch.Generator().manual_seed(7)
    mine = alone["A"].act({"x": shown["A/x"][IN_A]}, allowed[IN_A], generator=chance)
    theirs = alone["B"].act({"y": shown["B/y"][IN_B]}, generator=chance)
    np.testing.assert_array_equal(decided.actions[IN_A, 0], mine.actions)
    np.testing.assert_array_equal(decided.columns[f"B/{RAW_ACTION}"][IN_B], theirs.columns[RAW_ACTION])
    np.testing.assert_array_equal(decided.columns[f"A/{VALUE}"][IN_A], mine.columns[VALUE])
    assert np.take_along_axis(allowed[IN_A], mine.actions[:, None], axis=1).all()


def test_any_rows_may_be_asked_about_even_of_one_member_alone():
    shown, allowed = seen(np.random.default_rng(1))
    asked = together()
    only = {name: array[IN_B] for name, array in shown.items()}
    np.testing.assert_allclose(asked.choose(only, allowed[IN_B]), asked.choose(shown, allowed)[IN_B], rtol=1e-6)


def experience(rng):
    shown, allowed = seen(rng, (T,))
    drawn = [together().act({name: array[t] for name, array in shown.items()}, allowed[t]) for t in range(T)]
    truncated = np.zeros((T, 5), bool)
    truncated[2, [0, 1]] = truncated[4, 4] = True
    final, _ = seen(rng, (3,))
    return RolloutBatch(
        observations=shown,
        actions=np.stack([one.actions for one in drawn]),
        reward=rng.random((T, 5), np.float32),
        terminated=np.zeros((T, 5), bool),
        truncated=truncated,
        active=rng.random((T, 5)) < 0.8,
        last_observations={name: array[0] for name, array in shown.items()},
        last_active=np.ones(5, bool),
        columns={name: np.stack([one.columns[name] for one in drawn]) for name in drawn[0].columns},
        action_mask=allowed,
        last_action_mask=allowed[0],
        final_index=np.array([10, 11, 24]),
        final_observations={name: array[:, 0] for name, array in final.items()},
    )


def test_a_member_learns_as_it_would_alone():
    kept, learner, alone = experience(np.random.default_rng(2)), together(), members()
    told = learner.update(kept)
    for name, rows, part, cut, final in (("A", IN_A, "x", [6], [0]), ("B", IN_B, "y", [4, 9], [1, 2])):
        actions = kept.actions[:, rows]
        mine = RolloutBatch(
            observations={part: kept.observations[f"{name}/{part}"][:, rows]},
            actions=actions[..., 0].astype(np.int64) if name == "A" else actions,
            **{field: getattr(kept, field)[:, rows] for field in ("reward", "terminated", "truncated", "active")},
            last_observations={part: kept.last_observations[f"{name}/{part}"][rows]},
            last_active=kept.last_active[rows],
            columns={key[2:]: array[:, rows] for key, array in kept.columns.items() if key.startswith(f"{name}/")},
            action_mask=kept.action_mask[:, rows] if name == "A" else None,
            final_index=np.array(cut),
            final_observations={part: kept.final_observations[f"{name}/{part}"][final]},
        )
        alone[name].update(mine)
        for key, weight in alone[name].state_dict()["network"].items():
            torch.testing.assert_close(learner.state_dict()["network"][f"{name}/{key}"], weight, rtol=0, atol=0)
    assert told["transitions"] == kept.active.sum()


def test_a_story_of_one_tick_is_told_apart_as_well():
    whole = experience(np.random.default_rng(2))
    tick = {
        name: array[:1]
        for name in ("actions", "reward", "terminated", "truncated", "active", "action_mask")
        if (array := getattr(whole, name)) is not None
    }
    tick |= {
        name: {key: array[:1] for key, array in getattr(whole, name).items()} for name in ("observations", "columns")
    }
    none = {name: array[:0] for name, array in whole.final_observations.items()}
    kept = dataclasses.replace(whole, **tick, final_index=np.zeros(0, int), final_observations=none)
    assert together().update(kept)["transitions"] == kept.active.sum() > 0


def test_a_state_goes_round():
    taught, fresh = together(), together()
    taught.update(experience(np.random.default_rng(3)))
    fresh.load_state_dict(taught.state_dict())
    again = experience(np.random.default_rng(4))
    assert fresh.update(again) == taught.update(again)


def test_a_stranger_rebuilds_all_of_them_from_spec_and_weights():
    learner = together()
    learner.update(experience(np.random.default_rng(5)))
    spec = PolicySpec.from_dictionary(learner.policy_spec.as_dictionary())
    policy = policy_from(spec, learner.state_dict()["network"])
    shown, allowed = seen(np.random.default_rng(6))
    np.testing.assert_array_equal(policy.act(shown, allowed), learner.choose(shown, allowed))


def test_counts_are_added_and_means_weighed():
    one = {"policy_loss": 1.0, "transitions": 30, "minibatches": 3}
    two = {"policy_loss": 5.0, "transitions": 10, "minibatches": 2}
    both = merged([one, two])
    assert (both["transitions"], both["minibatches"]) == (40, 5)
    assert both["policy_loss"] == pytest.approx(2.0)  # (30 * 1 + 10 * 5) / 40


def test_who_stands_still_acts_and_learns_nothing():
    learner = MultiPolicyLearner(JOINT, members(), frozenset({"A"}))
    before = learner.state_dict()["network"]
    kept = experience(np.random.default_rng(2))
    assert learner.update(kept)["transitions"] == kept.active[:, IN_B].sum()
    moved = {name[0] for name, part in learner.state_dict()["network"].items() if not torch.equal(part, before[name])}
    assert moved == {"B"}


class Notes:
    """A member that notes what it is told, and decides by the first number of what it sees."""

    device, columns, figures = torch.device("cpu"), {}, {"loss": "of something"}

    def __init__(self, spec):
        self.spec, self.told = spec, []

    def reset_state(self, rows):
        self.told.append(rows.tolist())

    def act(self, observations, action_mask=None, *, generator=None, rows=None):
        (seen,) = observations.values()
        self.told.append(None if rows is None else rows.tolist())
        return Decision(seen[:, 0], {})


class Scheduled(Notes):
    def anneal(self, done):
        self.told.append(done)


def test_schedules_and_ends_reach_every_member():
    learner = MultiPolicyLearner(JOINT, {"A": Notes(A), "B": Scheduled(B)})
    learner.anneal(0.5)
    learner.reset_state(np.array([True, False]))
    assert [one.told for one in learner.members.values()] == [[[True, False]], [0.5, [True, False]]]
    assert learner.figures == {"loss": "of something"}


def test_members_are_told_which_rows_of_all_are_asked_about():
    learner, (shown, allowed) = (
        MultiPolicyLearner(JOINT, {"A": Notes(A), "B": Notes(B)}),
        seen(np.random.default_rng(0)),
    )
    learner.act(shown, allowed)
    learner.act(shown, allowed, rows=np.array([9, 8, 7, 6, 5]))
    assert learner.members["A"].told == [[0, 2, 3], [9, 7, 6]]
    assert learner.members["B"].told == [[1, 4], [8, 5]]


class Greedy:
    """A policy that notes what it forgets."""

    forgotten = None

    def act(self, observations, action_mask=None):
        return np.zeros(len(next(iter(observations.values()))))

    def reset_state(self, rows):
        self.forgotten = rows.tolist()


def test_a_policy_forgets_for_its_members_by_their_own_rows():
    policy = MultiPolicy(together().policy_spec, {"A": Greedy(), "B": Greedy()})
    shown, allowed = seen(np.random.default_rng(0))
    policy.act(shown, allowed)
    policy.reset_state(np.array([True, False, False, True, True]))
    assert [policy.members[name].forgotten for name in "AB"] == [[True, False, True], [False, True]]
    policy.reset_state(np.array([False, True, True]))  # the first rows of all
    assert [policy.members[name].forgotten for name in "AB"] == [[False, True], [True]]
