"""What an agent of a Unity scene sees and does, and how both travel.

Begin at `Behavior`: its sensors and its actions, learnt from the player. `read_agents` turns a list of wire messages
into arrays with one row an agent; `write_actions` goes the other way.

Pictures are shown as (H, W, C): uint8 where the player compresses them (PNG), float32 in [0, 1] where it does not. On
the wire packages up to 2.x send [H, W, C] and later ones [C, H, W], under the same version of the protocol.

Masks are shown True where an action is *allowed*; the wire says True where it is forbidden.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.unity.env.errors import WireError
from racecraft.worlds.unity.files.messages import NO_COMPRESSION, PNG
from racecraft.worlds.unity.files.pictures import CHW, HWC, decode_picture, layout_by_shape

MAX_NUMBERS = 2**28
"""More numbers in one observation than this are taken for a lie about its shape."""


@dataclass(frozen=True)
class Sensor:
    """One observation of every agent of a behavior."""

    name: str
    """The sensor's name in Unity; `obs_0`, `obs_1` … by position where it has none of its own."""
    shape: tuple[int, ...]
    """As shown to us: (numbers,), (entities, numbers) for variable length, (H, W, C) for a picture."""
    wire_shape: tuple[int, ...]
    """As it stands on the wire."""
    compressed: bool = False
    """Whether it arrives as PNG and is shown as uint8."""
    layout: str = HWC
    """Axes of a picture on the wire."""
    variable_length: bool = False
    """Whether rows of zeros stand for absent entities."""
    goal: bool = False
    """Whether it tells the agent's goal."""

    @property
    def is_picture(self) -> bool:
        """Whether the observation has rank 3."""
        return len(self.shape) == 3

    @property
    def dtype(self) -> type[np.uint8] | type[np.float32]:
        """Type of its numbers as shown to us."""
        return np.uint8 if self.compressed else np.float32


@dataclass(frozen=True)
class UnityActions:
    """What an agent can do: `continuous` numbers in [-1, 1] and one choice in each discrete branch."""

    continuous: int = 0
    branches: tuple[int, ...] = ()


@dataclass(frozen=True)
class Behavior:
    """One kind of agent in a scene, such as `Basic?team=0`."""

    name: str
    sensors: tuple[Sensor, ...]
    actions: UnityActions

    @property
    def base_name(self) -> str:
        """The name without its team.

        >>> Behavior("Soccer?team=1", (), UnityActions()).base_name
        'Soccer'
        """
        return self.name.split("?")[0]


@dataclass
class AgentRows:
    """Some agents of one behavior at one moment; every array has a row an agent."""

    agent_id: Array
    """int32 (R,). Ids may be kept, or new each episode: scenes differ."""
    observations: list[Array]
    """One array (R, *sensor.shape) a sensor."""
    reward: Array
    """float32 (R,), since the agent's last decision."""
    group_id: Array
    """int32 (R,), 0 for an agent without a group."""
    group_reward: Array
    """float32 (R,)."""
    interrupted: Array
    """bool (R,), in the end of an episode: cut by the clock, so value still follows."""
    allowed: Array | None = None
    """bool (R, sum of branches), True where allowed; None where the behavior has no discrete actions."""

    def __len__(self) -> int:
        return len(self.agent_id)


def learn_behavior(parameters: Any, agent: Any, layout: str) -> Behavior:
    """Return what the player told of a behavior: its `BrainParametersProto` and the first `AgentInfoProto` of it."""
    spec = parameters.action_spec
    actions = UnityActions(spec.num_continuous_actions, tuple(spec.discrete_branch_sizes))
    if not spec.num_continuous_actions and not spec.num_discrete_actions:
        sizes = tuple(parameters.vector_action_size_deprecated)
        is_continuous = parameters.vector_action_space_type_deprecated == 1
        actions = UnityActions(sizes[0] if sizes else 0, ()) if is_continuous else UnityActions(0, sizes)
    name = parameters.brain_name
    if actions.continuous < 0 or any(size < 1 for size in actions.branches):
        raise WireError("behavior '{name}' has impossible actions {actions}.", name=name, actions=actions)
    taken: set[str] = set()
    sensors = []
    for index, observation in enumerate(agent.observations):
        sensor = _learn_sensor(observation, index, layout, name)
        if sensor.name in taken:
            sensor = _learn_sensor(observation, index, layout, name, use_name=False)
        taken.add(sensor.name)
        sensors.append(sensor)
    if not sensors:
        raise WireError(
            "behavior '{name}' has no observations; an agent that sees nothing cannot be taught.", name=name
        )
    return Behavior(name, tuple(sensors), actions)


