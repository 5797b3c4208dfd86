"""Runs of Unity scenes from before each branch had a choice of its own: refused, where the others still load."""

import pytest

from racecraft.algorithms.policy_spec import MULTI_POLICY, PolicySpec
from racecraft.contract.errors import RunFolderError
from racecraft.contract.world import ContinuousActions, DiscreteActions, GroupedActions, MultiDiscreteActions
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import SPEC, spec_in
from racecraft.worlds.unity.env.behaviors import Behavior, Sensor, UnityActions
from racecraft.worlds.unity.env.cards import card_for
from racecraft.worlds.unity.env.world import spec_of

SIGHT = (Sensor("sight", (3,), (3,)),)


def behavior_of(name="A", **actions):
    return Behavior(f"{name}?team=0", SIGHT, UnityActions(**actions))


def metadata_of(*behaviors, spec=None):
    own = {behavior.base_name: {"network": {"hidden_units": [8]}} for behavior in behaviors}
    told = {"kind": "unity", "settings": {"network": {"hidden_units": [8]}}, **card_for(behaviors, own)}
    return told if spec is None else {**told, SPEC: spec.as_dictionary()}


def spec_with(actions, behavior):
    return PolicySpec("ppo", spec_of(behavior, "then").observations, actions)


@pytest.fixture
def run(tmp_path):
    return RunFolder.create(tmp_path / "run", {"kind": "unity"})


@pytest.mark.parametrize(
    ("actions", "expected"),
    [
        ({"branches": (4,)}, DiscreteActions(4)),
        ({"continuous": 2}, ContinuousActions((-1.0, -1.0), (1.0, 1.0))),
    ],
)
def test_what_means_the_same_today_still_loads(run, actions, expected):
    behavior = behavior_of(**actions)
    assert spec_in(run, metadata_of(behavior)).actions == expected
    assert spec_in(run, metadata_of(behavior, spec=spec_with(expected, behavior))).actions == expected


@pytest.mark.parametrize("actions", [{"branches": (2, 2)}, {"continuous": 1, "branches": (3,)}])
def test_a_run_from_before_specs_that_decided_otherwise_is_refused(run, actions):
    with pytest.raises(RunFolderError, match="one choice among all their combinations, or scores"):
        spec_in(run, metadata_of(behavior_of(**actions)))


def test_weights_that_would_fit_by_accident_are_refused(run):
    """2 x 2 combinations and 2 + 2 choices both take four numbers; they mean other things."""
    behavior = behavior_of(branches=(2, 2))
    with pytest.raises(RunFolderError, match=r"a choice for each of its branches \(2, 2\)"):
        spec_in(run, metadata_of(behavior, spec=spec_with(DiscreteActions(4), behavior)))
    today = spec_with(MultiDiscreteActions((2, 2)), behavior)
    assert spec_in(run, metadata_of(behavior, spec=today)) == today


def test_of_several_behaviors_the_one_that_decided_otherwise_is_named(run):
    one, other = behavior_of("One", branches=(3,)), behavior_of("Other", branches=(2, 2))
    together = PolicySpec(
        MULTI_POLICY, {}, GroupedActions(1),
        policies={"One": spec_with(DiscreteActions(3), one), "Other": spec_with(DiscreteActions(4), other)},
    )  # fmt: skip
    with pytest.raises(RunFolderError, match="the policy of 'Other'"):
        spec_in(run, metadata_of(one, other, spec=together))
