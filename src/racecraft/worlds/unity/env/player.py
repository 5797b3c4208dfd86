"""The player's side of the wire: runs a `Scene` as a Unity player would, for stand-ins and tests.

A scene that is written in Python and run by `run_player` is an ordinary player: our own session, ML-Agents' official
client and anything else that speaks the protocol can drive it. Begin at `Scene`, then `Player.live`, which is a
player's whole life; `basic_scene.py` is an example.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.unity.env.behaviors import CHW, layout_of
from racecraft.worlds.unity.env.side_channels import split
from racecraft.worlds.unity.env.wire import call_as_player
from racecraft.worlds.unity.files import messages


@dataclass
class ObservationMessage:
    """One observation to send: float32 numbers, or a picture uint8 (H, W, C) that travels as PNG."""

    values: Array
    name: str = ""
    variable_length: bool = False
    goal: bool = False


@dataclass
class Info:
    """What one agent has to say at one moment."""

    agent_id: int
    observations: Sequence[ObservationMessage]
    reward: float = 0.0
    done: bool = False
    interrupted: bool = False
    forbidden: Sequence[bool] = ()
    group_id: int = 0
    group_reward: float = 0.0


@dataclass
class ActionMessage:
    """What one agent is told to do."""

    continuous: list[float]
    discrete: list[int]


@dataclass(frozen=True)
class UnityActionSpec:
    """What the agents of a behavior can do."""

    continuous: int = 0
    branches: tuple[int, ...] = ()


class Scene(Protocol):
    """A small world that a player shows."""

    @property
    def behaviors(self) -> Mapping[str, UnityActionSpec]:
        """What agents of each behavior can do."""

    def begin(self, seed: int) -> None:
        """Learn the seed; called once."""

    def reset(self) -> None:
        """Begin all episodes anew."""

    def infos(self) -> Mapping[str, list[Info]]:
        """Tell, by behavior, of the agents that ended (done) and of those that ask what to do."""

    def act(self, actions: Mapping[str, list[ActionMessage]]) -> None:
        """Obey; a behavior without actions stands still. In the order of the infos that were not done."""


@dataclass
class Player:
    """A player's life. Tests override `say` to lie.

    Args:
        scene: What it shows.
        port: Where the server listens.
        package_version: The release of ML-Agents' package it claims to be; decides the axes of pictures.
        communication_version: The version of the protocol it claims to speak.
    """

    scene: Scene
    port: int
    package_version: str = "3.0.0"
    communication_version: str = "1.5.0"
    side_channels_heard: list[tuple[Any, bytes]] = field(default_factory=list)
    side_channels_to_say: bytes = b""
    _announced: set[str] = field(default_factory=set)

    def live(self) -> int:
        """Connect, introduce ourselves, show the scene until told goodbye; return an exit code."""
        exchange, disconnect = call_as_player(self.port)
        try:
            start = self._parse(self.exchange_message(exchange, self._introduction()))
            if start.header.status != messages.STATUS_OK:
                return 0
            self.scene.begin(start.unity_input.rl_initialization_input.seed)
            answer = self._parse(self.exchange_message(exchange, self._empty()))
            while answer.header.status == messages.STATUS_OK:
                self._apply_actions(answer.unity_input.rl_input)
                answer = self._parse(self.exchange_message(exchange, self._news()))
            return 0
        finally:
            disconnect()

    def exchange_message(self, exchange: Callable[[bytes], bytes], message: Any) -> bytes:
        """Send one message and return the answer's bytes."""
        return exchange(message.SerializeToString())

    def _apply_actions(self, order: Any) -> None:
        self.side_channels_heard += split(order.side_channel)
        if order.command == messages.RESET:
            self.scene.reset()
            return
        self.scene.act(
            {
                name: [ActionMessage(list(one.continuous_actions), list(one.discrete_actions)) for one in listed.value]
                for name, listed in order.agent_actions.items()
            }
        )

    def _introduction(self) -> Any:
        message = self._empty()
        introduction = message.unity_output.rl_initialization_output
        introduction.name = "AcademySingleton"
        introduction.package_version = self.package_version
        introduction.communication_version = self.communication_version
        for field_ in introduction.capabilities.DESCRIPTOR.fields:
            setattr(introduction.capabilities, field_.name, True)
        return message

    def _news(self) -> Any:
        message = self._empty()
        output = message.unity_output
        output.rl_output.side_channel, self.side_channels_to_say = self.side_channels_to_say, b""
        for name, infos in self.scene.infos().items():
            if not infos:
                continue
            if name not in self._announced:
                self._announced.add(name)
                self._announce(output.rl_initialization_output, name)
            listed = output.rl_output.agentInfos[name].value
            for info in infos:
                self._write_info(listed.add(), info)
        return message

    def _announce(self, introduction: Any, name: str) -> None:
        card = self.scene.behaviors[name]
        behavior = introduction.brain_parameters.add(brain_name=name, is_training=True)
        behavior.action_spec.num_continuous_actions = card.continuous
        behavior.action_spec.num_discrete_actions = len(card.branches)
        behavior.action_spec.discrete_branch_sizes.extend(card.branches)

    def _write_info(self, into: Any, info: Info) -> None:
        into.id, into.reward, into.done, into.max_step_reached = (
            info.agent_id, info.reward, info.done, info.interrupted,
        )  # fmt: skip
        into.group_id, into.group_reward = info.group_id, info.group_reward
        into.action_mask.extend(info.forbidden)
        for seen in info.observations:
            self._write_seen(into.observations.add(), seen)

    def _write_seen(self, into: Any, seen: ObservationMessage) -> None:
        values = np.asarray(seen.values)
        into.name = seen.name
        into.observation_type = int(seen.goal)
        picture = values.ndim == 3
        chw = picture and layout_of(self.package_version) == CHW
        into.shape.extend((values.shape[2], *values.shape[:2]) if chw else values.shape)
        into.dimension_properties.extend([4 if seen.variable_length else 1, *[1] * (values.ndim - 1)])
        if values.dtype == np.uint8:
            into.compression_type = messages.PNG
            into.compressed_data = pngs(values)
            into.compressed_channel_mapping.extend(mapping_of(values.shape[2]))
        else:
            into.float_data.data.extend((values.transpose(2, 0, 1) if chw else values).ravel().tolist())

    @staticmethod
    def _empty() -> Any:
        message = messages.load().UnityMessage()
        message.header.status = messages.STATUS_OK
        return message

    @staticmethod
    def _parse(data: bytes) -> Any:
        return messages.load().UnityMessage.FromString(data)


def run_player(scene: Scene, port: int, **claims: Any) -> int:
    """Live a player's life and return its exit code; a broken connection ends it quietly, as it does Unity's."""
    try:
        return Player(scene, port, **claims).live()
    except ConnectionError:
        return 1


def mapping_of(channels: int) -> Iterable[int]:
    """Return the channel mapping of a picture: grey is sent as three equal channels, others are filled up to threes."""
    if channels == 1:
        return [0, 0, 0]
    return [*range(channels), *[-1] * (-channels % 3)]


def pngs(picture: Array) -> bytes:
    """Return a picture, uint8 (H, W, C), as PNG files of three channels each, one after the other."""
    from PIL import Image

    channels = picture.shape[2]
    spare = -channels % 3
    picture = np.repeat(picture, 3, axis=2) if channels == 1 else np.pad(picture, ((0, 0), (0, 0), (0, spare)))
    files = io.BytesIO()
    for first in range(0, picture.shape[2], 3):
        Image.fromarray(np.ascontiguousarray(picture[:, :, first : first + 3])).save(files, format="PNG")
    return files.getvalue()