def read_agents(behavior: Behavior, agents: Sequence[Any]) -> AgentRows:
    """Turn `AgentInfoProto`s of a behavior into rows.

    Raises:
        WireError: An observation has another shape than the first time, is cut, or holds NaN or infinity; a mask is of
            the wrong length or forbids everything.
    """
    count = len(agents)
    observations = [np.empty((count, *sensor.shape), sensor.dtype) for sensor in behavior.sensors]
    for row, agent in enumerate(agents):
        parts = agent.observations
        if len(parts) != len(behavior.sensors):
            raise WireError(
                "an agent of '{name}' has {count} observations; the first had {count_2}.",
                name=behavior.name,
                count=len(parts),
                count_2=len(behavior.sensors),
            )
        for sensor, part, into in zip(behavior.sensors, parts, observations, strict=True):
            _read_observation(behavior, sensor, part, into[row])
    rewards = np.array([(agent.reward, agent.group_reward) for agent in agents], np.float32).reshape(count, 2)
    for sensor, values in zip(behavior.sensors, observations, strict=True):
        if values.dtype == np.float32 and not np.isfinite(values).all():
            raise WireError(
                "observation '{name}' of '{name_2}' holds NaN or infinity.", name=sensor.name, name_2=behavior.name
            )
    if not np.isfinite(rewards).all():
        raise WireError("a reward of '{name}' is NaN or infinite.", name=behavior.name)
    return AgentRows(
        agent_id=np.array([agent.id for agent in agents], np.int32),
        observations=observations,
        reward=rewards[:, 0],
        group_id=np.array([agent.group_id for agent in agents], np.int32),
        group_reward=rewards[:, 1],
        interrupted=np.array([agent.max_step_reached for agent in agents], bool),
        allowed=_read_masks(behavior, agents),
    )


def write_actions(behavior: Behavior, into: Any, continuous: Array | None, discrete: Array | None) -> None:
    """Append one `AgentActionProto` a row to a repeated field, in the order in which the agents asked.

    Args:
        behavior: Whose actions.
        into: The repeated field.
        continuous: float (R, continuous) in [-1, 1]; None where the behavior has none.
        discrete: int (R, branches), each in [0, branch size); None where the behavior has none.
    """
    of = behavior.actions
    rows = len(continuous) if continuous is not None else len(discrete) if discrete is not None else 0
    floats = _checked(behavior, "continuous", continuous, (rows, of.continuous), np.float32)
    choices = _checked(behavior, "discrete", discrete, (rows, len(of.branches)), np.int32)
    if of.branches and ((choices < 0) | (choices >= np.array(of.branches))).any():
        raise ValueError(f"'{behavior.name}': discrete actions {choices.tolist()} outside branches {of.branches}")
    float_rows, choice_rows = floats.tolist(), choices.tolist()
    for row in range(rows):
        action = into.add()
        if of.continuous:
            action.continuous_actions.extend(float_rows[row])
        if of.branches:
            action.discrete_actions.extend(choice_rows[row])
        # players before wire version 1.3 read this field only
        action.vector_actions_deprecated.extend(float_rows[row] if of.continuous else choice_rows[row])


def first_allowed(behavior: Behavior, asking: AgentRows) -> Array:
    """Return the first allowed choice of every branch, int (R, branches): 0 unless 0 is forbidden."""
    if asking.allowed is None:
        return np.zeros((len(asking), 0), np.int64)
    parts = np.split(asking.allowed, np.cumsum(behavior.actions.branches[:-1]), axis=1)
    return np.stack([part.argmax(axis=1) for part in parts], axis=1)


def card_of(behavior: Behavior) -> dict[str, Any]:
    """Return a behavior as plain values, for a run's card; `behavior_from` reads it.

    >>> behavior = Behavior("A?team=0", (Sensor("eye", (3,), (3,)),), UnityActions(1, (2,)))
    >>> behavior_from(card_of(behavior)) == behavior
    True
    """
    return asdict(behavior)


def behavior_from(card: Mapping[str, Any]) -> Behavior:
    """Return the behavior that a card describes."""
    sensors = tuple(
        Sensor(**{**part, "shape": tuple(part["shape"]), "wire_shape": tuple(part["wire_shape"])})
        for part in card["sensors"]
    )
    actions = UnityActions(card["actions"]["continuous"], tuple(card["actions"]["branches"]))
    return Behavior(card["name"], sensors, actions)


def layout_of(package_version: str, shape: Sequence[int] = ()) -> str:
    """Return the axes of pictures that a package version sends.

    >>> layout_of("2.3.0-exp.3"), layout_of("3.0.0"), layout_of("4.0.0")
    ('HWC', 'CHW', 'CHW')
    """
    major = package_version.split(".")[0]
    if major.isdigit():
        return CHW if int(major) >= 3 else HWC
    return layout_by_shape(shape)


