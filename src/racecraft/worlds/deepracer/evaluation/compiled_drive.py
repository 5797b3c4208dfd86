"""Whole drives in compiled code, for policies and worlds that are plain enough. Begin with `compiled_drive`.

A tick of an evaluation is five small frames. What draws them and what looks at them takes a tenth of a millisecond;
to ask the one and the other from Python, tick by tick, with threads that wait for each other in between, took twice as
long again. Here each car drives through by itself, and threads share out cars.

The cars go where they go tick by tick, but for this: sums are added up in another order than PyTorch's, so two choices
that are equally likely to seven digits may fall otherwise, as they may in PyTorch with other rows beside them.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from racecraft.algorithms.compiled_policy import CompiledPolicy
from racecraft.algorithms.learner import Compilable
from racecraft.contract.policy import Policy
from racecraft.contract.world import EpisodeRecord, World, allocate
from racecraft.kernels import threads
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.kernels.greedy_drive import drive_on

TICKS_AT_ONCE = 1000
"""So many, and Python is come back to, where Ctrl-C is heard."""


class CompiledDrive:
    """A policy that drives the only car of each world by itself, as it stands now.

    Args:
        look: How it looks and chooses.
        world: N worlds of one car.
        actions: What that car chooses from.
    """

    def __init__(self, look: CompiledPolicy, world: RaceWorld, actions: ActionTable) -> None:
        self._world, self._buffers = world, allocate(world.spec)
        count, choices = world.spec.num_worlds, np.arange(len(actions.steering))
        menu = world.as_reported(actions.commands(choices[:, None]))
        buffers = np.zeros((count, 3, look.buffer_size), np.float32)
        self._driver = (look.layers, look.weights, look.scale, buffers, menu.numbers, menu.chosen, menu.sent)
        self._told = actions.commands(np.zeros((count, 1), np.int64))

    def compile(self) -> None:
        """Compile what drives, or fetch it from the disk; no car moves."""
        self._world.reset(self._buffers, 0)
        drive_on(0, 0, *self._driver, *self._world.of_a_tick(self._told, self._buffers))

    def episodes(self, seed: int) -> list[EpisodeRecord]:
        """Drive one episode in every world, as many at once as there are threads; return what each came to."""
        tick = self._begin(seed)

        def to_its_end(n: int) -> EpisodeRecord:
            while True:
                self._drive(n, tick)
                if self._has_ended(n):
                    return self._world.record(n, 0)

        with ThreadPoolExecutor(threads()) as pool:
            return list(pool.map(to_its_end, range(self._world.spec.num_worlds)))

    def episode(self, seed: int, on_tick: Callable[[RaceWorld], None]) -> None:
        """Drive one episode of the only world; `on_tick` looks at it after each full lap and at its end."""
        tick = self._begin(seed)
        while True:
            self._drive(0, tick)
            on_tick(self._world)
            if self._has_ended(0):
                return

    def _begin(self, seed: int) -> tuple[Any, ...]:
        """Line up, and return what a tick takes."""
        self._world.reset(self._buffers, seed)
        return self._world.of_a_tick(self._told, self._buffers)

    def _drive(self, n: int, tick: tuple[Any, ...]) -> None:
        """Let a car drive until it has something to tell."""
        while not drive_on(n, TICKS_AT_ONCE, *self._driver, *tick):
            continue

    def _has_ended(self, n: int) -> bool:
        report = self._world.reports[n, 0]
        return bool(report["terminated"] or report["truncated"])


def compiled_drive(policy: Policy, world: World) -> CompiledDrive | None:
    """Return a policy's drive in a world, with its weights as they are now; None: it has to be asked tick by tick."""
    if not (isinstance(world, RaceWorld) and isinstance(policy, Compilable) and world.is_compiled_tick_enough):
        return None
    if world.spec.num_agents != 1 or not isinstance(world.actions, ActionTable):
        return None
    name = world.sensors.camera_name
    look = policy.compile_policy(name, world.spec.observations[name].shape) if name in world.spec.observations else None
    return None if look is None else CompiledDrive(look, world, world.actions)
