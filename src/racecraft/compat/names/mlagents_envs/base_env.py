"""What agents see and do, in ML-Agents' words: behaviors, decision steps, terminal steps, actions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum, IntFlag
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.compat.names.mlagents_envs.exception import UnityActionException
from racecraft.envs.unity.behaviors import AgentRows, Behavior

AgentId = int
BehaviorName = str
GroupId = int


class DimensionProperty(IntFlag):
    """What a dimension of an observation is good for."""

    UNSPECIFIED = 0
    NONE = 1
    TRANSLATIONAL_EQUIVARIANCE = 2
    VARIABLE_SIZE = 4


class ObservationType(Enum):
    """What an observation tells."""

    DEFAULT = 0
    GOAL_SIGNAL = 1


class ObservationSpec(NamedTuple):
    """One sensor; pictures are (H, W, C)."""

    shape: tuple[int, ...]
    dimension_property: tuple[DimensionProperty, ...]
    observation_type: ObservationType
    name: str


class ActionTuple:
    """Actions of R agents: continuous float (R, numbers), discrete int (R, branches)."""

    def __init__(self, continuous: ArrayLike | None = None, discrete: ArrayLike | None = None) -> None:
        rows = len(np.asarray(continuous if continuous is not None else discrete if discrete is not None else []))
        self.continuous: NDArray[Any] = np.zeros((rows, 0), np.float32)
        self.discrete: NDArray[Any] = np.zeros((rows, 0), np.int32)
        self.add_continuous(continuous) if continuous is not None else None
        self.add_discrete(discrete) if discrete is not None else None

    def add_continuous(self, continuous: ArrayLike) -> None:
        """Set the numbers."""
        self.continuous = np.asarray(continuous, np.float32)

    def add_discrete(self, discrete: ArrayLike) -> None:
        """Set the choices."""
        self.discrete = np.asarray(discrete, np.int32)


class ActionSpec(NamedTuple):
    """What agents of a behavior can do."""

    continuous_size: int
    discrete_branches: tuple[int, ...]

    @property
    def discrete_size(self) -> int:
        """How many branches."""
        return len(self.discrete_branches)

    def is_discrete(self) -> bool:
        """Tell whether there are choices only."""
        return self.discrete_size > 0 and self.continuous_size == 0

    def is_continuous(self) -> bool:
        """Tell whether there are numbers only."""
        return self.discrete_size == 0 and self.continuous_size > 0

    def empty_action(self, n_agents: int) -> ActionTuple:
        """Return zeros for so many agents."""
        return ActionTuple(
            np.zeros((n_agents, self.continuous_size), np.float32), np.zeros((n_agents, self.discrete_size), np.int32)
        )

    def random_action(self, n_agents: int) -> ActionTuple:
        """Draw actions; from numpy's global chance, as there."""
        draw = np.random.uniform(-1.0, 1.0, (n_agents, self.continuous_size)).astype(np.float32)
        columns = [np.random.randint(0, size, n_agents) for size in self.discrete_branches]
        choices = np.stack(columns, axis=1) if columns else np.zeros((n_agents, 0))
        return ActionTuple(draw, choices.astype(np.int32))

    @staticmethod
    def create_continuous(continuous_size: int) -> ActionSpec:
        """Return a spec of numbers."""
        return ActionSpec(continuous_size, ())

    @staticmethod
    def create_discrete(discrete_branches: tuple[int, ...]) -> ActionSpec:
        """Return a spec of choices."""
        return ActionSpec(0, tuple(discrete_branches))

    @staticmethod
    def create_hybrid(continuous_size: int, discrete_branches: tuple[int, ...]) -> ActionSpec:
        """Return a spec of both."""
        return ActionSpec(continuous_size, tuple(discrete_branches))

    def require(self, action: ActionTuple, n_agents: int, name: str) -> None:
        """Refuse actions of another shape."""
        found = (action.continuous.shape, action.discrete.shape)
        expected = ((n_agents, self.continuous_size), (n_agents, self.discrete_size))
        if found != expected:
            raise UnityActionException(f"'{name}': actions of shapes {found}; expected {expected}")


