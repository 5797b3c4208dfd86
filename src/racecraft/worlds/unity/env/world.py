"""Unity players as a World: the agents of one process are a batch, and several processes make it larger.

Begin at `UnityWorld`; its `step` is the list of acts. Each agent of the chosen behavior has a row of its own (a world
of one agent, unless `together` makes all agents of a process one world of many); `rows.py` seats them.

What differs from a world of our own, because the story is told elsewhere:

* Unity seeds itself at its start only, and a RESET need not put agents back. `reset` therefore starts the player anew,
  unless it is as fresh as the seed asks; `restart_on_reset=False` (always so with the Editor) sends a RESET instead,
  and the same seed then no longer tells the same story.
* A player cannot be frozen: `save_state` notes seed and tick, and `load_state` goes on with new episodes.
* Agents that do not ask in a message have inactive rows until they ask again; what they earn meanwhile is written when
  it is told.
* Reward is the agent's own plus its group's. The reward beside an episode's first decision belongs to no action and is
  left out (after a RESET it would even be that of a zero action nobody chose).

World card
    Acts             what the behavior declares; see `actions.py`
    Sees             the behavior's sensors by name; pictures (H, W, C)
    Rewarded by      the scene
    Terminates       when the scene ends an episode
    Truncates        when the scene says it was interrupted (MaxStep), or a lost player was started anew
    Sources          facts: unity-ml-agents
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from racecraft.contract.errors import UserInputError
from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import Array, ArraySpec, EpisodeRecord, StepBuffers, WorldSpec
from racecraft.worlds.unity.env.actions import ActionTable
from racecraft.worlds.unity.env.behaviors import Behavior, Sensor
from racecraft.worlds.unity.env.builds import Build, find_build
from racecraft.worlds.unity.env.choosing import choose, choose_several, single
from racecraft.worlds.unity.env.errors import (
    BuildError,
    PlayerDiedError,
    PlayerLeftError,
    PlayerTimeoutError,
    UnityError,
)
from racecraft.worlds.unity.env.joint_rows import JointSeats, joint_spec
from racecraft.worlds.unity.env.restarts import RestartLimits, RestartQuota
from racecraft.worlds.unity.env.rows import Seats
from racecraft.worlds.unity.env.session import Moment, Session, require_patience
from racecraft.worlds.unity.env.side_channels import Gaussian, MultiRange, SideChannels, Statistic, Uniform

ENGINE_FOR_TRAINING: Mapping[str, Any] = {
    "width": 84,
    "height": 84,
    "quality_level": 5,
    "time_scale": 20.0,
    "target_frame_rate": -1,
    "capture_frame_rate": 60,
}
"""How fast and how fine a player runs while it teaches: the defaults of `mlagents-learn`."""
ENGINE_FOR_INFERENCE: Mapping[str, Any] = {
    "width": 1280,
    "height": 720,
    "quality_level": 5,
    "time_scale": 1.0,
    "target_frame_rate": 60,
    "capture_frame_rate": 0,
}
"""The same while nothing is learned and somebody watches: the time of a clock on the wall, in a window of some size."""

LOSSES = (PlayerDiedError, PlayerLeftError, PlayerTimeoutError)
"""How a player is lost; a message that breaks the protocol is no loss, and starting anew would not mend it."""
_log = logging.getLogger("racecraft.unity")


class UnityWorld:
    """N agents of Unity players, side by side.

    Args:
        build: A path, `registry:NAME`, `editor` or `builtin:Basic`; see `find_build`.
        behavior: The behavior to act for, with or without its team; None where the scene has only one. Agents of other
            behaviors get zero actions.
        several: Whether more behaviors than one are acted for, as `joint_rows.py` lays them out: those that `behavior`
            lists, or all of the scene.
        num_players: Processes.
        together: Whether the agents of a process are one world of M agents instead of M worlds of one.
        seed: What the players start with; a first `reset` with the same seed needs no new start.
        max_agents: Rows kept for one process; None for as many as ask first.
        restart_on_reset: Whether `reset` starts the players anew.
        max_lifetime_restarts: How often each player is started anew when it is lost (-1: no limit, 0: never); the
            episodes under way in it are cut, which is said. One loss more is an error.
        restarts_rate_limit_n: How often within one period (-1: no limit).
        restarts_rate_limit_period_s: The period, in seconds.
        inference: Whether nothing is learned and somebody may watch; chooses the engine settings' defaults.
        engine: Engine settings, the words of `SideChannels.set_engine`; None for `ENGINE_FOR_TRAINING`, or for
            `ENGINE_FOR_INFERENCE`.
        time_scale: Simulated seconds a second; None as `engine` has it.
        base_port: The first player's port, each further one's is one higher; None for whichever are free.
        parameters: Environment parameters by name, numbers or samplers; each sampler has a seed of its own.
        options: Further words of `Session` (`args`, `timeout_seconds`, `graphics`, `image_layout` …).

    Raises:
        BuildError: There is no such build or behavior.
        UserInputError: A limit or a port that cannot be.
        UnityError: A player cannot be brought to talk.
    """

    def __init__(
        self,
        build: str | os.PathLike[str] | Build,
        *,
        behavior: str | Sequence[str] | None = None,
        several: bool = False,
        num_players: int = 1,
        together: bool = False,
        seed: int = 0,
        max_agents: int | None = None,
        restart_on_reset: bool = True,
        max_lifetime_restarts: int = RestartLimits.max_lifetime_restarts,
        restarts_rate_limit_n: int = RestartLimits.restarts_rate_limit_n,
        restarts_rate_limit_period_s: float = RestartLimits.restarts_rate_limit_period_s,
        inference: bool = False,
        engine: Mapping[str, Any] | None = None,
        time_scale: float | None = None,
        base_port: int | None = None,
        parameters: Mapping[str, float | Uniform | Gaussian | MultiRange] | None = None,
        **options: Any,
    ) -> None:
        paths = {name: options.pop(name) for name in ("cache_folder", "manifest") if name in options}
        self._build = build if isinstance(build, Build) else find_build(build, **paths)
        if self._build.is_editor and num_players != 1:
            raise BuildError("the Editor is one player; num_players must be 1.")
        self._engine = dict(engine or (ENGINE_FOR_INFERENCE if inference else ENGINE_FOR_TRAINING))
        if time_scale is not None:
            self._engine["time_scale"] = time_scale
        self._parameters, self._options = dict(parameters or {}), options
        self._ports = _ports_from(base_port, num_players)
        limits = RestartLimits(max_lifetime_restarts, restarts_rate_limit_n, restarts_rate_limit_period_s)
        self._quotas = [RestartQuota(limits) for _ in range(num_players)]
        self._restart_on_reset = restart_on_reset and not self._build.is_editor
        self._seed, self._ticks = seed, 0
        self._statistics: list[Statistic] = []
        self._players: list[_Player] = []
        self._players = self._open_all(num_players)
        try:
            known = self._players[0].session.behaviors
            chosen = choose_several(behavior, known) if several else [choose(single(behavior), known)]
            self._behaviors = tuple(known[names[0]] for names in chosen)
            parts = [self._seat(names, max_agents, together) for names in chosen]
            self._spec: WorldSpec
            self._seats: Seats | JointSeats
            self._spec, self._seats = parts[0] if len(parts) == 1 else self._join(parts)
        except BaseException:
            self.close()
            raise

    @property
    def spec(self) -> WorldSpec:
        """The shape of this world's promise."""
        return self._spec

    @property
    def behavior(self) -> Behavior:
        """The behavior acted for, as the player told it (of the first team, where there are several)."""
        return self._behaviors[0]

    @property
    def behaviors(self) -> tuple[Behavior, ...]:
        """All behaviors acted for, in the order of their rows."""
        return self._behaviors

    @property
    def rows_of(self) -> dict[str, slice]:
        """Which worlds belong to which behavior, by its name without the team."""
        if isinstance(self._seats, JointSeats):
            return self._seats.rows_of
        return {self.behavior.base_name: slice(0, self._spec.num_worlds)}

    @property
    def restarts(self) -> int:
        """How many lost players were started anew so far."""
        return sum(quota.used for quota in self._quotas)

    @property
    def sessions(self) -> list[Session]:
        """The conversations, one a process, for side channels and diagnosis."""
        return [player.session for player in self._players]

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every episode anew; see the page above for when players start anew."""
        fresh = self._ticks == 0 and seed == self._seed
        self._seed = seed
        if not fresh:
            if self._restart_on_reset:
                self._close_players()
                self._players = self._open_all(len(self._players))
            else:
                for player in self._players:
                    player.session.send_reset()
                for player in self._players:
                    self._or_restarted(player, lambda player=player: self._receive_first(player))  # type: ignore[misc]
        self._ticks = 0
        self._seats.clear()
        for player in self._players:
            self._settle(player, player.first, None)
        self._seats.show(buffers)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Tell every agent that asked what to do, and wait until each player asks again."""
        self._ticks += 1
        self._seats.begin_step()
        for array in (buffers.reward, buffers.terminated, buffers.truncated):
            array[:] = 0
        for player in self._players:
            self._send(player, actions)
        for player in self._players:
            self._receive(player, buffers)
        self._seats.show(buffers)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, oldest first."""
        return self._seats.pop_episodes()

    def take_statistics(self) -> list[Statistic]:
        """Return what the scenes recorded since the last call."""
        taken = self._statistics
        self._statistics = []
        return taken + [row for session in self.sessions for row in session.channels.take_statistics()]

    def set_parameter(self, name: str, value: float | Uniform | Gaussian | MultiRange) -> None:
        """Set an environment parameter in every player, from the next step on and after every new start."""
        self._parameters[name] = value
        for player in self._players:
            player.session.channels.set_parameter(name, value, sampler_seed(player.seed, name))

    def save_state(self) -> dict[str, Array]:
        """Return seed and tick; more of a Unity player cannot be kept."""
        return {"seed": np.array(self._seed, np.int64), "ticks": np.array(self._ticks, np.int64)}

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on with new episodes, with a seed that follows from the saved seed and tick."""
        self.reset(buffers, (int(state["seed"]) + int(state["ticks"])) % 2**31)

    def close(self) -> None:
        """End the players; closing twice is closing once."""
        self._close_players()

    def _open_all(self, count: int) -> list[_Player]:
        """Start the players side by side: a real one takes seconds."""
        keys = stream_keys(self._seed, "unity player", count)
        seeds = [self._seed, *(int(key) % 2**31 for key in keys[1:])]
        if count == 1:
            return [self._open(0, seeds[0])]
        with ThreadPoolExecutor(count) as pool:
            opening = [pool.submit(self._open, index, seed) for index, seed in enumerate(seeds)]
            opened, failures = [], []
            for future in opening:
                failure = future.exception()
                failures.append(failure) if failure else opened.append(future.result())
        if (failure := next(filter(None, failures), None)) is not None:
            for player in opened:
                player.session.close()
            raise failure
        return opened

    def _open(self, index: int, seed: int) -> _Player:
        channels = SideChannels()
        channels.set_engine(**self._engine)
        for name, value in self._parameters.items():
            channels.set_parameter(name, value, sampler_seed(seed, name))
        options = {**self._options, **self._ports[index]}
        session = Session(self._build, seed=seed, channels=channels, **options)
        player = _Player(index, seed, session)
        try:
            player.first = self._run_until_decision(player, session.reset())
        except BaseException:
            session.close()
            raise
        return player

    def _run_until_decision(self, player: _Player, moments: dict[str, Moment]) -> dict[str, Moment]:
        """Go on without actions until some agent asks; messages may hold nothing but ends."""
        begun = time.monotonic()
        while not any(len(moment.decisions) for moment in moments.values()):
            require_patience(begun, self._options.get("timeout_seconds", 60.0))
            moments = player.session.step({})
        return moments

    def _seat(self, names: list[str], max_agents: int | None, together: bool) -> tuple[WorldSpec, Seats]:
        """Return the promise and the rows of one behavior's agents, of all teams."""
        player, processes = self._players[0], len(self._players)
        behavior = player.session.behaviors[names[0]]
        each = max_agents or sum(len(player.first[name].decisions) for name in names)
        worlds = (processes, each) if together else (processes * each, 1)
        spec = spec_of(behavior, f"unity/{self._build.name}/{behavior.base_name}", *worlds)
        return spec, Seats(spec, behavior.sensors, ActionTable(behavior.actions), names, processes)

    def _join(self, parts: list[tuple[WorldSpec, Seats]]) -> tuple[WorldSpec, JointSeats]:
        specs = {behavior.base_name: spec for behavior, (spec, _) in zip(self._behaviors, parts, strict=True)}
        seats = [seats for _, seats in parts]
        return joint_spec(specs, f"unity/{self._build.name}/{'+'.join(specs)}"), JointSeats(specs, seats)

    def _send(self, player: _Player, actions: Array) -> None:
        player.session.send_step(self._seats.choices(player.index, actions))

    def _receive(self, player: _Player, buffers: StepBuffers) -> None:
        """Settle a player's moments until one of its agents asks; a lost player is started anew while it may be."""
        if self._or_restarted(player, lambda: self._settle_until_decision(player, buffers)):
            self._seats.truncate_all(player.index, buffers)
            self._settle(player, player.first, buffers)

    def _settle_until_decision(self, player: _Player, buffers: StepBuffers) -> None:
        begun = time.monotonic()
        self._settle(player, player.session.receive(), buffers)
        while not self._seats.has_decisions(player.index):
            require_patience(begun, self._options.get("timeout_seconds", 60.0))
            player.session.send_step(self._seats.idle_choices(player.index))
            self._settle(player, player.session.receive(), buffers)

    def _receive_first(self, player: _Player) -> None:
        player.first = self._run_until_decision(player, player.session.receive())

    def _or_restarted(self, player: _Player, talk: Callable[[], None]) -> bool:
        """Talk with a player, or start it anew if it is lost; tell whether it was.

        Raises:
            PlayerDiedError, PlayerLeftError, PlayerTimeoutError: It was lost more often than is allowed.
        """
        try:
            talk()
        except LOSSES as loss:
            self._restart(player, loss)
            return True
        return False

    def _restart(self, player: _Player, loss: UnityError) -> None:
        player.session.close(patience_seconds=0.0)
        if self._build.is_editor:
            raise loss
        if why_not := self._quotas[player.index].use():
            raise type(loss)(f"{loss}\n{why_not}") from loss
        _log.warning("A Unity player was lost and is started anew; its episodes under way are cut: %s", loss)
        try:
            again = self._open(player.index, player.seed)
        except LOSSES as next_loss:
            self._restart(player, next_loss)
            return
        player.session, player.first = again.session, again.first

    def _settle(self, player: _Player, moments: Mapping[str, Moment], buffers: StepBuffers | None) -> None:
        self._seats.fill_rows(player.index, moments, player.session.behaviors, buffers)

    def _close_players(self) -> None:
        sessions = self.sessions
        self._statistics += [row for session in sessions for row in session.channels.take_statistics()]
        if len(sessions) == 1:
            sessions[0].close()
        elif sessions:
            with ThreadPoolExecutor(len(sessions)) as pool:
                list(pool.map(Session.close, sessions))