def _learn_sensor(part: Any, index: int, layout: str, behavior: str, use_name: bool = True) -> Sensor:
    wire_shape = tuple(part.shape)
    numbers = math.prod(wire_shape)
    if not 1 <= len(wire_shape) <= 3 or any(size < 0 for size in wire_shape) or numbers > MAX_NUMBERS:
        raise WireError(
            "observation {index} of '{behavior}' claims shape {wire_shape}; expected rank 1 to 3.",
            index=index,
            behavior=behavior,
            wire_shape=wire_shape,
        )
    if part.compression_type not in (NO_COMPRESSION, PNG):
        raise WireError(
            "observation {index} of '{behavior}' has compression {compression_type}; known: 0, 1.",
            index=index,
            behavior=behavior,
            compression_type=part.compression_type,
        )
    compressed = part.compression_type == PNG
    if compressed and len(wire_shape) != 3:
        raise WireError(
            "observation {index} of '{behavior}' is a PNG of shape {wire_shape}; expected rank 3.",
            index=index,
            behavior=behavior,
            wire_shape=wire_shape,
        )
    shape = wire_shape
    if len(wire_shape) == 3 and layout == CHW:
        shape = (wire_shape[1], wire_shape[2], wire_shape[0])
    name = part.name if use_name and part.name else f"obs_{index}"
    variable = any(flags & 4 for flags in part.dimension_properties)
    return Sensor(name, shape, wire_shape, compressed, layout, variable, part.observation_type == 1)


def _read_observation(behavior: Behavior, sensor: Sensor, part: Any, into: Array) -> None:
    """Write one agent's observation by one sensor into its row."""
    if tuple(part.shape) != sensor.wire_shape:
        raise WireError(
            "observation '{name}' of '{name_2}' has shape {shape}; the first had {wire_shape}.",
            name=sensor.name,
            name_2=behavior.name,
            shape=tuple(part.shape),
            wire_shape=sensor.wire_shape,
        )
    if part.compression_type not in ((NO_COMPRESSION, PNG) if sensor.is_picture else (NO_COMPRESSION,)):
        raise WireError(
            "observation '{name}' of '{name_2}', rank {count}, has compression "
            "{compression_type}; pictures may be plain (0) or PNG (1), all else is plain.",
            name=sensor.name,
            name_2=behavior.name,
            count=len(sensor.shape),
            compression_type=part.compression_type,
        )
    if part.compression_type == PNG:
        picture = _read_png(sensor, part)
        into[:] = picture if sensor.compressed else picture.astype(np.float32) / 255
        return
    values = np.array(part.float_data.data, np.float32)
    if values.size != into.size:
        raise WireError(
            "observation '{name}' of '{name_2}' brings {size} numbers; its shape {wire_shape} holds {size_2}.",
            name=sensor.name,
            name_2=behavior.name,
            size=values.size,
            wire_shape=sensor.wire_shape,
            size_2=into.size,
        )
    values = values.reshape(sensor.wire_shape)
    if sensor.is_picture and sensor.layout == CHW:
        values = values.transpose(1, 2, 0)
    into[:] = np.round(values.clip(0, 1) * 255) if sensor.compressed else values


def _read_png(sensor: Sensor, part: Any) -> Array:
    """Return a compressed picture, uint8 (H, W, C)."""
    try:
        return decode_picture(part.compressed_data, sensor.shape, list(part.compressed_channel_mapping))
    except ValueError as cause:
        raise WireError("observation '{name}' {cause}", name=sensor.name, cause=cause) from cause


def _read_masks(behavior: Behavior, agents: Sequence[Any]) -> Array | None:
    """Return what is allowed, bool (R, sum of branches); an agent without a mask may do everything."""
    branches = behavior.actions.branches
    if not branches:
        return None
    allowed = np.ones((len(agents), sum(branches)), bool)
    for row, agent in enumerate(agents):
        forbidden = agent.action_mask
        if len(forbidden):
            if len(forbidden) != sum(branches):
                raise WireError(
                    "an action mask of '{name}' has {count} entries; branches {branches} need {sum}.",
                    name=behavior.name,
                    count=len(forbidden),
                    branches=branches,
                    sum=sum(branches),
                )
            allowed[row] = ~np.array(forbidden, bool)
    starts = np.cumsum((0, *branches[:-1]))
    if not np.logical_or.reduceat(allowed, starts, axis=1).all():
        raise WireError("an action mask of '{name}' forbids every action of a branch.", name=behavior.name)
    return allowed


def _checked(behavior: Behavior, kind: str, actions: Array | None, shape: tuple[int, int], dtype: Any) -> Array:
    if actions is None:
        if shape[1]:
            raise ValueError(f"'{behavior.name}' needs {kind} actions of shape {shape}, found none")
        return np.zeros(shape, dtype)
    array = np.asarray(actions, dtype)
    if array.shape != shape:
        raise ValueError(f"'{behavior.name}' needs {kind} actions of shape {shape}, found {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"'{behavior.name}': {kind} actions must be finite numbers, found {array.tolist()}")
    return array
