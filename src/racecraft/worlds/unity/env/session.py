"""One conversation with one player.

    session = Session("builtin:Basic")
    moments = session.reset()                          # what every agent sees, by behavior
    moments = session.step({"Basic?team=0": Choice(discrete=[[2]])})
    session.close()

Begin at `Session`. The conversation, each line the player's call and our answer (facts: unity-ml-agents, "Exchange
sequence"):

1. the player introduces itself; we answer with the seed and our capabilities;
2. an empty call, which is answered by the first `reset`;
3. and on: what the agents see, answered by their actions or a RESET.

`Moment.decisions` are the agents that ask what to do: actions go back **by position**, in the same order, never by id.
`Moment.ended` are agents whose episode ended, with its last observation and reward; the next episode's first decision
usually stands in the same message, but a message may hold ends alone, and is then answered with no action.

Nothing is left behind: `close`, the garbage collector and the interpreter's end all release the pending call, end the
process with its group, and stop the server.
"""

from __future__ import annotations

import logging
import os
import time
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from racecraft.formats.protobuf_messages import MessageError, parsed
from racecraft.worlds.unity.env.behaviors import (
    AgentRows,
    Behavior,
    layout_of,
    learn_behavior,
    read_agents,
    write_actions,
)
from racecraft.worlds.unity.env.builds import Build, find_build
from racecraft.worlds.unity.env.errors import (
    PlayerDiedError,
    PlayerLeftError,
    PlayerTimeoutError,
    SessionClosedError,
    UnityError,
    WireError,
    WireVersionError,
)
from racecraft.worlds.unity.env.process import PlayerProcess
from racecraft.worlds.unity.env.side_channels import SideChannels
from racecraft.worlds.unity.env.wire import EDITOR_PORT, MAX_MESSAGE_BYTES, Wire
from racecraft.worlds.unity.files import messages

COMMUNICATION_VERSION = "1.5.0"
"""The version of the protocol we speak; players of the same major version understand each other."""
_PYTHON_VERSION = "1.1.0"  # the release of ML-Agents' Python package whose habits we keep; players print it

_log = logging.getLogger("racecraft.unity")


@dataclass(frozen=True)
class Choice:
    """Actions for every agent of a behavior that asked, in the order of `Moment.decisions`."""

    continuous: ArrayLike | None = None
    """float (R, continuous) in [-1, 1]."""
    discrete: ArrayLike | None = None
    """int (R, branches)."""


@dataclass
class Moment:
    """One behavior at one moment."""

    decisions: AgentRows
    """Agents that ask what to do."""
    ended: AgentRows
    """Agents whose episode ended; `interrupted` tells a cut by the clock from an end."""


