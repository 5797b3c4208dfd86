"""What agents see and do, in ML-Agents' words: behaviors, decision steps, terminal steps, actions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum, IntFlag
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from racecraft.compat.names.mlagents_envs.exception import UnityActionException
from racecraft.worlds.unity.env.behaviors import CHW, AgentRows, Behavior, Sensor

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
    """One sensor. Pictures are as the player sends them: (C, H, W) from packages 3.x on, (H, W, C) before."""

    shape: tuple[int, ...]
    dimension_property: tuple[DimensionProperty, ...]
    observation_type: ObservationType
    name: str


class ActionTuple:
    """Actions of R agents: continuous float32 (R, numbers), discrete int32 (R, branches).

    What is not given has R rows of no columns.

    >>> told = ActionTuple()
    >>> told.add_discrete(np.array([[2], [0]]))
    >>> told.continuous.shape, told.discrete.tolist()
    ((2, 0), [[2], [0]])
    """

    def __init__(self, continuous: ArrayLike | None = None, discrete: ArrayLike | None = None) -> None:
        self.continuous: NDArray[Any] = np.zeros((0, 0), np.float32)
        self.discrete: NDArray[Any] = np.zeros((0, 0), np.int32)
        if continuous is not None:
            self.add_continuous(continuous)
        if discrete is not None:
            self.add_discrete(discrete)

    def add_continuous(self, continuous: ArrayLike) -> None:
        """Set the numbers."""
        self.continuous = np.asarray(continuous, np.float32)
        if not self.discrete.size:
            self.discrete = np.zeros((len(self.continuous), 0), np.int32)

    def add_discrete(self, discrete: ArrayLike) -> None:
        """Set the choices."""
        self.discrete = np.asarray(discrete, np.int32)
        if not self.continuous.size:
            self.continuous = np.zeros((len(self.discrete), 0), np.float32)


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


class BehaviorMapping(Mapping[BehaviorName, BehaviorSpec]):
    """Behaviors by name; read only."""

    def __init__(self, specs: Mapping[BehaviorName, BehaviorSpec]) -> None:
        self._specs = dict(specs)

    def __len__(self) -> int:
        return len(self._specs)

    def __getitem__(self, behavior: BehaviorName) -> BehaviorSpec:
        return self._specs[behavior]

    def __iter__(self) -> Iterator[BehaviorName]:
        return iter(self._specs)


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
    """Agents of a behavior at one moment, by id; a row is found in constant time."""

    def __init__(
        self,
        obs: Sequence[NDArray[Any]],
        reward: ArrayLike,
        agent_id: ArrayLike,
        group_id: ArrayLike,
        group_reward: ArrayLike,
    ) -> None:
        self.obs = list(obs)
        self.reward: Any = reward
        self.agent_id: Any = agent_id
        self.group_id: Any = group_id
        self.group_reward: Any = group_reward

    @cached_property
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
    """R agents that ask what to do.

    Args:
        obs: An array (R, *shape) a sensor.
        reward: float (R,), since each agent's last decision.
        agent_id: int (R,).
        action_mask: bool (R, size) a branch, True where a choice is forbidden; None without branches.
        group_id: int (R,), 0 for none.
        group_reward: float (R,).
    """

    def __init__(
        self,
        obs: Sequence[NDArray[Any]],
        reward: ArrayLike,
        agent_id: ArrayLike,
        action_mask: list[NDArray[Any]] | None,
        group_id: ArrayLike,
        group_reward: ArrayLike,
    ) -> None:
        super().__init__(obs, reward, agent_id, group_id, group_reward)
        self.action_mask = action_mask

    def __getitem__(self, agent_id: AgentId) -> DecisionStep:
        row = self._row(agent_id)
        mask = None if self.action_mask is None else [part[row] for part in self.action_mask]
        return DecisionStep(
            [values[row] for values in self.obs],
            float(self.reward[row]), agent_id, mask, int(self.group_id[row]), float(self.group_reward[row]),
        )  # fmt: skip

    @staticmethod
    def empty(spec: BehaviorSpec) -> DecisionSteps:
        """Return nobody, with the shapes of a behavior."""
        return DecisionSteps(_nothing(spec), _no_floats(), _no_ints(), None, _no_ints(), _no_floats())


class TerminalSteps(_Steps):
    """R agents whose episode ended; `interrupted`, bool (R,), where the clock cut it. The rest as `DecisionSteps`."""

    def __init__(
        self,
        obs: Sequence[NDArray[Any]],
        reward: ArrayLike,
        interrupted: ArrayLike,
        agent_id: ArrayLike,
        group_id: ArrayLike,
        group_reward: ArrayLike,
    ) -> None:
        super().__init__(obs, reward, agent_id, group_id, group_reward)
        self.interrupted: Any = interrupted

    def __getitem__(self, agent_id: AgentId) -> TerminalStep:
        row = self._row(agent_id)
        return TerminalStep(
            [values[row] for values in self.obs],
            float(self.reward[row]), bool(self.interrupted[row]), agent_id,
            int(self.group_id[row]), float(self.group_reward[row]),
        )  # fmt: skip

    @staticmethod
    def empty(spec: BehaviorSpec) -> TerminalSteps:
        """Return nobody, with the shapes of a behavior."""
        cut = np.zeros(0, bool)
        return TerminalSteps(_nothing(spec), _no_floats(), cut, _no_ints(), _no_ints(), _no_floats())


class BaseEnv(ABC):
    """What every environment of ML-Agents' low-level interface can do; `UnityEnvironment` is one."""

    @property
    @abstractmethod
    def behavior_specs(self) -> Mapping[str, BehaviorSpec]:
        """Every behavior met so far."""

    @abstractmethod
    def reset(self) -> None:
        """Begin all episodes anew."""

    @abstractmethod
    def step(self) -> None:
        """Send the actions that were set, and go on until somebody asks."""

    @abstractmethod
    def get_steps(self, behavior_name: BehaviorName) -> tuple[DecisionSteps, TerminalSteps]:
        """Return who asks, and whose episode ended."""

    @abstractmethod
    def set_actions(self, behavior_name: BehaviorName, action: ActionTuple) -> None:
        """Set the actions of all agents of a behavior that ask."""

    @abstractmethod
    def set_action_for_agent(self, behavior_name: BehaviorName, agent_id: AgentId, action: ActionTuple) -> None:
        """Set one agent's action."""

    @abstractmethod
    def close(self) -> None:
        """End it."""


