"""ML-Agents' demonstrations, the `.demo` files that a Unity scene records while somebody plays.

Begin with `read_demonstration`; `Demonstration.transitions` is what imitation learns from. A file is a header
(DemonstrationMetaProto, padded to 33 bytes), the behavior (BrainParametersProto) and one record a moment
(AgentInfoActionPairProto), each behind its length as a varint (facts: unity-ml-agents, "Fields"). Bytes behind the
number of records that the header names belong to nobody and are left out, as ML-Agents leaves them.

Which action stands in a record has changed. Old recorders wrote the one chosen there, and had none for their last
record; newer ones write the one that led there, for every record. In ML-Agents' own 3DBall files the platform's turn
follows the action of the record before (`Expert3DBall.demo`, correlation 0.999) or of its own (`test.demo` and
`test4.demo` of its tests, 0.9999). ML-Agents' loader pairs both as if they were old. `action_lag` says which it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.formats.protobuf_messages import parsed, read_varint
from racecraft.formats.user_file import read_regular
from racecraft.worlds.unity.files import messages
from racecraft.worlds.unity.files.messages import PNG
from racecraft.worlds.unity.files.pictures import CHW, decode_picture, layout_by_shape

SUFFIX = ".demo"
_HEADER_BYTES = 33
_VERSIONS = (0, 1)
_MAX_NUMBERS = 2**28  # a larger observation is a lie about its shape
_MAX_RECORDED_NUMBERS = 2**31


class DemonstrationError(InputFileError):
    """A demonstration file cannot be used."""


class Transitions(NamedTuple):
    """N steps of whoever played: what was seen, what was then done, and what came of it."""

    observations: dict[str, Array]
    """(N, *shape) by sensor, as `Demonstration.observations`."""
    continuous: Array
    """float32 (N, numbers)."""
    discrete: Array
    """int64 (N, branches)."""
    reward: Array
    """float32 (N,), earned by the action."""
    terminated: Array
    """bool (N,), the episode ended with it."""
    truncated: Array
    """bool (N,), it was cut by the clock."""
    allowed: Array | None
    """bool (N, sum of branches), True where allowed; None where no record has a mask."""


@dataclass(frozen=True)
class Demonstration:
    """One file, record by record; T records."""

    name: str
    """As the header has it, cut to its room."""
    behavior: str
    """Of which behavior, `Basic?team=0` say."""
    num_continuous: int
    """Numbers in an action."""
    branches: tuple[int, ...]
    """Sizes of its discrete branches."""
    observations: dict[str, Array]
    """(T, *shape) by sensor, `obs_0` … where it has no name: float32, or uint8 (T, H, W, C) for PNG pictures."""
    continuous: Array
    """float32 (T, num_continuous), as recorded; see `action_lag`."""
    discrete: Array
    """int64 (T, branches), as recorded; see `action_lag`."""
    reward: Array
    """float32 (T,), earned since the record before."""
    done: Array
    """bool (T,), the episode ended here."""
    interrupted: Array
    """bool (T,), where it ended: cut by the clock."""
    allowed: Array | None
    """bool (T, sum of branches), True where allowed; None where no record has a mask."""
    episode_id: Array
    """int64 (T,), Unity's id; the same for all in old files."""
    num_episodes: int
    """As the header has it."""
    mean_reward: float
    """Of an episode, as the header has it."""
    action_lag: int
    """How many records behind its choice an action stands: 0 in old files, whose last record has none, else 1."""

    def __len__(self) -> int:
        return len(self.done)

    def transitions(self, action_lag: int | None = None) -> Transitions:
        """Return what imitation learns from.

        Args:
            action_lag: 0 or 1, where the file's own is not wanted; 0 is how ML-Agents' trainers read every file.

        The last record of an episode begins no step, unless the next record goes on with the same id: in such old files
        it shows the next episode's first observation.
        """
        lag = self.action_lag if action_lag is None else action_lag
        goes_on = self.episode_id[1:] == self.episode_id[:-1]
        rows = np.flatnonzero(goes_on)
        then = rows + 1
        return Transitions(
            {name: values[rows] for name, values in self.observations.items()},
            self.continuous[rows + lag],
            self.discrete[rows + lag],
            self.reward[then],
            self.done[then] & ~self.interrupted[then],
            self.done[then] & self.interrupted[then],
            None if self.allowed is None else self.allowed[rows],
        )


def read_demonstration(path: str | Path, image_layout: str | None = None) -> Demonstration:
    """Read one file.

    Args:
        path: A `.demo` file.
        image_layout: "HWC" or "CHW", the axes of pictures in the file; None: judged by their shapes.

    Raises:
        DemonstrationError: It cannot be read, is cut, or contradicts itself.
    """
    return _Reader(Path(path), image_layout).read()