def sampler_seed(player_seed: int, parameter: str) -> int:
    """Return a sampler's own seed: two parameters of one player, or one of two players, do not move together.

    >>> sampler_seed(1, "mass") != sampler_seed(1, "wind") != sampler_seed(2, "wind")
    True
    """
    return int(stream_keys(player_seed, f"unity sampler {parameter}", 1)[0]) % 2**31


def spec_of(behavior: Behavior, name: str, num_worlds: int = 1, num_agents: int = 1) -> WorldSpec:
    """Return the promise of a world of such agents; from a run's card too, where no player is at hand."""
    table = ActionTable(behavior.actions)
    return WorldSpec(
        name=name,
        num_worlds=num_worlds,
        num_agents=num_agents,
        observations={sensor.name: _spec_of(sensor) for sensor in behavior.sensors},
        actions=table.spec,
        has_action_mask=table.has_mask,
    )


@dataclass
class _Player:
    """One process and the rows of its agents."""

    index: int
    seed: int
    session: Session
    first: dict[str, Moment] = field(default_factory=dict)


def _ports_from(base_port: int | None, count: int) -> list[dict[str, int]]:
    """Return the words that give each player its port."""
    if base_port is None:
        return [{} for _ in range(count)]
    if not 0 < base_port <= 65536 - count:
        raise UserInputError(
            "base_port is {base_port}; expected 1 to {count} for {count_2} players.",
            base_port=base_port,
            count=65536 - count,
            count_2=count,
        )
    return [{"port": base_port + index} for index in range(count)]


def _spec_of(sensor: Sensor) -> ArraySpec:
    kind = "picture (H, W, C)" if sensor.is_picture else "entities, absent ones zero" if len(sensor.shape) == 2 else ""
    low, high = (0, 255) if sensor.compressed else (-np.inf, np.inf)
    return ArraySpec(sensor.shape, sensor.dtype, low, high, doc=f"Unity sensor '{sensor.name}' {kind}".strip())