class Session:
    """A player, connected.

    Args:
        build: What `find_build` understands, or a `Build`.
        seed: Given to the scene once, at its start.
        timeout_seconds: How long the player may be silent.
        graphics: Whether it opens a window.
        args: Further arguments for it.
        port: The port to listen on; None for a free one (5004 for the Editor).
        host: The name to listen on; loopback unless the player sits in a container.
        num_areas: Training areas, for scenes that copy themselves.
        image_layout: "HWC" or "CHW" where the player's package version misleads about the axes of its pictures.
        log_folder: Where logs are kept; None for a folder that goes with the session.
        max_message_bytes: The largest message taken in.
        channels: Side channels prepared beforehand; what is queued goes with the first reset.
        cache_folder: See `find_build`.
        manifest: See `find_build`.

    Raises:
        BuildError: There is no such build, or it cannot be started.
        PlayerDiedError: It ended before it connected; the message holds the tail of its log.
        PlayerTimeoutError: It did not connect in time.
        WireVersionError: It speaks another version.
        PortTakenError: The wished port is in use.
    """

    def __init__(
        self,
        build: str | os.PathLike[str] | Build,
        *,
        seed: int = 0,
        timeout_seconds: float = 60.0,
        graphics: bool = False,
        args: Sequence[str] = (),
        port: int | None = None,
        host: str = "localhost",
        num_areas: int = 1,
        image_layout: str | None = None,
        log_folder: str | Path | None = None,
        max_message_bytes: int = MAX_MESSAGE_BYTES,
        channels: SideChannels | None = None,
        cache_folder: str | Path | None = None,
        manifest: str | Path | None = None,
    ) -> None:
        self.build = build if isinstance(build, Build) else find_build(
            build, cache_folder=cache_folder, manifest=manifest
        )  # fmt: skip
        self.channels = channels or SideChannels()
        self.behaviors: dict[str, Behavior] = {}
        """Every behavior met so far; the first reset brings them."""
        self._timeout_seconds = timeout_seconds
        self._image_layout = image_layout
        self._announced: dict[str, Any] = {}
        self._classes = messages.load()
        wished = port if port is not None else EDITOR_PORT if self.build.is_editor else 0
        self._wire = Wire(wished, host, max_message_bytes)
        self._process: PlayerProcess | None = None
        self._end = weakref.finalize(self, _let_go, self._wire, [], 0.0)
        try:
            if not self.build.is_editor:
                self._process = PlayerProcess(
                    self.build.command_line(self._wire.port, graphics=graphics, args=tuple(args)),
                    log_folder=log_folder,
                    unity_log=self.build.is_unity,
                    environment=self.build.environment,
                )
                self._end.detach()
                self._end = weakref.finalize(self, _let_go, self._wire, [self._process], 2.0)
            else:
                _log.warning("Waiting for the Unity Editor on port %d: press Play.", self._wire.port)
            self._introduce(seed, num_areas)
        except BaseException:
            self.close(patience_seconds=0.0)
            raise

    @property
    def port(self) -> int:
        """The port that the player calls."""
        return self._wire.port

    @property
    def pid(self) -> int | None:
        """The player's process id; None for the Editor."""
        return self._process.pid if self._process else None

    def reset(self) -> dict[str, Moment]:
        """Have all episodes begun anew and return the first moment.

        Rewards are zero and ends are left out: after a RESET the engine carries out one step with the zero action
        before it speaks, and what came of that was nobody's doing. A RESET need not put an agent back on its start.
        """
        self.send_reset()
        return self.receive()

    def step(self, choices: Mapping[str, Choice]) -> dict[str, Moment]:
        """Send the actions and return the next moment; a behavior left out does nothing (zero actions)."""
        self.send_step(choices)
        return self.receive()

    def send_reset(self) -> None:
        """Ask for new episodes; `receive` brings them. For several players at once: send to all, then receive."""
        answer = self._answer()
        answer.unity_input.rl_input.command = messages.RESET
        self._resetting = True
        self._send(answer)

    def send_step(self, choices: Mapping[str, Choice]) -> None:
        """Send the actions; `receive` brings what came of them."""
        answer = self._answer()
        answer.unity_input.rl_input.command = messages.STEP
        for name, choice in choices.items():
            if name not in self.behaviors:
                raise ValueError(f"no behavior '{name}' has been met; known: {', '.join(self.behaviors) or 'none yet'}")
            asked = self._asked[name]
            given = _rows(choice.continuous, choice.discrete)
            if given != asked:
                raise ValueError(f"'{name}': {given} rows of actions for {asked} agents that asked")
            if asked:
                into = answer.unity_input.rl_input.agent_actions[name].value
                write_actions(self.behaviors[name], into, _array(choice.continuous), _array(choice.discrete))
        self._send(answer)

    def receive(self) -> dict[str, Moment]:
        """Wait for the next moment.

        Returns:
            A `Moment` for every behavior met so far, also where it is silent.

        Raises:
            PlayerDiedError, PlayerTimeoutError, PlayerLeftError, WireError: See `errors`. The session is then closed.
        """
        try:
            return self._moments(self._receive())
        except UnityError:
            self.close(patience_seconds=0.0)
            raise

    def close(self, patience_seconds: float = 5.0) -> None:
        """Say goodbye, end the process and the server; closing twice is closing once.

        Args:
            patience_seconds: How long the player may take to leave by itself.
        """
        if self._end.detach():
            _let_go(self._wire, [self._process] if self._process else [], patience_seconds)

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _introduce(self, seed: int, num_areas: int) -> None:
        """Exchange names and versions, then wait until the player is ready for the first reset."""
        hello = self._receive().unity_output.rl_initialization_output
        self.communication_version: str = hello.communication_version
        self.package_version: str = hello.package_version
        _require_same_version(hello.communication_version, hello.package_version)
        answer = self._answer()
        introduction = answer.unity_input.rl_initialization_input
        introduction.seed, introduction.num_areas = _as_int32(seed), num_areas
        introduction.communication_version = COMMUNICATION_VERSION
        introduction.package_version = _PYTHON_VERSION
        for field in introduction.capabilities.DESCRIPTOR.fields:
            setattr(introduction.capabilities, field.name, field.name != "trainingAnalytics")
        self._wire.answer(answer.SerializeToString())
        self._announce(self._receive().unity_output)
        self._asked: dict[str, int] = {}
        self._resetting = False

    def _moments(self, message: Any) -> dict[str, Moment]:
        output = message.unity_output
        self.channels.receive(output.rl_output.side_channel)
        self._announce(output)
        agents = {name: list(listed.value) for name, listed in output.rl_output.agentInfos.items()}
        unknown = [name for name, listed in agents.items() if listed and name not in self.behaviors]
        for name in sorted(unknown, key=self._announcement):  # a protobuf map has no order of its own
            self._learn(name, agents[name][0])
        moments = {}
        for name, behavior in self.behaviors.items():
            asking = [agent for agent in agents.get(name, ()) if not agent.done]
            ended = [agent for agent in agents.get(name, ()) if agent.done and not self._resetting]
            for agent in ended:
                agent.ClearField("action_mask")  # nothing is chosen any more
            moments[name] = Moment(read_agents(behavior, asking), read_agents(behavior, ended))
            if self._resetting:
                moments[name].decisions.reward[:] = moments[name].decisions.group_reward[:] = 0
            self._asked[name] = len(asking)
        self._resetting = False
        return moments

    def _announce(self, output: Any) -> None:
        for parameters in output.rl_initialization_output.brain_parameters:
            self._announced[parameters.brain_name] = parameters

    def _announcement(self, name: str) -> int:
        """Return the behavior's place among the announced ones."""
        if name not in self._announced:
            raise WireError("agents of behavior '{name}' came without BrainParameters; expected them first.", name=name)
        return list(self._announced).index(name)

    def _learn(self, name: str, agent: Any) -> None:
        shapes = [tuple(part.shape) for part in agent.observations if len(part.shape) == 3]
        layout = self._image_layout or layout_of(self.package_version, shapes[0] if shapes else ())
        self.behaviors[name] = learn_behavior(self._announced[name], agent, layout)

    def _send(self, answer: Any) -> None:
        if not self._end.alive:
            raise SessionClosedError("the session is closed; open another.")
        answer.unity_input.rl_input.side_channel = self.channels.take_outgoing()
        self._wire.answer(answer.SerializeToString())

    def _receive(self) -> Any:
        if not self._end.alive:
            raise SessionClosedError("the session is closed; open another.")
        look_after = self._process.require_alive if self._process else (lambda: None)
        started = time.monotonic()
        try:
            data = self._wire.receive(self._timeout_seconds, look_after)
        except (PlayerDiedError, WireError) as loss:
            raise self._explained(loss) from loss
        if data is None:
            raise PlayerTimeoutError(self._silence_error(time.monotonic() - started))
        try:
            message = parsed(self._classes.UnityMessage, data)
        except MessageError as cause:
            raise WireError("the player's {cause}; expected a message of the protocol.", cause=cause) from cause
        if message.header.status == messages.STATUS_GOODBYE:
            raise PlayerLeftError("the player ended the conversation by itself.\n{log_tail}", log_tail=self._log_tail())
        if message.header.status != messages.STATUS_OK:
            raise WireError(
                "a message has status {status}; expected 200, or 400 for goodbye.", status=message.header.status
            )
        return message

    def _answer(self) -> Any:
        message = self._classes.UnityMessage()
        message.header.status = messages.STATUS_OK
        return message

    def _silence_error(self, seconds: float) -> str:
        if self._process is None:
            return (
                f"the Unity Editor has not called port {self.port} for {seconds:.0f} s. Press Play, then begin again."
            )
        return (
            f"the player has been silent for {seconds:.0f} s. On a machine without a display use a server build or "
            "leave graphics off; in a container listen on a host name the player can reach; a slow scene needs more "
            f"timeout_seconds.\n{self._log_tail()}"
        )

    def _explained(self, loss: UnityError) -> UnityError:
        """Return what happened with what the process tells of it; a dying process breaks its connection first."""
        if self._process is None or "\n" in str(loss):
            return loss
        try:
            self._process.wait_for_end(0.5)
            self._process.require_alive()
        except PlayerDiedError as death:
            return death if isinstance(loss, PlayerDiedError) else type(loss)(f"{loss}\n{death}")
        return type(loss)(f"{loss}\n{self._log_tail()}")

    def _log_tail(self) -> str:
        return self._process.log_tail() if self._process else ""


