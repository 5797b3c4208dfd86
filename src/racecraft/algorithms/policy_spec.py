"""What a stranger needs to rebuild a policy from its weights: it goes into every checkpoint. Begin with `PolicySpec`.

No world and no settings are needed to load a policy: the spec says what it sees, what it decides, how its network is
built and whose it is. `players/trained.py` has `load_policy`, which reads it from a run folder.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import (
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    GroupedActions,
    HybridActions,
    MultiDiscreteActions,
    SingleActions,
    WorldSpec,
)

VERSION = 1
MULTI_POLICY = "multi_policy"
"""The `algorithm` of a spec that holds several policies."""


class PolicySpecError(UserInputError):
    """A checkpoint's spec cannot be read: damaged, or of a newer version."""


@dataclass(frozen=True)
class PolicySpec:
    """A policy without its weights."""

    algorithm: str
    """Name in the registry of algorithms, or "module:Class"; it knows the network behind the weights."""
    observations: Mapping[str, ArraySpec]
    """What it was trained on, privileged ones for its critic included."""
    actions: SingleActions | GroupedActions
    network: Mapping[str, Any] = field(default_factory=dict)
    """The architecture, and what else the algorithm needs to build it; plain values."""
    has_action_mask: bool = False
    stack_size: int = 1
    """How many of the latest observations the policy sees at once; those named here are single ones."""
    policies: Mapping[str, PolicySpec] = field(default_factory=dict)
    """Of a world with several groups: one spec for each, in the order of their numbers; weights are "group/name"."""

    @property
    def visible(self) -> dict[str, ArraySpec]:
        """The observations that the policy itself reads."""
        return {name: part for name, part in self.observations.items() if not part.privileged}

    def as_dictionary(self) -> dict[str, Any]:
        """Return the spec as plain values, fit for JSON."""
        return {
            "version": VERSION,
            "algorithm": self.algorithm,
            "observations": {name: _array_values(part) for name, part in self.observations.items()},
            "actions": _action_values(self.actions),
            "network": dict(self.network),
            "has_action_mask": self.has_action_mask,
            "stack_size": self.stack_size,
            "policies": {name: spec.as_dictionary() for name, spec in self.policies.items()},
        }

    @classmethod
    def from_dictionary(cls, values: Mapping[str, Any]) -> PolicySpec:
        """Return the spec that `as_dictionary` told.

        Raises:
            PolicySpecError: Something is missing, or a newer racecraft wrote it.

        >>> spec = PolicySpec("ppo", {"x": ArraySpec((2,), np.float32)}, DiscreteActions(3, ("a", "b", "c")))
        >>> PolicySpec.from_dictionary(spec.as_dictionary()) == spec
        True
        """
        if values.get("version") != VERSION:
            raise PolicySpecError(
                "the checkpoint's policy spec has version {told!r}; expected {version}. A newer "
                "racecraft wrote it: upgrade.",
                told=values.get("version"),
                version=VERSION,
            )
        try:
            return cls(
                algorithm=values["algorithm"],
                observations={name: _array_spec(part) for name, part in values["observations"].items()},
                actions=_actions(values["actions"]),
                network=dict(values["network"]),
                has_action_mask=values["has_action_mask"],
                stack_size=values.get("stack_size", 1),
                policies={name: cls.from_dictionary(spec) for name, spec in values["policies"].items()},
            )
        except (KeyError, TypeError, AttributeError) as error:
            raise PolicySpecError(
                "the checkpoint's policy spec is damaged ({error!r}); expected what racecraft wrote.", error=error
            ) from error


def spec_of_policy(spec: WorldSpec, algorithm: str, network: Mapping[str, Any]) -> PolicySpec:
    """Return the spec of a policy for a world's promise.

    Args:
        spec: What is seen and decided.
        algorithm: Whose policy it is.
        network: What the algorithm needs to build it; tuples become lists.
    """
    return PolicySpec(algorithm, dict(spec.observations), spec.actions, _plain(network), spec.has_action_mask)


def _array_values(part: ArraySpec) -> dict[str, Any]:
    return {
        "shape": list(part.shape),
        "dtype": np.dtype(part.dtype).name,
        "low": _finite(part.low),
        "high": _finite(part.high),
        "privileged": part.privileged,
        "doc": part.doc,
    }


def _array_spec(values: Mapping[str, Any]) -> ArraySpec:
    low, high = _bound(values["low"], -math.inf), _bound(values["high"], math.inf)
    dtype = np.dtype(values["dtype"]).type
    return ArraySpec(tuple(values["shape"]), dtype, low, high, values["privileged"], values["doc"])


def _action_values(actions: SingleActions | GroupedActions) -> dict[str, Any]:
    if isinstance(actions, DiscreteActions):
        return {"type": "discrete", "count": actions.count, "labels": list(actions.labels)}
    if isinstance(actions, MultiDiscreteActions):
        return {"type": "multi_discrete", "counts": list(actions.counts)}
    if isinstance(actions, HybridActions):
        parts = {"continuous": _action_values(actions.continuous), "discrete": _action_values(actions.discrete)}
        return {"type": "hybrid", **parts}
    if isinstance(actions, GroupedActions):
        return {"type": "grouped", "width": actions.width}
    bounds = {name: [_finite(value) for value in getattr(actions, name)] for name in ("low", "high")}
    return {"type": "continuous", **bounds}


def _actions(values: Mapping[str, Any]) -> Any:
    kind = values["type"]
    if kind == "discrete":
        return DiscreteActions(values["count"], tuple(values["labels"]))
    if kind == "multi_discrete":
        return MultiDiscreteActions(tuple(values["counts"]))
    if kind == "hybrid":
        return HybridActions(_actions(values["continuous"]), _actions(values["discrete"]))
    if kind == "grouped":
        return GroupedActions(values["width"])
    low = tuple(_bound(value, -math.inf) for value in values["low"])
    return ContinuousActions(low, tuple(_bound(value, math.inf) for value in values["high"]))


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _bound(value: float | None, infinite: float) -> float:
    return infinite if value is None else float(value)


def _plain(value: Any) -> Any:
    """Return nested values with lists for tuples, as JSON gives them back."""
    if isinstance(value, Mapping):
        return {name: _plain(part) for name, part in value.items()}
    return [_plain(part) for part in value] if isinstance(value, list | tuple) else value


def architecture_values(architecture: Any) -> dict[str, Any]:
    """Return a row of figures as plain values; `networks.architecture_from` reads it."""
    values: dict[str, Any] = _plain(asdict(architecture))
    return values