class BehaviorSpec(NamedTuple):
    """What agents of a behavior see and do."""

    observation_specs: list[ObservationSpec]
    action_spec: ActionSpec


class DecisionStep(NamedTuple):
    """One agent that asks what to do."""

    obs: list[NDArray[Any]]
    reward: float
    agent_id: AgentId
    action_mask: list[NDArray[Any]] | None
    group_id: int
    group_reward: float


class TerminalStep(NamedTuple):
    """One agent whose episode ended."""

    obs: list[NDArray[Any]]
    reward: float
    interrupted: bool
    agent_id: AgentId
    group_id: int
    group_reward: float


class _Steps(Mapping[AgentId, Any]):
    """Agents of a behavior at one moment, by id."""

    def __init__(self, rows: AgentRows) -> None:
        self.obs = [_floats(values) for values in rows.observations]
        self.reward, self.agent_id = rows.reward, rows.agent_id
        self.group_id, self.group_reward = rows.group_id, rows.group_reward

    @property
    def agent_id_to_index(self) -> dict[AgentId, int]:
        """The row of each agent."""
        return {int(agent): row for row, agent in enumerate(self.agent_id)}

    def __len__(self) -> int:
        return len(self.agent_id)

    def __iter__(self) -> Iterator[AgentId]:
        return iter(self.agent_id_to_index)

    def _row(self, agent_id: AgentId) -> int:
        if agent_id not in self.agent_id_to_index:
            raise KeyError(f"agent {agent_id} is not here; there are {list(self)}")
        return self.agent_id_to_index[agent_id]


class DecisionSteps(_Steps):
    """Agents that ask what to do; `action_mask` is True where a choice is forbidden, an array a branch."""

    def __init__(self, rows: AgentRows, behavior: Behavior) -> None:
        super().__init__(rows)
        self.action_mask: list[NDArray[Any]] | None = None
        if rows.allowed is not None:
            self.action_mask = np.split(~rows.allowed, np.cumsum(behavior.actions.branches[:-1]), axis=1)

    def __getitem__(self, agent_id: AgentId) -> DecisionStep:
        row = self._row(agent_id)
        mask = None if self.action_mask is None else [part[row] for part in self.action_mask]
        return DecisionStep(
            [values[row] for values in self.obs],
            float(self.reward[row]), agent_id, mask, int(self.group_id[row]), float(self.group_reward[row]),
        )  # fmt: skip


class TerminalSteps(_Steps):
    """Agents whose episode ended; `interrupted` where the clock cut it."""

    def __init__(self, rows: AgentRows) -> None:
        super().__init__(rows)
        self.interrupted = rows.interrupted

    def __getitem__(self, agent_id: AgentId) -> TerminalStep:
        row = self._row(agent_id)
        return TerminalStep(
            [values[row] for values in self.obs],
            float(self.reward[row]), bool(self.interrupted[row]), agent_id,
            int(self.group_id[row]), float(self.group_reward[row]),
        )  # fmt: skip


def spec_of(behavior: Behavior) -> BehaviorSpec:
    """Return a behavior in ML-Agents' words."""
    observations = []
    for sensor in behavior.sensors:
        first = DimensionProperty.VARIABLE_SIZE if sensor.variable_length else DimensionProperty.NONE
        properties = (first, *[DimensionProperty.NONE] * (len(sensor.shape) - 1))
        kind = ObservationType.GOAL_SIGNAL if sensor.goal else ObservationType.DEFAULT
        observations.append(ObservationSpec(sensor.shape, properties, kind, sensor.name))
    return BehaviorSpec(observations, ActionSpec(behavior.actions.continuous, tuple(behavior.actions.branches)))


def _floats(values: NDArray[Any]) -> NDArray[Any]:
    """Return observations as float32; pictures that travelled as PNG in [0, 1]."""
    return values.astype(np.float32) / np.float32(255) if values.dtype == np.uint8 else values


__all__ = [
    "ActionSpec", "ActionTuple", "AgentId", "BehaviorName", "BehaviorSpec", "DecisionStep", "DecisionSteps",
    "DimensionProperty", "GroupId", "ObservationSpec", "ObservationType", "TerminalStep", "TerminalSteps",
]  # fmt: skip
