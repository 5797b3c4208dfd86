"""Several behaviors of one scene as one World: their agents' rows one after the other, behavior by behavior.

Begin at `JointSeats`, which does for all of them what `Seats` does for one. A row shows every sensor of every behavior,
named `Striker/sight`; those of other behaviors are zeros. Behaviors are the contract's agent groups: whose row it is,
is told by the observation `POLICY_ID`, an action stands in the first numbers of its row, a mask in its first columns.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from racecraft.contract.world import (
    POLICY_ID,
    AgentGroup,
    Array,
    ArraySpec,
    EpisodeRecord,
    GroupedActions,
    SingleActions,
    StepBuffers,
    WorldSpec,
    mask_width,
)
from racecraft.worlds.unity.env.behaviors import Behavior
from racecraft.worlds.unity.env.rows import Seats
from racecraft.worlds.unity.env.session import Choice, Moment


def joint_spec(parts: Mapping[str, WorldSpec], name: str) -> WorldSpec:
    """Return the promise of several behaviors together.

    Args:
        parts: What each behavior alone promises, worlds of one agent, by its name without the team.
        name: Of the world.
    """
    observations = {POLICY_ID: ArraySpec((), np.int64, 0, len(parts) - 1, doc="number of the row's behavior")}
    for base, spec in parts.items():
        observations |= {f"{base}/{sensor}": part for sensor, part in spec.observations.items()}
    return WorldSpec(
        name,
        num_worlds=sum(spec.num_worlds for spec in parts.values()),
        num_agents=1,
        observations=observations,
        actions=GroupedActions(max((1, *(width for spec in parts.values() for width in spec.actions.shape)))),
        has_action_mask=any(spec.has_action_mask for spec in parts.values()),
        groups={
            base: AgentGroup(spec.observations, _single(spec), spec.has_action_mask) for base, spec in parts.items()
        },
    )


class JointSeats:
    """The rows of several behaviors.

    Args:
        parts: What each behavior alone promises, by its name without the team.
        seats: Their rows, in the same order.
    """

    def __init__(self, parts: Mapping[str, WorldSpec], seats: Sequence[Seats]) -> None:
        starts = np.cumsum([0, *(spec.num_worlds for spec in parts.values())])
        self.rows_of = {
            base: slice(int(start), int(end)) for base, start, end in zip(parts, starts[:-1], starts[1:], strict=True)
        }
        """Which rows are whose."""
        self._parts, self._seats = dict(parts), list(seats)
        self._acted = {name for some in seats for name in some.names}

    def clear(self) -> None:
        """Begin with empty rows."""
        for seats in self._seats:
            seats.clear()

    def begin_step(self) -> None:
        """Nobody is active until it asks."""
        for seats in self._seats:
            seats.begin_step()

    def choices(self, process: int, actions: Array) -> dict[str, Choice]:
        """Return what a process's agents are told, by behavior; `actions` is (rows, 1, widest)."""
        choices: dict[str, Choice] = {}
        for (base, spec), seats in zip(self._parts.items(), self._seats, strict=True):
            mine = actions[self.rows_of[base]]
            shape = spec.actions.shape
            mine = mine[..., : shape[0]] if shape else mine[..., 0].astype(spec.actions.dtype)
            chosen = seats.choices(process, mine)
            choices |= {
                name: choice for name, choice in chosen.items() if name in seats.names or name not in self._acted
            }
        return choices

    def idle_choices(self, process: int) -> dict[str, Choice]:
        """Return what agents are told that nobody acts for, while none of the others asks."""
        choices: dict[str, Choice] = {}
        for seats in self._seats:
            idle = seats.idle_choices(process)
            choices |= {name: choice for name, choice in idle.items() if name not in self._acted}
        return choices

    def has_decisions(self, process: int) -> bool:
        """Tell whether an agent of the process waits for an action."""
        return any(seats.has_decisions(process) for seats in self._seats)

    def fill_rows(
        self,
        process: int,
        moments: Mapping[str, Moment],
        behaviors: Mapping[str, Behavior],
        buffers: StepBuffers | None,
    ) -> None:
        """Sort one process's news into rows."""
        for base, seats in zip(self._parts, self._seats, strict=True):
            seats.fill_rows(process, moments, behaviors, None if buffers is None else self._view(base, buffers))

    def truncate_all(self, process: int, buffers: StepBuffers) -> None:
        """Cut every episode of a process that was lost."""
        for base, seats in zip(self._parts, self._seats, strict=True):
            seats.truncate_all(process, self._view(base, buffers))

    def show(self, buffers: StepBuffers) -> None:
        """Write what every row sees."""
        for number, (base, seats) in enumerate(zip(self._parts, self._seats, strict=True)):
            seats.show(self._view(base, buffers))
            for named in (buffers.observations, buffers.final_observations):
                named[POLICY_ID][self.rows_of[base]] = number

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, behavior by behavior."""
        return [
            replace(record, world=record.world + self.rows_of[base].start)
            for base, seats in zip(self._parts, self._seats, strict=True)
            for record in seats.pop_episodes()
        ]

    def _view(self, base: str, buffers: StepBuffers) -> StepBuffers:
        """Return one behavior's part of the buffers, under its own names; views."""
        rows, spec = self.rows_of[base], self._parts[base]
        mask = None
        if spec.has_action_mask and buffers.action_mask is not None:
            mask = buffers.action_mask[rows][..., : mask_width(spec)]

        def named(arrays: Mapping[str, Array]) -> dict[str, Array]:
            return {sensor: arrays[f"{base}/{sensor}"][rows] for sensor in spec.observations}

        return StepBuffers(
            observations=named(buffers.observations),
            final_observations=named(buffers.final_observations),
            reward=buffers.reward[rows],
            terminated=buffers.terminated[rows],
            truncated=buffers.truncated[rows],
            active=buffers.active[rows],
            action_mask=mask,
        )


def _single(spec: WorldSpec) -> SingleActions:
    assert not isinstance(spec.actions, GroupedActions), "a behavior has actions of one kind"
    return spec.actions
