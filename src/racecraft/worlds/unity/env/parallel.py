"""A Unity scene with any number of behaviors as a PettingZoo `ParallelEnv`.

Begin at `unity_parallel`. Agents are named `Behavior?team=0?agent_id=3`; the number is the agent's place among those of
its behavior, so that names last although Unity's ids may not. Observations are a Box, or a Dict by sensor where there
are several; actions are Discrete (one branch), MultiDiscrete (several), Box (numbers) or a Tuple of Box and
MultiDiscrete (both). What is allowed stands in `info["action_mask"]`, bool, branch after branch.

An agent leaves when its episode ends. Unity begins its next one at once; until every agent has left, such an agent is
given the first allowed action and is not shown. When nobody is left the game is over, and `reset` begins the next one:
in place, or with a new player where it brings a seed, because Unity takes a seed at its start only.
"""

from __future__ import annotations

import os
import time
from typing import Any

import numpy as np

from racecraft.contract.errors import MissingExtraError
from racecraft.contract.world import Array
from racecraft.worlds.unity.env.behaviors import AgentRows, Behavior, first_allowed
from racecraft.worlds.unity.env.builds import Build, find_build
from racecraft.worlds.unity.env.errors import UnityError
from racecraft.worlds.unity.env.session import Choice, Moment, Session, require_patience


def unity_parallel(build: str | os.PathLike[str] | Build, **options: Any) -> Any:
    """Return a `pettingzoo.ParallelEnv` over every behavior of a scene.

    Args:
        build: What `find_build` understands.
        options: Further words of `Session` (`seed`, `args`, `timeout_seconds` …).

    Raises:
        MissingExtraError: PettingZoo is not installed.
        UnityError: The player cannot be brought to talk.
    """
    try:
        from pettingzoo import ParallelEnv
    except ImportError as cause:
        raise MissingExtraError(
            "PettingZoo is not installed; scenes with several behaviors need it. Run: pip install pettingzoo"
        ) from cause
    game = _Game(build if isinstance(build, Build) else find_build(build), options)

    class UnityParallelEnv(ParallelEnv):
        """Every agent of a scene, moving at once."""

        metadata = {"name": f"unity/{game.build.name}", "render_modes": []}  # noqa: RUF012
        render_mode = None

        def __init__(self) -> None:
            self.game = game
            self.possible_agents = list(game.places)
            self.agents: list[str] = []

        def observation_space(self, agent: str) -> Any:
            return game.observation_spaces[agent.rsplit("?", 1)[0]]

        def action_space(self, agent: str) -> Any:
            return game.action_spaces[agent.rsplit("?", 1)[0]]

        def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
            game.begin(seed)
            self.agents = game.playing()
            return {name: game.seen[name] for name in self.agents}, {name: game.info(name) for name in self.agents}

        def step(self, actions: dict[str, Any]) -> Any:
            before = list(self.agents)
            game.step(actions)
            self.agents = game.playing()
            agents = [name for name in before if name in game.seen]
            ended = game.ended
            return (
                {name: game.seen[name] for name in agents},
                {name: game.rewards.get(name, 0.0) for name in agents},
                {name: ended.get(name) is False for name in agents},
                {name: ended.get(name) is True for name in agents},
                {name: game.info(name) for name in agents},
            )

        def close(self) -> None:
            game.close()

    return UnityParallelEnv()


