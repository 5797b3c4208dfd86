"""Worlds and actors meet: carry a learner through many worlds at once and keep what happened. Begin with `Collector`.

A tick, in order: decide, step the worlds (which write straight into the storage), let the observers look, keep the
final observations of episodes cut short, count. No algorithm is known here: what a learner wants to know again of a
decision, it names itself (`Actor.columns`).

The worlds may be carried for a fixed number of ticks (`collect`) or until every agent has played its quota of whole
episodes (`collect_episodes`). A fixed quota for each agent, and not "the first so many that end", because the first to
end are the shortest and would be learned from too often.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
import torch

from racecraft.algorithms.learner import Actor, Decision
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import ContractError
from racecraft.contract.world import Array, EpisodeRecord, RestartsEpisodes, StepBuffers, World
from racecraft.rollout.episodes import StepObserver
from racecraft.rollout.settings import horizon_after
from racecraft.rollout.statistics import EpisodeCounter
from racecraft.rollout.trajectories import Trajectories

FIRST_ROOM = 128
"""Ticks of storage that whole episodes start with; doubled whenever it is full."""


@runtime_checkable
class FreezesAgents(Protocol):
    """A world that can leave agents standing until the next `begin_episodes`."""

    def freeze(self, rows: Array) -> None:
        """Leave these agents (bool (N, M)) standing: nothing is done to them, and nothing comes of their actions."""
        ...


class WorkerLayoutError(ContractError):
    """Worlds were carried by other processes, or by fewer of them, so that they cannot go on where they were."""


class CollectorProtocol(Protocol):
    """What a training asks of whoever collects for it, in this process (`Collector`) or in others."""

    @property
    def steps_taken(self) -> int:
        """Environment steps taken: ticks times worlds times agents, less those of parked agents."""
        ...

    def collect(self) -> RolloutBatch:
        """Carry on for the horizon and return what happened; episodes under way go on in the next call."""
        ...

    def collect_episodes(self, quota: int) -> RolloutBatch:
        """Begin an episode in every world and carry on until each agent has played `quota` whole episodes."""
        ...

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call."""
        ...

    def set_poll_callback(self, look: Callable[[], None]) -> None:
        """Have somebody called every now and then while it collects; what that raises breaks the collecting off."""
        ...

    def state(self) -> dict[str, Any]:
        """Return everything a continuation needs, as named arrays (copies)."""
        ...

    def restore(self, state: Mapping[str, Any], anew: bool = False) -> None:
        """Go on from what `state` gave; with `anew` every episode begins anew, and only counts and chance go on.

        Raises:
            WorkerLayoutError: The worlds were carried by other processes; with `anew` they may have been.
            ContractError: The worlds do not show what they showed; with `anew` they need not.
        """
        ...