def require_patience(started: float, seconds: float) -> None:
    """Raise when, since `started` on the monotonic clock, no agent has asked for too long."""
    if time.monotonic() - started > seconds:
        raise PlayerTimeoutError(
            "for {seconds:.0f} s no agent has asked for a decision; the scene runs, but nobody in it is enabled or "
            "requests decisions. Add a Decision Requester to the agent, or give a longer timeout_seconds.",
            seconds=seconds,
        )


def _let_go(wire: Wire, processes: list[PlayerProcess], patience_seconds: float) -> None:
    """Release everything a session holds; knows no session, so that it can run when there is none any more."""
    goodbye = messages.load().UnityMessage()
    goodbye.header.status = messages.STATUS_GOODBYE
    try:
        wire.close(goodbye.SerializeToString(), patience_seconds=min(patience_seconds, 2.0))
    finally:
        for process in processes:
            process.close(patience_seconds)


def _require_same_version(theirs: str, package: str) -> None:
    """Players and servers understand each other within one major version (before 1.0: one minor version)."""
    ours, parts = COMMUNICATION_VERSION.split("."), theirs.split(".")
    if len(parts) < 2 or not all(part.isdigit() for part in parts[:2]):
        raise WireVersionError(
            "the player claims version '{theirs}' of the protocol; expected something like 1.5.0.", theirs=theirs
        )
    if parts[0] != ours[0]:
        raise WireVersionError(
            "the player speaks version {theirs} of the protocol (package {package}); "
            "expected {ours}.x. Build the scene with com.unity.ml-agents 1.0 or later.",
            theirs=theirs,
            package=package or "unknown",
            ours=ours[0],
        )


def _as_int32(seed: int) -> int:
    """Fold a seed into what the protocol can carry."""
    return (seed + 2**31) % 2**32 - 2**31


def _rows(continuous: ArrayLike | None, discrete: ArrayLike | None) -> int:
    for actions in (continuous, discrete):
        if actions is not None:
            return len(np.asarray(actions))
    return 0


def _array(actions: ArrayLike | None) -> Any:
    return None if actions is None else np.asarray(actions)
