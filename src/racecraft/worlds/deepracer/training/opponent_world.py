"""Training against others as a world: what the learner sees of it are its own cars, one row each. See `OpponentWorld`.

Races are dealt once: a share against chosen models, a share against a past self, the rest against itself. In the first
two the learner drives one car, on a place of the grid that differs from race to race; in the last all of them. The
others' cars are no rows here, so nothing of theirs is ever learned from. Who the past self is, the world does not know:
to it that is a policy like another (`training/opponent_pool.py`).

A past self is as fast as the learner once both drive at their table's top speed, and a car that is never caught up with
teaches nobody to pass it. So in some races its car is a slower one (`Dealt.paces`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, WorldSpec, allocate
from racecraft.training.learner_rows import LearnerRows
from racecraft.worlds.deepracer.env.actions import ActionSpace, ActionTable, OwnActions
from racecraft.worlds.deepracer.env.fidelity import AwsQuirks
from racecraft.worlds.deepracer.env.settings import AgainstConfig
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.players.driver import Driver
from racecraft.worlds.deepracer.players.seats import NOBODY, Seats
from racecraft.worlds.deepracer.tracks.track import Track

CHOSEN, PAST, SELF = "chosen", "past", "self"
"""Whom a race is driven against."""
LEARNER, POOL = 0, 1
"""Numbers of action spaces and drivers; chosen models come behind."""


class PastSelf(Policy, Protocol):
    """A policy that drives the cars of past selves."""

    def begin(self, seed: int) -> None:
        """Take up new dice."""
        ...


@dataclass(frozen=True)
class Dealt:
    """Who drives what in N races of M cars."""

    kinds: tuple[str, ...]
    """Whom each race is driven against, (N,)."""
    whose: Array
    """(N, M) LEARNER, POOL, or 2 and on: the number of a chosen model, plus 2."""
    paces: Array
    """(N,) share of the speed they are told that cars of past selves drive at; 1 where none is met."""

    @property
    def mine(self) -> Array:
        """(N, M) the learner's own cars."""
        return self.whose == LEARNER


def deal(races: int, config: AgainstConfig, chosen: int, itself: bool) -> Dealt:
    """Return who drives what.

    Args:
        races: N.
        config: Cars a race, and shares.
        chosen: How many chosen models there are; they take turns.
        itself: Whether the learner meets itself and its past, too.

    >>> deal(4, AgainstConfig(pool_share=0.5), chosen=1, itself=True).kinds
    ('chosen', 'chosen', 'past', 'self')
    >>> deal(2, AgainstConfig(cars=3), chosen=2, itself=False).whose.tolist()
    [[0, 2, 3], [2, 0, 3]]
    >>> deal(6, AgainstConfig(slowest=0.5), chosen=0, itself=True).paces.tolist()
    [0.5, 0.75, 1.0, 1.0, 1.0, 1.0]
    """
    against = (round(races * config.chosen_share) if itself else races) if chosen else 0
    past = round((races - against) * config.pool_share)
    kinds = (CHOSEN,) * against + (PAST,) * past + (SELF,) * (races - against - past)
    whose = np.full((races, config.cars), LEARNER)
    paces = np.ones(races)
    paces[against : against + past] = np.linspace(config.slowest, 1.0, past)
    turn = 0
    for n, kind in enumerate(kinds):
        for m in range(config.cars):
            if kind == SELF or m == n % config.cars:
                continue
            whose[n, m] = POOL if kind == PAST else 2 + turn % chosen
            turn += kind == CHOSEN
    return Dealt(kinds, whose, paces)