class Collector:
    """Carries one actor through the worlds and keeps what happened.

    Args:
        world: N worlds of M agents.
        actor: Decides; usually a learner.
        horizon: Ticks of one `collect`.
        seed: Of the worlds and of exploration.
        observers: Called after each tick; live pictures and logs hang here.
        longest_horizon: To how many the horizon grows, see `horizon_after`; None: it stays.

    The worlds are begun at once. What `collect` returns are views of storage that the next call writes over.
    """

    def __init__(
        self, world: World, actor: Actor, horizon: int, seed: int, observers: Sequence[StepObserver] = (),
        longest_horizon: int | None = None,
    ) -> None:  # fmt: skip
        self.world, self.actor, self.horizon, self.longest_horizon = world, actor, horizon, longest_horizon
        self.observers = list(observers)
        self.buffer = Trajectories(world.spec, horizon, actor.columns)
        self.counter = EpisodeCounter(world)
        self.generator = torch.Generator(actor.device).manual_seed(seed)
        self.ticks_taken = 0
        """Ticks taken since the collector was made or restored to."""
        self._parked_steps = 0
        self._seed, self._resets, self._row = seed, 0, 0
        self._begin_worlds()

    @property
    def steps_taken(self) -> int:
        """Environment steps taken: ticks times worlds times agents, less those of parked agents."""
        return self.ticks_taken * self.world.spec.num_worlds * self.world.spec.num_agents - self._parked_steps

    def collect(self) -> RolloutBatch:
        """Carry on for the horizon and return what happened; episodes under way go on in the next call."""
        buffer, ticks = self.buffer, horizon_after(self.ticks_taken, self.horizon, self.longest_horizon)
        buffer.begin()
        buffer.carry_over(self._row)
        if ticks > buffer.ticks:
            buffer.grow(ticks)
        for t in range(ticks):
            self._tick(t)
        self._row = ticks
        buffer.learn[:] = True
        return buffer.batch(ticks)

    def collect_episodes(self, quota: int) -> RolloutBatch:
        """Begin an episode in every world and carry on until each agent has played `quota` whole episodes.

        A world that `RestartsEpisodes` begins where its next episode would; others are reset.

        A world that `FreezesAgents` lets an agent stand once its quota is full; in others it plays on, and what it
        plays is kept out of learning.
        """
        buffer = self.buffer
        buffer.begin()
        self._begin_episodes()
        parked: Array | None = None
        done = np.zeros((self.world.spec.num_worlds, self.world.spec.num_agents), np.int64)
        t = 0
        while (done < quota).any():
            if t == buffer.ticks:
                buffer.grow(max(FIRST_ROOM, 2 * t))
            buffer.learn[t] = done < quota
            self._tick(t, parked)
            done += buffer.terminated[t] | buffer.truncated[t]
            parked = self._park(done >= quota)
            t += 1
        self._row = t
        return buffer.batch(t)

    def set_poll_callback(self, look: Callable[[], None]) -> None:
        """Have somebody called after every tick; what that raises breaks the collecting off."""
        self.observers.append(lambda world, buffers, actions: look())

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, oldest first."""
        return self.counter.pop()

    def state(self) -> dict[str, Any]:
        """Return everything an exact continuation needs, even in the middle of an episode, as named arrays (copies)."""
        view = self.buffer.views[self._row]
        observations = {name: array.copy() for name, array in view.observations.items()}
        return {
            "world": self.world.save_state(),
            "shown": observations,
            "episodes": self.counter.state(),
            "exploration": {"generator": self.generator.get_state().numpy().copy()},
            "counts": {
                "ticks_taken": np.array(self.ticks_taken),
                "resets": np.array(self._resets),
                "parked_steps": np.array(self._parked_steps),
                "steps_taken": np.array(self.steps_taken),
            },
        }

    def restore(self, state: Mapping[str, Any], anew: bool = False) -> None:
        """Go on from what `state` gave: the same world, actor and horizon are expected.

        With `anew` the world begins every episode anew, with chance of its own each time: for worlds whose inner state
        cannot be kept. Counts and the chance of exploration go on; episodes under way are lost.

        Raises:
            WorkerLayoutError: The state is that of worlds in other processes; `anew` takes its counts.
            ContractError: The world does not show what it showed; with `anew` it need not.
        """
        if not anew and "world" not in state:
            raise WorkerLayoutError("its worlds were carried by workers")
        self._resets = int(state["counts"]["resets"])
        if anew:
            self._begin_worlds()
        else:
            self._restore_world(state)
        self.generator.set_state(torch.from_numpy(np.asarray(state["exploration"]["generator"])))
        self.ticks_taken = int(state["counts"]["ticks_taken"])
        self._parked_steps = int(state["counts"].get("parked_steps", 0))
        if "world" not in state:  # workers need not have as many rows, nor as many ticks each
            self._parked_steps += self.steps_taken - int(state["counts"]["steps_taken"])

    def _restore_world(self, state: Mapping[str, Any]) -> None:
        self._row = 0
        view = self.buffer.views[0]
        self.world.load_state(state["world"], view)
        for name, observations in state["shown"].items():
            if not np.array_equal(view.observations[name], observations, equal_nan=True):
                raise ContractError(
                    "{name}: after load_state the observation '{name_2}' is not what it was at "
                    "save_state; expected the same numbers.",
                    name=self.world.spec.name,
                    name_2=name,
                )
        self.counter.restore(state["episodes"])

    def _begin_worlds(self) -> None:
        """Begin every world anew; each time with chance of its own."""
        self.world.reset(self.buffer.views[0], self._seed + 1_000_003 * self._resets)
        self._resets += 1
        self._row = 0
        self.counter.begin()
        self._forget_all()

    def _begin_episodes(self) -> None:
        """Begin an episode in every world, where the world would begin its next one."""
        if not isinstance(self.world, RestartsEpisodes):
            self._begin_worlds()
            return
        self._row = 0
        self.world.begin_episodes(self.buffer.views[0])
        self.counter.begin()
        self._forget_all()

    def _forget_all(self) -> None:
        self.actor.reset_state(np.ones(self.world.spec.num_worlds * self.world.spec.num_agents, bool))

    def _park(self, full: Array) -> Array | None:
        """Park agents whose quota is full; return them (N, M), None where nobody is parked."""
        if not isinstance(self.world, FreezesAgents) or not full.any():
            return None
        self.world.freeze(full)
        return full

    def _tick(self, t: int, parked: Array | None = None) -> None:
        buffer, now, then = self.buffer, self.buffer.views[t], self.buffer.views[t + 1]
        decision = self._decide(now, parked)
        actions = buffer.actions[t]
        actions[:] = decision.actions.reshape(actions.shape)
        for name, values in decision.columns.items():
            column = buffer.columns[name][t]
            column[:] = values.reshape(column.shape)

        self.world.step(actions, then)
        self.ticks_taken += 1
        for observer in self.observers:
            observer(self.world, then, actions)
        buffer.store_final_observations(t, then)
        self.counter.count(then)
        ended = then.ended
        if ended.any():
            self.actor.reset_state(ended.reshape(-1))

    def _decide(self, now: StepBuffers, parked: Array | None) -> Decision:
        """Decide for every agent; parked ones are not thought about and given zeros."""
        seen, mask = _rows(now.observations), _mask_rows(now)
        if parked is None:
            return self.actor.act(seen, mask, generator=self.generator)
        going = ~parked.reshape(-1)
        self._parked_steps += int(parked.sum())
        seen = {name: array[going] for name, array in seen.items()}
        own = None if mask is None else mask[going]
        decision = self.actor.act(seen, own, generator=self.generator, rows=np.flatnonzero(going))
        columns = {name: _spread(part, going) for name, part in decision.columns.items()}
        return Decision(_spread(decision.actions, going), columns)


def _rows(named: Mapping[str, Array]) -> dict[str, Array]:
    """Return (N, M, ...) arrays as R = N * M rows; views."""
    return {name: array.reshape(-1, *array.shape[2:]) for name, array in named.items()}


def _spread(part: Array, rows: Array) -> Array:
    """Return an array of all rows, with `part` in the chosen ones (bool (R,)) and zeros elsewhere."""
    whole = np.zeros((len(rows), *part.shape[1:]), part.dtype)
    whole[rows] = part
    return whole


def _mask_rows(buffers: StepBuffers) -> Array | None:
    mask = buffers.action_mask
    return None if mask is None else mask.reshape(-1, mask.shape[-1])