def decisions_of(rows: AgentRows, behavior: Behavior, channels_last: bool = False) -> DecisionSteps:
    """Return our rows as the agents that ask, in ML-Agents' words."""
    mask = None
    if rows.allowed is not None:
        mask = np.split(~rows.allowed, np.cumsum(behavior.actions.branches[:-1]), axis=1)
    seen = _observations(rows, behavior, channels_last)
    return DecisionSteps(seen, rows.reward, rows.agent_id, mask, rows.group_id, rows.group_reward)


def ends_of(rows: AgentRows, behavior: Behavior, channels_last: bool = False) -> TerminalSteps:
    """Return our rows as the agents whose episode ended, in ML-Agents' words."""
    seen = _observations(rows, behavior, channels_last)
    return TerminalSteps(seen, rows.reward, rows.interrupted, rows.agent_id, rows.group_id, rows.group_reward)


def spec_of(behavior: Behavior, channels_last: bool = False) -> BehaviorSpec:
    """Return a behavior in ML-Agents' words.

    Args:
        behavior: As the player told it.
        channels_last: Whether pictures are (H, W, C) even where the player sends (C, H, W).
    """
    observations = []
    for sensor in behavior.sensors:
        first = DimensionProperty.VARIABLE_SIZE if sensor.variable_length else DimensionProperty.NONE
        properties = (first, *[DimensionProperty.NONE] * (len(sensor.shape) - 1))
        kind = ObservationType.GOAL_SIGNAL if sensor.goal else ObservationType.DEFAULT
        shape = sensor.wire_shape if _channels_first(sensor, channels_last) else sensor.shape
        observations.append(ObservationSpec(shape, properties, kind, sensor.name))
    return BehaviorSpec(observations, ActionSpec(behavior.actions.continuous, tuple(behavior.actions.branches)))


def _observations(rows: AgentRows, behavior: Behavior, channels_last: bool) -> list[NDArray[Any]]:
    """Return observations as float32, pictures in [0, 1] and with the axes wished for."""
    seen = []
    for sensor, values in zip(behavior.sensors, rows.observations, strict=True):
        floats = values.astype(np.float32) / np.float32(255) if values.dtype == np.uint8 else values
        seen.append(floats.transpose(0, 3, 1, 2) if _channels_first(sensor, channels_last) else floats)
    return seen


def _channels_first(sensor: Sensor, channels_last: bool) -> bool:
    return sensor.is_picture and sensor.layout == CHW and not channels_last


def _nothing(spec: BehaviorSpec) -> list[NDArray[Any]]:
    return [np.zeros((0, *part.shape), np.float32) for part in spec.observation_specs]


def _no_floats() -> NDArray[Any]:
    return np.zeros(0, np.float32)


def _no_ints() -> NDArray[Any]:
    return np.zeros(0, np.int32)


__all__ = [
    "ActionSpec", "ActionTuple", "AgentId", "BaseEnv", "BehaviorMapping", "BehaviorName", "BehaviorSpec",
    "DecisionStep", "DecisionSteps", "DimensionProperty", "GroupId", "ObservationSpec", "ObservationType",
    "TerminalStep", "TerminalSteps",
]  # fmt: skip