class OpponentWorld:
    """The learner's cars of N races, as R worlds of one agent.

    Args:
        inner: The races, made with `own_actions`.
        learner: What the learner sees and can be told; its policy is never asked.
        dealt: Who drives what.
        chosen: The chosen models.
    """

    def __init__(self, inner: RaceWorld, learner: Driver, dealt: Dealt, chosen: Sequence[Driver]) -> None:
        self.inner, self.dealt, self._mine = inner, dealt, dealt.mine
        self._learner, self._chosen = learner, tuple(chosen)
        self._own = LearnerRows(self._mine)
        self._spec = replace(inner.spec, num_worlds=len(self._own), num_agents=1, actions=learner.actions.spec)
        self._buffers = allocate(inner.spec)
        self._actions = np.zeros((*self._mine.shape, 2))
        self._past: PastSelf | None = None
        self._seats = self._seated()

    def meet(self, past: PastSelf) -> None:
        """Let somebody drive the cars of past selves from now on."""
        self._past = past
        self._seats = self._seated()

    @property
    def courses(self) -> tuple[RaceWorld]:
        """The races themselves."""
        return (self.inner,)

    @property
    def spec(self) -> WorldSpec:
        """R rows of one agent."""
        return self._spec

    @property
    def track(self) -> Track:
        """The circuit, in driving direction."""
        return self.inner.track

    @property
    def track_lengths(self) -> Array:
        """Length of each row's centre line, m (R,)."""
        return np.full(self._spec.num_worlds, self.inner.track.length)

    @property
    def reports(self) -> Array:
        """What was written down of the learner's cars in the tick just taken, TICK_REPORT (R, 1); a copy."""
        return self.inner.reports[self._mine][:, None]

    @property
    def variation(self) -> Array | None:
        """What the episodes of the learner's cars have drawn, (R, 1); None: all are alike."""
        return None if self.inner.variation is None else self.inner.variation[self._mine][:, None]

    @property
    def seen_boxes(self) -> Array:
        """Where the objects of each row's race stood, (R, K, 6); a copy."""
        return self.inner.seen_boxes[np.nonzero(self._mine)[0]]

    @property
    def habits(self) -> AwsQuirks:
        """Which of the original's bugs this world has."""
        return self.inner.habits

    @property
    def has_reward(self) -> bool:
        """Whether a reward function is asked."""
        return self.inner.has_reward

    @property
    def episodes_started(self) -> int:
        """Episodes that all cars together have begun since `reset`, less the first of each."""
        return self.inner.episodes_started

    @property
    def next_start_share(self) -> float:
        """As of the races themselves."""
        return self.inner.next_start_share

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every race anew; the seed decides the dice of past selves, too."""
        if self._past is not None:
            self._past.begin(seed + 2)
        self.inner.reset(self._buffers, seed)
        self._seats.reset_state(np.ones_like(self._mine))
        self._show(buffers)

    def begin_episodes(self, buffers: StepBuffers) -> None:
        """Put every car at the start of its episode."""
        self.inner.begin_episodes(self._buffers)
        self._seats.reset_state(np.ones_like(self._mine))
        self._show(buffers)

    def freeze(self, rows: Array) -> None:
        """Carry the learner's cars (bool (R, 1)) off the road until `begin_episodes` or `reset`."""
        parked = np.zeros_like(self._mine)
        parked[self._mine] = rows[:, 0]
        self.inner.freeze(parked)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Advance every race by one tick: the learner's cars as told, everybody else's as they choose.

        Raises:
            ContractError: `actions` are no choices of the learner's.
            RewardError: The user's reward function failed.
        """
        if isinstance(self._learner.actions, ActionTable):
            self._actions[self._mine, 0] = np.asarray(actions).reshape(-1)
        else:
            self._actions[self._mine] = np.asarray(actions).reshape(-1, 2)
        self._seats.choose(self._buffers.observations, self._actions)
        self.inner.step(self._actions, self._buffers)
        self._seats.reset_state(self._buffers.ended)
        self._own.hand_on(self._buffers, buffers)
        self._show(buffers)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the finished episodes of the learner's cars; the agent is always 0, the world the row."""
        return self._own.episodes(self.inner.pop_episodes())

    def save_state(self) -> dict[str, Array]:
        """Return the races and what the chosen models' own LiDARs read; past selves keep their own state."""
        return {**self.inner.save_state(), **self._seats.save_state()}

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state."""
        self.inner.load_state(state, self._buffers)
        self._seats.load_state(state)
        self._seats.reset_state(np.ones_like(self._mine))
        self._show(buffers)

    def close(self) -> None:
        """Nothing is held open."""

    def _seated(self) -> Seats:
        past = replace(self._learner, name="a past self", policy=self._past or _Nobody())
        whose = self.dealt.whose - 1  # the learner's own cars are nobody's here
        assert NOBODY == LEARNER - 1
        if self._past is None:
            whose = np.where(whose == POOL - 1, NOBODY, whose)
        seats = Seats(self.inner, self._learner, (past, *self._chosen), whose)
        gains = self.inner.profiles["speed_gain"]
        own = PROFILES[self._learner.car].speed_gain * self.dealt.paces[:, None]
        gains[:] = np.where(self.dealt.whose == POOL, own, gains)
        return seats

    def _show(self, buffers: StepBuffers) -> None:
        self._own.show(self._buffers, buffers)


def own_actions(learner: ActionSpace, chosen: Sequence[Driver], dealt: Dealt) -> OwnActions:
    """Return the actions of all cars: the learner's and its past selves' are the same."""
    return OwnActions((learner, learner, *(driver.actions for driver in chosen)), dealt.whose)


class _Nobody:
    """Drives no car."""

    def act(self, observations: Mapping[str, Array], action_mask: Any = None) -> Array:
        raise AssertionError("cars of past selves need a driver: meet(past)")

    def reset_state(self, rows: Array) -> None:
        """Nothing is known."""