def read_demonstrations(path: str | Path, image_layout: str | None = None) -> list[Demonstration]:
    """Read a file, or every `.demo` file of a folder, in the order of their names.

    Raises:
        DemonstrationError: There is none, one cannot be used, or they are of different behaviors' shapes.
    """
    where = Path(path)
    files = sorted(where.glob(f"*{SUFFIX}")) if where.is_dir() else [where]
    if not files:
        raise DemonstrationError(
            where,
            Message("holds no {suffix} file", suffix=SUFFIX),
            Message("a folder of {suffix} files, or one of them", suffix=SUFFIX),
        )
    read = [read_demonstration(file, image_layout) for file in files]
    for file, one in zip(files, read, strict=True):
        if _kind(one) != _kind(read[0]):
            raise DemonstrationError(
                file,
                Message("sees and does {kind}", kind=_kind(one)),
                Message("what {name} has, {kind}", name=files[0].name, kind=_kind(read[0])),
                "Keep demonstrations of one behavior together.",
            )
    return read


def _kind(one: Demonstration) -> tuple[object, ...]:
    shapes = {name: values.shape[1:] for name, values in one.observations.items()}
    return one.num_continuous, one.branches, shapes


@dataclass(frozen=True)
class _Sensor:
    """One observation, as the first record has it."""

    name: str
    wire_shape: tuple[int, ...]
    shape: tuple[int, ...]
    is_png: bool
    is_chw: bool


class _Reader:
    """Reads one file, remembering which record it is at."""

    def __init__(self, path: Path, image_layout: str | None) -> None:
        self._path, self._layout, self._place = path, image_layout, "the header"
        self._is_old = False

    def read(self) -> Demonstration:
        data = self._bytes()
        try:
            return self._read(data)
        except ValueError as cause:
            raise DemonstrationError(
                self._path, str(cause).rstrip("."), "a demonstration of ML-Agents, whole", "Record it again.",
                key=self._place,
            ) from cause  # fmt: skip

    def _bytes(self) -> bytes:
        try:
            return read_regular(self._path)
        except OSError as cause:
            raise DemonstrationError(
                self._path, Message("cannot be read ({cause})", cause=cause), Message("a {suffix} file", suffix=SUFFIX)
            ) from cause

    def _read(self, data: bytes) -> Demonstration:
        kinds = messages.load()
        header, _ = _message(kinds.DemonstrationMeta, data, 0)
        if header.api_version not in _VERSIONS:
            raise ValueError(f"is of version {header.api_version}, and 0 and 1 are known")
        self._place = "the behavior"
        behavior, at = _message(kinds.BrainParameters, data, _HEADER_BYTES)
        promised = header.number_steps
        records: list[Any] = []
        while at < len(data) and (promised <= 0 or len(records) < promised):
            self._place = f"record {len(records) + 1}"
            record, at = _message(kinds.AgentInfoActionPair, data, at)
            records.append(record)
        if len(records) < promised or not records:
            self._place = "the end"
            raise ValueError(f"holds {len(records)} records where the header promises {max(promised, 1)}")
        return self._sort(header, behavior, records)

    def _sort(self, header: Any, behavior: Any, records: Sequence[Any]) -> Demonstration:
        numbers, branches = _actions_of(behavior)
        infos = [record.agent_info for record in records]
        acts = [record.action_info for record in records]
        masks = self._masks(infos, branches)
        actions = [self._action(row, act, numbers, branches, row == len(acts) - 1) for row, act in enumerate(acts)]
        return Demonstration(
            name=header.demonstration_name,
            behavior=behavior.brain_name,
            num_continuous=numbers,
            branches=branches,
            observations=self._observations(infos),
            continuous=np.array([pair[0] for pair in actions], np.float32).reshape(len(records), numbers),
            discrete=np.array([pair[1] for pair in actions], np.int64).reshape(len(records), len(branches)),
            reward=np.array([self._reward(row, info) for row, info in enumerate(infos)], np.float32),
            done=np.array([info.done for info in infos], bool),
            interrupted=np.array([info.max_step_reached for info in infos], bool),
            allowed=masks,
            episode_id=np.array([info.id for info in infos], np.int64),
            num_episodes=header.number_episodes,
            mean_reward=header.mean_reward,
            action_lag=0 if self._is_old else 1,
        )

    def _observations(self, infos: Sequence[Any]) -> dict[str, Array]:
        self._place = "record 1"
        first = [self._sensor(index, part) for index, part in enumerate(infos[0].observations)]
        if not first:
            raise ValueError("shows no observation")
        if sum(math.prod(sensor.shape) for sensor in first) * len(infos) > _MAX_RECORDED_NUMBERS:
            raise ValueError(f"claims observations of more than {_MAX_RECORDED_NUMBERS:,} numbers")
        names = [sensor.name for sensor in first]
        if len(set(names)) < len(names):
            names = [f"obs_{index}" for index in range(len(first))]
        seen = {
            name: np.empty((len(infos), *sensor.shape), np.uint8 if sensor.is_png else np.float32)
            for name, sensor in zip(names, first, strict=True)
        }
        for row, info in enumerate(infos):
            self._place = f"record {row + 1}"
            parts = info.observations
            if len(parts) != len(first):
                raise ValueError(f"shows {len(parts)} observations where the first shows {len(first)}")
            for name, sensor, part in zip(names, first, parts, strict=True):
                seen[name][row] = _observation(sensor, part)
        return seen

    def _sensor(self, index: int, part: Any) -> _Sensor:
        wire, is_png = tuple(part.shape), part.compression_type == PNG
        if not 1 <= len(wire) <= 3 or any(size < 0 for size in wire) or math.prod(wire) > _MAX_NUMBERS:
            raise ValueError(f"shows an observation of the impossible shape {wire}")
        if is_png and len(wire) != 3:
            raise ValueError(f"shows a PNG of shape {wire}, and three axes are needed")
        chw = len(wire) == 3 and (self._layout or layout_by_shape(wire)) == CHW
        return _Sensor(part.name or f"obs_{index}", wire, (wire[1], wire[2], wire[0]) if chw else wire, is_png, chw)

    def _action(
        self, row: int, act: Any, numbers: int, branches: tuple[int, ...], is_last: bool
    ) -> tuple[Array, Array]:
        self._place = f"record {row + 1}"
        continuous, discrete = np.array(act.continuous_actions, np.float32), np.array(act.discrete_actions, np.int64)
        if is_last and not act.ByteSize():
            self._is_old = True  # the old recorder had nothing more to write
            return np.zeros(numbers, np.float32), np.zeros(len(branches), np.int64)
        if not len(continuous) and not len(discrete):  # files before hybrid actions have one list for either
            old = np.array(act.vector_actions_deprecated, np.float32)
            continuous, discrete = (old, discrete) if numbers else (continuous, old.astype(np.int64))
        if (len(continuous), len(discrete)) != (numbers, len(branches)):
            raise ValueError(
                f"does {len(continuous)} numbers and {len(discrete)} choices where the behavior has {numbers} and "
                f"{len(branches)}"
            )
        if not np.isfinite(continuous).all():
            raise ValueError("does a number that is NaN or infinite")
        if branches and ((discrete < 0) | (discrete >= np.array(branches))).any():
            raise ValueError(f"chooses {discrete.tolist()} in branches of {list(branches)}")
        return continuous, discrete

    def _reward(self, row: int, info: Any) -> float:
        self._place = f"record {row + 1}"
        reward: float = info.reward
        if not math.isfinite(reward):
            raise ValueError(f"earns {reward}")
        return reward

    def _masks(self, infos: Sequence[Any], branches: tuple[int, ...]) -> Array | None:
        masks = [list(info.action_mask) for info in infos]
        if not any(masks):
            return None
        for row, mask in enumerate(masks):
            self._place = f"record {row + 1}"
            if mask and len(mask) != sum(branches):
                raise ValueError(f"has a mask of {len(mask)} entries where branches {list(branches)} need one each")
        return ~np.array([mask or [False] * sum(branches) for mask in masks], bool)


