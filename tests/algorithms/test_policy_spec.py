"""A policy's spec as plain values: all of it goes round, and what cannot be read is refused in words."""

import json
import math

import numpy as np
import pytest

from racecraft.algorithms.architecture import Architecture
from racecraft.algorithms.policy_spec import PolicySpec, PolicySpecError, architecture_values, spec_of_policy
from racecraft.contract.world import (
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    GroupedActions,
    HybridActions,
    MultiDiscreteActions,
    WorldSpec,
)

SEEN = {
    "frame": ArraySpec((30, 40), np.uint8, 0, 255, doc="grey"),
    "state": ArraySpec((5,), np.float32, -1.5, math.inf),
    "truth": ArraySpec((), np.float64, privileged=True),
}
NUMBERS = ContinuousActions((-math.inf, -2.0), (math.inf, 3.0))
SPEC = PolicySpec("ppo", SEEN, DiscreteActions(2, ("left", "right")), {"trunk_units": [8]}, True, 3)


@pytest.mark.parametrize(
    "actions",
    [
        SPEC.actions,
        DiscreteActions(4),
        MultiDiscreteActions((3, 2)),
        NUMBERS,
        HybridActions(NUMBERS, MultiDiscreteActions((2,))),
        GroupedActions(6),
    ],
    ids=lambda kind: type(kind).__name__,
)
def test_a_spec_goes_through_json_and_comes_back_the_same(actions):
    spec = PolicySpec("ppo", SEEN, actions, {"trunk_units": [8]}, True, 3, {"A": SPEC})
    text = json.dumps(spec.as_dictionary(), allow_nan=False)  # JSON knows no infinity
    assert PolicySpec.from_dictionary(json.loads(text)) == spec


def test_a_spec_in_plain_words():
    told = SPEC.as_dictionary()
    assert told["version"] == 1
    assert told["actions"] == {"type": "discrete", "count": 2, "labels": ["left", "right"]}
    assert told["observations"]["state"] == {
        "shape": [5], "dtype": "float32", "low": -1.5, "high": None, "privileged": False, "doc": "",
    }  # fmt: skip
    assert (told["stack_size"], told["has_action_mask"], told["policies"]) == (3, True, {})


def test_a_spec_that_was_written_before_stacks_sees_one_observation_at_a_time():
    older = {name: part for name, part in SPEC.as_dictionary().items() if name != "stack_size"}
    assert PolicySpec.from_dictionary(older).stack_size == 1


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"version": 2}, "version 2; expected 1.*upgrade"),
        ({"actions": {"type": "discrete"}}, "damaged.*count"),
        ({"observations": ["frame"]}, "damaged"),
    ],
)
def test_what_cannot_be_read_is_refused_in_words(changed, said):
    with pytest.raises(PolicySpecError, match=said):
        PolicySpec.from_dictionary(SPEC.as_dictionary() | changed)


@pytest.mark.parametrize("masked", [True, False])
def test_a_worlds_promise_becomes_the_spec_of_its_policy(masked):
    world = WorldSpec("toy", 4, 1, SEEN, DiscreteActions(3), has_action_mask=masked)
    row = Architecture(convolutions=((4, 3, 2),), trunk_units=(8, 4))
    spec = spec_of_policy(world, "dqn", {"row": {"units": (1, (2, 3))}, **architecture_values(row)})
    assert (spec.algorithm, spec.actions, spec.has_action_mask, spec.stack_size) == ("dqn", world.actions, masked, 1)
    assert spec.observations == SEEN
    assert spec.network["row"] == {"units": [1, [2, 3]]}
    assert spec.network["convolutions"] == [[4, 3, 2]]
    assert spec.network["trunk_units"] == [8, 4]
    assert json.loads(json.dumps(dict(spec.network))) == spec.network
