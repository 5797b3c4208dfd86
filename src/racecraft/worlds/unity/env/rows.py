"""Who sits in which row of a World: agents come and go with ids of their own, rows stay.

Begin at `Seats`. A row is given to an agent when it first asks for a decision and is free again when its episode ends;
an agent whose id comes back gets the row it had. What an agent saw last is kept, because a world writes every row at
every step, also those without news.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, WorldSpec
from racecraft.worlds.unity.env.actions import ActionTable
from racecraft.worlds.unity.env.behaviors import AgentRows, Behavior, Sensor, first_allowed
from racecraft.worlds.unity.env.errors import UnityError, WireError
from racecraft.worlds.unity.env.session import Choice, Moment


@dataclass
class ProcessAgents:
    """The agents of one process."""

    free: list[int]
    """Rows that nobody has, in order."""
    row_of: dict[tuple[str, int], int] = field(default_factory=dict)
    """Row by behavior and agent id."""
    last_row_of: dict[tuple[str, int], int] = field(default_factory=dict)
    waiting: dict[str, list[int]] = field(default_factory=dict)
    """Rows that wait for an action, by behavior, in the order in which they asked."""
    idle: dict[str, Choice] = field(default_factory=dict)
    """What agents of other behaviors are told."""


class Seats:
    """Rows of all processes, row after row: process 0's first.

    Args:
        spec: The world's promise; its N * M rows are shared evenly by the processes.
        sensors: What every agent sees.
        table: How actions are translated.
        names: The behaviors acted for.
        processes: How many.
    """

    def __init__(
        self, spec: WorldSpec, sensors: Sequence[Sensor], table: ActionTable, names: Sequence[str], processes: int
    ) -> None:
        self._spec, self._sensors, self._table, self.names = spec, sensors, table, names
        self._rows = spec.num_worlds * spec.num_agents
        self._rows_each = self._rows // processes
        self._processes = processes
        self._episodes: list[EpisodeRecord] = []
        self.clear()

    def clear(self) -> None:
        """Begin with empty rows."""
        rows = self._rows
        self._latest = {sensor.name: np.zeros((rows, *sensor.shape), sensor.dtype) for sensor in self._sensors}
        self._allowed = np.ones((rows, sum(self._table.actions.branches)), bool)
        self._active = np.zeros(rows, bool)
        self._steps = np.zeros(rows, np.int64)
        self._returns = np.zeros(rows, np.float64)
        self._guests = [self._nobody(process) for process in range(self._processes)]
        self._episodes.clear()

    def begin_step(self) -> None:
        """Nobody is active until it asks."""
        self._active[:] = False

    def choices(self, process: int, actions: Array) -> dict[str, Choice]:
        """Return what a process's agents are told.

        Args:
            process: Whose agents.
            actions: (N, M, *action shape), of the contract.
        """
        guests = self._guests[process]
        acted = np.asarray(actions, self._spec.actions.dtype).reshape(self._rows, *self._spec.actions.shape)
        choices = dict(guests.idle)
        for name, rows in guests.waiting.items():
            if rows:
                choices[name] = self._table.choice(acted[rows])
                self._steps[rows] += 1
        return choices

    def idle_choices(self, process: int) -> dict[str, Choice]:
        """Return what the agents are told while none of those acted for asks."""
        return dict(self._guests[process].idle)

    def has_decisions(self, process: int) -> bool:
        """Tell whether an agent of the process waits for an action."""
        return any(self._guests[process].waiting.values())

    def fill_rows(
        self,
        process: int,
        moments: Mapping[str, Moment],
        behaviors: Mapping[str, Behavior],
        buffers: StepBuffers | None,
    ) -> None:
        """Sort one process's news into rows; without buffers (after a reset) rewards and ends are nobody's."""
        guests = self._guests[process]
        for name in self.names:
            if name not in moments:
                raise WireError("the player no longer has the behavior '{name}' that it began with.", name=name)
            if buffers is not None:
                self._settle_ends(guests, name, moments[name].ended, buffers)
        for name in self.names:
            self._settle_decisions(guests, name, moments[name].decisions, buffers)
        guests.idle = {
            name: _idle_choice(behaviors[name], moment.decisions)
            for name, moment in moments.items()
            if name not in self.names and len(moment.decisions)
        }

    def truncate_all(self, process: int, buffers: StepBuffers) -> None:
        """Cut every episode of a process that was lost."""
        for row in self._guests[process].row_of.values():
            self._end_row(row, buffers, cut=True)
        self._guests[process] = self._nobody(process)

    def show(self, buffers: StepBuffers) -> None:
        """Write what every row sees; a row without news shows what it saw last."""
        shape = (self._spec.num_worlds, self._spec.num_agents)
        for name, values in self._latest.items():
            buffers.observations[name][:] = values.reshape(*shape, *values.shape[1:])
        buffers.active[:] = self._active.reshape(shape)
        if buffers.action_mask is not None:
            buffers.action_mask[:] = self._allowed.reshape(*shape, -1)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, oldest first."""
        taken, self._episodes = self._episodes, []
        return taken

    def _nobody(self, process: int) -> ProcessAgents:
        first = process * self._rows_each
        return ProcessAgents(list(range(first, first + self._rows_each)))

    def _settle_ends(self, guests: ProcessAgents, name: str, ended: AgentRows, buffers: StepBuffers) -> None:
        for index, agent in enumerate(ended.agent_id.tolist()):
            row = guests.row_of.pop((name, agent), None)
            if row is None:
                continue  # it ended before it ever asked
            for sensor, values in zip(self._sensors, ended.observations, strict=True):
                self._latest[sensor.name][row] = values[index]
            self._pay(row, ended, index, buffers)
            self._end_row(row, buffers, cut=bool(ended.interrupted[index]))
            guests.free.append(row)
            guests.last_row_of[name, agent] = row
        guests.free.sort()

    def _settle_decisions(
        self, guests: ProcessAgents, name: str, asking: AgentRows, buffers: StepBuffers | None
    ) -> None:
        rows = []
        for index, agent in enumerate(asking.agent_id.tolist()):
            row = guests.row_of.get((name, agent))
            if row is None:
                row = guests.row_of[name, agent] = self._free_row(guests, name, agent)
            elif buffers is not None:
                self._pay(row, asking, index, buffers)
            rows.append(row)
        guests.waiting[name] = rows
        if not rows:
            return
        if len(set(rows)) != len(rows):
            raise WireError("an agent of '{name}' stands twice in one message; expected each once.", name=name)
        for sensor, values in zip(self._sensors, asking.observations, strict=True):
            self._latest[sensor.name][rows] = values
        if asking.allowed is not None:
            self._allowed[rows] = asking.allowed
        self._active[rows] = True

    def _free_row(self, guests: ProcessAgents, name: str, agent: int) -> int:
        """Return the row that the agent had before, or the first free one."""
        if not guests.free:
            raise UnityError(
                "agent {agent} of '{name}' asks for a decision, but all {rows_each} rows kept for a player are "
                "taken. Give max_agents= (--max-agents at the command line) the largest number that live at once.",
                agent=agent,
                name=name,
                rows_each=self._rows_each,
            )
        before = guests.last_row_of.pop((name, agent), None)
        row = before if before in guests.free else guests.free[0]
        guests.free.remove(row)
        return row

    def _pay(self, row: int, agents: AgentRows, index: int, buffers: StepBuffers) -> None:
        reward = float(agents.reward[index] + agents.group_reward[index])
        buffers.reward[self._at(row)] += reward
        self._returns[row] += reward

    def _end_row(self, row: int, buffers: StepBuffers, cut: bool) -> None:
        at = self._at(row)
        (buffers.truncated if cut else buffers.terminated)[at] = True
        for sensor in self._sensors:
            buffers.final_observations[sensor.name][at] = self._latest[sensor.name][row]
        status = "truncated" if cut else "terminated"
        self._episodes.append(EpisodeRecord(*at, int(self._steps[row]), float(self._returns[row]), status))
        self._steps[row], self._returns[row] = 0, 0.0
        self._allowed[row] = True

    def _at(self, row: int) -> tuple[int, int]:
        return divmod(row, self._spec.num_agents)


def _idle_choice(behavior: Behavior, asking: AgentRows) -> Choice:
    """Zero actions; where zero is forbidden, the first that is allowed."""
    actions = behavior.actions
    continuous = np.zeros((len(asking), actions.continuous), np.float32) if actions.continuous else None
    return Choice(continuous, first_allowed(behavior, asking) if actions.branches else None)
