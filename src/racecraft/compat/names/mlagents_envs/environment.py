"""`UnityEnvironment`: a player, driven as ML-Agents' own class drives it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from racecraft.compat.names.mlagents_envs.base_env import (
    ActionTuple,
    BaseEnv,
    BehaviorMapping,
    BehaviorSpec,
    DecisionSteps,
    TerminalSteps,
    decisions_of,
    ends_of,
    spec_of,
)
from racecraft.compat.names.mlagents_envs.exception import (
    UnityActionException,
    UnityCommunicationException,
    UnityCommunicatorStoppedException,
    UnityEnvironmentException,
    UnityTimeOutException,
    UnityWorkerInUseException,
)
from racecraft.compat.names.mlagents_envs.side_channel.side_channel import SideChannel
from racecraft.compat.names.mlagents_envs.side_channel.side_channel_manager import SideChannelManager
from racecraft.worlds.unity.env.builds import Build
from racecraft.worlds.unity.env.errors import (
    BuildError,
    PlayerLeftError,
    PlayerTimeoutError,
    PortTakenError,
    SessionClosedError,
    UnityError,
)
from racecraft.worlds.unity.env.session import Choice, Moment, Session, require_patience
from racecraft.worlds.unity.env.side_channels import SideChannels
from racecraft.worlds.unity.env.wire import EDITOR_PORT

Said = TypeVar("Said")
_PACKAGE_OF_0 = "gym_unity"
"""A package that only Python 0.x had: who imports it expects pictures as (H, W, C)."""


class UnityEnvironment(BaseEnv):
    """One player.

    Pictures are as the player sends them: (C, H, W) from packages 3.x on, whose Python was 1.x, and (H, W, C) before,
    whose Python was 0.x. A script that imports `gym_unity`, a name of 0.x alone, is shown (H, W, C) by every player.

    Args:
        file_name: A build, as ML-Agents names it, or anything `racecraft.worlds.unity.env.builds.find_build`
            understands; None for the Editor.
        worker_id: Added to `base_port`.
        base_port: The first port; None for whichever is free.
        seed: Given to the scene at its start.
        no_graphics: Whether the player opens no window.
        no_graphics_monitor: The same here.
        timeout_wait: Seconds that it may be silent.
        additional_args: Further arguments for it.
        side_channels: Channels of yours.
        log_folder: Where its logs are kept.
        num_areas: Training areas.

    Raises:
        UnityWorkerInUseException: The port is taken.
        UnityEnvironmentException: The player cannot be started or reached.
    """

    DEFAULT_EDITOR_PORT = EDITOR_PORT
    BASE_ENVIRONMENT_PORT = 5005
    API_VERSION = "1.5.0"

    def __init__(
        self,
        file_name: str | Build | None = None,
        worker_id: int = 0,
        base_port: int | None = None,
        seed: int = 0,
        no_graphics: bool = False,
        no_graphics_monitor: bool = False,
        timeout_wait: float = 60,
        additional_args: Sequence[str] | None = None,
        side_channels: Sequence[SideChannel] | None = None,
        log_folder: str | None = None,
        num_areas: int = 1,
    ) -> None:
        if file_name is None and worker_id != 0:
            raise UnityEnvironmentException("the Editor is one player; expected worker_id 0 where no file is named")
        self._channels = SideChannels()
        self._side_channel_manager = SideChannelManager(side_channels)
        for channel in self._side_channel_manager.channels:
            self._channels.listen(channel.channel_id, channel.deliver)
        self._channels_last = _PACKAGE_OF_0 in sys.modules
        self._timeout, self._actions, self._moments = float(timeout_wait), dict[str, ActionTuple](), dict[str, Moment]()
        self._told: dict[str, tuple[DecisionSteps, TerminalSteps]] = {}
        port = None if base_port is None else base_port + worker_id
        try:
            self._session = Session(
                file_name if file_name is not None else "editor",
                seed=seed,
                timeout_seconds=self._timeout,
                graphics=not (no_graphics or no_graphics_monitor),
                args=tuple(additional_args or ()),
                port=port,
                num_areas=num_areas,
                log_folder=log_folder,
                channels=self._channels,
            )
        except PortTakenError as cause:
            raise UnityWorkerInUseException(worker_id) from cause
        except (BuildError, UnityError) as cause:
            raise _in_their_words(cause) from cause

    @property
    def behavior_specs(self) -> Mapping[str, BehaviorSpec]:
        """Every behavior met so far; `reset` brings the first."""
        return BehaviorMapping({
            name: spec_of(behavior, self._channels_last) for name, behavior in self._session.behaviors.items()
        })  # fmt: skip

    def reset(self) -> None:
        """Have all episodes begun anew, until some agent asks."""
        started = time.monotonic()
        self._moments = self._say(self._session.reset)
        while not any(len(moment.decisions) for moment in self._moments.values()):
            self._require_patience(started)
            self._moments = self._say(lambda: self._session.step({}))
        self._actions.clear()

    def step(self) -> None:
        """Send the actions that were set; a behavior without gets zeros."""
        if not self._moments:
            self.reset()
            return
        choices = {}
        for name, action in self._actions.items():
            of = self._session.behaviors[name].actions
            choices[name] = Choice(
                continuous=action.continuous if of.continuous else None,
                discrete=action.discrete if of.branches else None,
            )
        self._actions.clear()
        self._moments = self._say(lambda: self._session.step(choices))

    def get_steps(self, behavior_name: str) -> tuple[DecisionSteps, TerminalSteps]:
        """Return who asks, and whose episode ended; the same objects until the next step."""
        if behavior_name not in self._told:
            moment, behavior = self._moment(behavior_name), self._session.behaviors[behavior_name]
            self._told[behavior_name] = (
                decisions_of(moment.decisions, behavior, self._channels_last),
                ends_of(moment.ended, behavior, self._channels_last),
            )
        return self._told[behavior_name]

    def set_actions(self, behavior_name: str, action: ActionTuple) -> None:
        """Set the actions of all agents that ask, in the order of `get_steps`."""
        count = len(self._moment(behavior_name).decisions)
        spec_of(self._session.behaviors[behavior_name]).action_spec.require(action, count, behavior_name)
        if count:
            self._actions[behavior_name] = action

    def set_action_for_agent(self, behavior_name: str, agent_id: int, action: ActionTuple) -> None:
        """Set one agent's action; agents without get zeros."""
        row_of = self.get_steps(behavior_name)[0].agent_id_to_index
        if agent_id not in row_of:
            raise UnityActionException(
                f"'{behavior_name}': agent {agent_id} does not ask; those that do: {list(row_of)}"
            )
        spec = spec_of(self._session.behaviors[behavior_name]).action_spec
        spec.require(action, 1, behavior_name)
        if behavior_name not in self._actions:
            self._actions[behavior_name] = spec.empty_action(len(row_of))
        kept, row = self._actions[behavior_name], row_of[agent_id]
        kept.continuous[row], kept.discrete[row] = action.continuous[0], action.discrete[0]

    def close(self) -> None:
        """End the player."""
        self._session.close()

    def _moment(self, name: str) -> Moment:
        if name not in self._moments:
            known = ", ".join(self._moments) or "none; call reset() first"
            raise UnityActionException(f"there is no behavior '{name}'; known: {known}")
        return self._moments[name]

    def _say(self, say: Callable[[], Said]) -> Said:
        for channel in self._side_channel_manager.channels:
            for payload in channel.take_queued():
                self._channels.send(channel.channel_id, payload)
        self._told.clear()
        try:
            return say()
        except UnityError as cause:
            raise _in_their_words(cause) from cause

    def _require_patience(self, started: float) -> None:
        try:
            require_patience(started, self._timeout)
        except UnityError as cause:
            raise _in_their_words(cause) from cause


def _in_their_words(cause: Exception) -> Exception:
    """Return an exception of ML-Agents' for a letter of ours."""
    match cause:
        case PlayerTimeoutError():
            return UnityTimeOutException(str(cause))
        case PlayerLeftError():
            return UnityCommunicatorStoppedException(str(cause))
        case BuildError() | SessionClosedError():
            return UnityEnvironmentException(str(cause))
    return UnityCommunicationException(str(cause))


__all__ = ["UnityEnvironment"]