def _message(kind: Any, data: bytes, at: int) -> tuple[Any, int]:
    """Read one message behind its length."""
    size, at = read_varint(data, at)
    if size > len(data) - at:
        raise ValueError(f"claims {size} bytes where {len(data) - at} are left; the file was cut")
    return parsed(kind, data[at : at + size]), at + size


def _actions_of(behavior: Any) -> tuple[int, tuple[int, ...]]:
    """Return numbers and branches, from the action spec or, in old files, from what came before it."""
    spec = behavior.action_spec
    if spec.num_continuous_actions or spec.num_discrete_actions:
        numbers, branches = spec.num_continuous_actions, tuple(spec.discrete_branch_sizes)
    else:
        sizes = tuple(behavior.vector_action_size_deprecated)
        is_continuous = behavior.vector_action_space_type_deprecated == 1
        numbers, branches = (sizes[0] if sizes else 0, ()) if is_continuous else (0, sizes)
    if numbers < 0 or numbers > _MAX_NUMBERS or any(size < 1 for size in branches) or not (numbers or branches):
        raise ValueError(f"has {numbers} numbers and branches {list(branches)}, and something must be done")
    return numbers, branches


def _observation(sensor: _Sensor, part: Any) -> Array:
    if tuple(part.shape) != sensor.wire_shape:
        raise ValueError(f"shows '{sensor.name}' as {tuple(part.shape)} where the first is {sensor.wire_shape}")
    if (part.compression_type == PNG) != sensor.is_png:
        raise ValueError(f"shows '{sensor.name}' once as PNG and once as numbers")
    if sensor.is_png:
        try:
            return decode_picture(part.compressed_data, sensor.shape, list(part.compressed_channel_mapping))
        except ValueError as cause:
            raise ValueError(f"shows '{sensor.name}', which {cause}") from cause
    values = np.array(part.float_data.data, np.float32)
    if values.size != math.prod(sensor.wire_shape) or not np.isfinite(values).all():
        raise ValueError(
            f"shows '{sensor.name}' as {values.size} numbers, some perhaps NaN or infinite, where shape "
            f"{sensor.wire_shape} wants {math.prod(sensor.wire_shape)} finite ones"
        )
    values = values.reshape(sensor.wire_shape)
    return values.transpose(1, 2, 0) if sensor.is_chw else values