class _Game:
    """A session and who plays in it."""

    def __init__(self, build: Build, options: dict[str, Any]) -> None:
        self.build, self._options = build, dict(options)
        self._session = Session(build, **options)
        try:
            self._first: dict[str, Moment] | None = self._session.reset()
            self.places = [
                f"{name}?agent_id={place}"
                for name, moment in self._first.items()
                for place in range(len(moment.decisions))
            ]
            self.observation_spaces = {name: _sees(one) for name, one in self._session.behaviors.items()}
            self.action_spaces = {name: _does(one) for name, one in self._session.behaviors.items()}
        except BaseException:
            self._session.close()
            raise
        self._counts = {name: len(moment.decisions) for name, moment in self._first.items()}

    def begin(self, seed: int | None) -> None:
        """Begin a game; everybody plays."""
        if seed is not None and not self.build.is_editor:
            self._session.close()
            self._session = Session(self.build, **{**self._options, "seed": seed})
            self._first = None
        moments = self._first or self._session.reset()
        self._first = None
        self._place_of: dict[tuple[str, int], str] = {}
        self._free = {
            name: [f"{name}?agent_id={place}" for place in range(self._counts[name])] for name in self._counts
        }
        self._left: set[str] = set()
        self.seen: dict[str, Any] = {}
        self.rewards: dict[str, float] = {}
        self.ended: dict[str, bool] = {}
        self._masks: dict[str, Array] = {}
        self._receive(moments)

    def playing(self) -> list[str]:
        """Return who is still in the game, in the order of `places`."""
        here = set(self._place_of.values()) - self._left
        return [name for name in self.places if name in here]

    def step(self, actions: dict[str, Any]) -> None:
        """Tell those who asked, and wait until somebody who still plays asks again, or nobody plays any more."""
        self.seen, self.rewards, self.ended = {}, {}, {}
        self._receive(self._session.step(self._choices(actions)))
        started = time.monotonic()
        while self.playing() and not any(name in self.seen for name in self.playing()):
            require_patience(started, self._options.get("timeout_seconds", 60.0))
            self._receive(self._session.step(self._choices({})))

    def info(self, name: str) -> dict[str, Any]:
        """Return what is allowed, where that is a question."""
        return {"action_mask": self._masks[name]} if name in self._masks else {}

    def close(self) -> None:
        self._session.close()

    def _choices(self, actions: dict[str, Any]) -> dict[str, Choice]:
        choices = {}
        for name, asking in self._asking.items():
            behavior = self._session.behaviors[name]
            continuous = np.zeros((len(asking), behavior.actions.continuous), np.float32)
            discrete = first_allowed(behavior, asking)
            for row, agent in enumerate(asking.agent_id.tolist()):
                place = self._place_of[name, agent]
                if place in actions and place not in self._left:
                    numbers, branches = _parts(behavior, actions[place])
                    continuous[row], discrete[row] = numbers, branches
            choices[name] = Choice(
                continuous if behavior.actions.continuous else None, discrete if behavior.actions.branches else None
            )
        return choices

    def _receive(self, moments: dict[str, Moment]) -> None:
        for name, moment in moments.items():
            for row, agent in enumerate(moment.ended.agent_id.tolist()):
                place = self._place_of.pop((name, agent), None)
                if place is None:
                    continue
                self._free[name].append(place)
                if place not in self._left:
                    self._tell(name, place, moment.ended, row)
                    self.ended[place] = bool(moment.ended.interrupted[row])
                    self._left.add(place)
        self._asking = {name: moment.decisions for name, moment in moments.items() if len(moment.decisions)}
        for name, asking in self._asking.items():
            for row, agent in enumerate(asking.agent_id.tolist()):
                place = self._place_of.get((name, agent))
                is_new = place is None
                if place is None:
                    place = self._place_of[name, agent] = self._take_place(name, agent)
                if place not in self._left:
                    self._tell(name, place, asking, row, with_reward=not is_new)

    def _take_place(self, name: str, agent: int) -> str:
        if not self._free.get(name):
            raise UnityError(
                "agent {agent} of '{name}' joined a game of {counts} agents of its behavior; "
                "PettingZoo needs to know everybody from the start.",
                agent=agent,
                name=name,
                counts=self._counts.get(name, 0),
            )
        return self._free[name].pop(0)

    def _tell(self, name: str, place: str, rows: AgentRows, row: int, with_reward: bool = True) -> None:
        sensors = self._session.behaviors[name].sensors
        parts = {sensor.name: values[row] for sensor, values in zip(sensors, rows.observations, strict=True)}
        self.seen[place] = parts if len(parts) > 1 else next(iter(parts.values()))
        if with_reward:
            earned = float(rows.reward[row] + rows.group_reward[row])
            self.rewards[place] = self.rewards.get(place, 0.0) + earned
        if rows.allowed is not None:
            self._masks[place] = rows.allowed[row]


def _sees(behavior: Behavior) -> Any:
    from gymnasium import spaces

    boxes: dict[str, spaces.Space[Any]] = {
        sensor.name: spaces.Box(0, 255, sensor.shape, np.uint8)
        if sensor.compressed
        else spaces.Box(-np.inf, np.inf, sensor.shape, np.float32)
        for sensor in behavior.sensors
    }
    return spaces.Dict(boxes) if len(boxes) > 1 else next(iter(boxes.values()))


def _does(behavior: Behavior) -> Any:
    from gymnasium import spaces

    actions = behavior.actions
    numbers = spaces.Box(-1.0, 1.0, (actions.continuous,), np.float32)
    if not actions.branches:
        return numbers
    choices = spaces.MultiDiscrete(list(actions.branches))
    if actions.continuous:
        return spaces.Tuple((numbers, choices))
    return choices if len(actions.branches) > 1 else spaces.Discrete(actions.branches[0])


def _parts(behavior: Behavior, action: Any) -> tuple[Any, Any]:
    """Split an action of the space into numbers and choices."""
    if behavior.actions.continuous and behavior.actions.branches:
        return action[0], action[1]
    return (action, ()) if behavior.actions.continuous else ((), action)
