"""Cars on several courses as one `World`: some on one track, some on another, some the other way round.

What it is       RaceWorlds of the same car, one beside the other; a training's workers with a run.env each
Acts, sees       as they do: each world of theirs is a world here, in their order
Exactness        each course drives as it would alone with a seed of its own; the first with the seed that is given
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from racecraft.contract.errors import ContractError
from racecraft.contract.world import Array, ArraySpec, EpisodeRecord, StepBuffers, WorldSpec
from racecraft.worlds.deepracer.env.alternating import AlternatingWorld
from racecraft.worlds.deepracer.env.fidelity import AwsQuirks
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME, with_objects_in_critic
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.track import Track

SEED_STEP = 7_919
"""Seeds of neighbouring courses lie so far apart; a collector's own steps are multiples of a million and three."""


class MultiCourseWorld:
    """Several RaceWorlds as one.

    Args:
        courses: One for each course, with the same car and camera.
        has_objects: Whether a critic is told of objects even where none of these courses has any: others, elsewhere,
            do.

    Raises:
        ContractError: They differ in what a car sees or can be told.
    """

    def __init__(self, courses: Sequence[RaceWorld | AlternatingWorld], has_objects: bool = False) -> None:
        self.courses = tuple(courses)
        first = max((course.spec for course in self.courses), key=_critic_numbers)
        if has_objects:
            first = with_objects_in_critic(first)
        for other in (course.spec for course in self.courses):
            if _seen(other) != _seen(first) or other.actions != first.actions:
                raise ContractError(
                    "{name} shows or is told something else than {name_2}", name=other.name, name_2=first.name
                )
        counts = [course.spec.num_worlds for course in self.courses]
        ends = np.cumsum(counts).tolist()
        self._rows = [slice(end - count, end) for end, count in zip(ends, counts, strict=True)]
        self._resting = [False] * len(self.courses)
        names = " and ".join(dict.fromkeys(course.track.name for course in self.courses))
        self._spec = replace(first, name=f"DeepRacer {names}", num_worlds=ends[-1])

    @property
    def spec(self) -> WorldSpec:
        """The shape of this world's promise."""
        return self._spec

    @property
    def track(self) -> Track:
        """The first course's circuit, in driving direction."""
        return self.courses[0].track

    @property
    def track_lengths(self) -> Array:
        """Length of each world's centre line, m (N,)."""
        return np.concatenate([course.track_lengths for course in self.courses])

    @property
    def reports(self) -> Array:
        """What was written down of every car in the tick just taken, TICK_REPORT (N, M); a copy."""
        return np.concatenate([course.reports for course in self.courses])

    @property
    def variation(self) -> Array | None:
        """What the episodes have drawn that the reports are of, (N, M); None where all are alike on every course.

        On a course without variation every number is 0; one with fewer objects names none of the others'.
        """
        variations = [course.variation for course in self.courses]
        dtypes = [one.dtype for one in variations if one is not None]
        if not dtypes:
            return None
        whole = np.zeros(
            (self._spec.num_worlds, self._spec.num_agents), max(dtypes, key=lambda one: len(one.names or ()))
        )
        for rows, one in zip(self._rows, variations, strict=True):
            if one is not None:
                for name in one.dtype.names or ():
                    whole[name][rows] = one[name]
        return whole

    @property
    def habits(self) -> AwsQuirks:
        """Which of the original's bugs these worlds have."""
        return self.courses[0].habits

    @property
    def has_reward(self) -> bool:
        """Whether a reward function is asked on each course."""
        return all(course.has_reward for course in self.courses)

    @property
    def start_shares(self) -> Array:
        """Where each world's first car first starts, share of the lap (N,)."""
        return np.concatenate([course.start_shares for course in self.courses])

    @property
    def episodes_started(self) -> int:
        """Episodes that all cars together have begun since `reset`, less the first of each."""
        return sum(course.episodes_started for course in self.courses)

    @property
    def next_start_share(self) -> float:
        """Where the next episode of the first course would start, share of the lap."""
        return self.courses[0].next_start_share

    def move_starts(self, start_shares: Sequence[float] | Array) -> None:
        """Let the next `reset` line the cars up elsewhere: shares of the lap, (N,)."""
        shares = np.asarray(start_shares, float)
        for course, rows in zip(self.courses, self._rows, strict=True):
            course.move_starts(shares[rows])

    def rest(self, rows: Array) -> None:
        """Leave out every course whose cars (bool (N, M)) are all among these, until `reset`: it stands as it stood."""
        self._resting = [bool(rows[own].all()) for own in self._rows]

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Line every car up at its first start."""
        self._resting = [False] * len(self.courses)
        for number, (course, _, own) in enumerate(self._with_buffers(buffers)):
            course.reset(own, seed + number * SEED_STEP)

    def begin_episodes(self, buffers: StepBuffers) -> None:
        """Put every car at the start of its episode; one that was under way is driven again from its start."""
        for course, _, own in self._with_buffers(buffers):
            course.begin_episodes(own)

    def freeze(self, rows: Array) -> None:
        """Let cars (bool (N, M)) stand where they are until `begin_episodes` or `reset`."""
        for course, own in zip(self.courses, self._rows, strict=True):
            course.freeze(rows[own])

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Advance every car by one tick.

        Raises:
            ContractError: `actions` are not one action for every car.
            RewardError: The user's reward function failed; the courses behind have then not moved.
        """
        if len(actions) != self._spec.num_worlds:
            raise ContractError(
                "{name}: {count} actions for {num_worlds} worlds",
                name=self._spec.name,
                count=len(actions),
                num_worlds=self._spec.num_worlds,
            )
        for resting, (course, rows, own) in zip(self._resting, self._with_buffers(buffers), strict=True):
            if resting:
                own.reward[:], own.terminated[:], own.truncated[:] = 0.0, False, False
            else:
                course.step(actions[rows], own)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, course by course, oldest first."""
        return [
            replace(record, world=record.world + rows.start)
            for course, rows in zip(self.courses, self._rows, strict=True)
            for record in course.pop_episodes()
        ]

    def save_state(self) -> dict[str, Array]:
        """Return every course's state, "2/car.x" for the third's."""
        return {
            f"{number}/{name}": part
            for number, course in enumerate(self.courses)
            for name, part in course.save_state().items()
        }

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state."""
        for number, (course, _, own) in enumerate(self._with_buffers(buffers)):
            head = f"{number}/"
            course.load_state({name[len(head) :]: part for name, part in state.items() if name.startswith(head)}, own)

    def close(self) -> None:
        """Nothing is held open."""

    def _with_buffers(self, buffers: StepBuffers) -> Iterator[tuple[RaceWorld | AlternatingWorld, slice, StepBuffers]]:
        """Yield each course with its rows and with its own part of the buffers, and take over what it wrote.

        Parts are views, but where a critic is told of objects on other courses only: there the numbers behind stay 0.
        """
        for course, rows in zip(self.courses, self._rows, strict=True):
            numbers = _critic_numbers(course.spec)
            is_narrow = numbers != _critic_numbers(self._spec)
            own = StepBuffers(
                {name: part[rows] for name, part in buffers.observations.items()},
                {name: part[rows] for name, part in buffers.final_observations.items()},
                buffers.reward[rows],
                buffers.terminated[rows],
                buffers.truncated[rows],
                buffers.active[rows],
            )
            views = [(own.observations, buffers.observations), (own.final_observations, buffers.final_observations)]
            for part, _ in views if is_narrow else ():
                part[CRITIC_NAME] = np.ascontiguousarray(part[CRITIC_NAME][..., :numbers])
            yield course, rows, own
            for part, whole in views if is_narrow else ():
                whole[CRITIC_NAME][rows, ..., :numbers] = part[CRITIC_NAME]


def _critic_numbers(spec: WorldSpec) -> int:
    return int(spec.observations[CRITIC_NAME].shape[0])


def _seen(spec: WorldSpec) -> dict[str, ArraySpec]:
    """Return what a policy sees."""
    return {name: part for name, part in spec.observations.items() if name != CRITIC_NAME}
