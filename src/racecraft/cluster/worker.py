"""Worlds and an actor in a process of their own. Begin with `Worker.collect`.

A worker opens its share of a training's worlds by the same door as the training itself, builds the same learner for its
decisions, and takes over weights with every task. It knows nothing of how it is reached, and takes no step.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from racecraft.algorithms.building import build_learner
from racecraft.algorithms.learner import ACTING, Decision, Learner, counting
from racecraft.algorithms.weights import to_arrays, to_tensors
from racecraft.cluster.messages import (
    RolloutResult,
    Task,
    WorkerConfig,
    WorkerEnv,
    WorkerError,
    WorkerInit,
    WorkerReady,
)
from racecraft.contract.errors import RacecraftError, UserInputError
from racecraft.contract.world import Array, ArraySpec
from racecraft.rollout.collector import Collector
from racecraft.training.processor import prepare_processor
from racecraft.training.remote_collection import HasRngState
from racecraft.training.trainer import Experiment
from racecraft.training.versions import versions
from racecraft.training.worlds import training_in

Answer = TypeVar("Answer")


class Worker:
    """Carries a share of the worlds.

    Args:
        surroundings: Where the training runs; what is not there on this machine is left out.

    Whatever goes wrong is returned as a `WorkerError`, then and in answer to all that is asked afterwards.
    """

    def __init__(self, surroundings: WorkerEnv) -> None:
        sys.path += [place for place in surroundings.search_path if place not in sys.path and os.path.exists(place)]
        if os.path.isdir(surroundings.folder):
            os.chdir(surroundings.folder)
        self._worlds = contextlib.ExitStack()
        self._trouble: WorkerError | None = None

    def come(self, message: None) -> None:
        """Be there: whoever hears the answer knows that this process runs."""

    def open(self, order: WorkerConfig) -> WorkerReady | WorkerError:
        """Open the worlds of a share."""
        return self._told(lambda: self._open(order))

    def begin(self, start: WorkerInit) -> None | WorkerError:
        """Begin the worlds, or go on where another worker was."""
        return self._told(lambda: self._begin(start))

    def collect(self, task: Task) -> RolloutResult | WorkerError:
        """Take over the weights, carry them through the worlds and say what happened."""
        return self._told(lambda: self._collect(task))

    def close(self) -> None:
        """Close the worlds."""
        self._worlds.close()

    def _told(self, act: Callable[[], Answer]) -> Answer | WorkerError:
        if self._trouble is None:
            try:
                return act()
            except RacecraftError as error:
                self._trouble = WorkerError(str(error), isinstance(error, UserInputError))
        return self._trouble

    def _open(self, order: WorkerConfig) -> WorkerReady:
        self._share = order.share
        opened = training_in(order.kind).build_experiment(order.planned, lambda text: None)
        self._experiment: Experiment = self._worlds.enter_context(opened)
        settings = self._experiment.settings
        prepare_processor(settings.runtime.threads, settings.runtime.device)
        self._experiment.warm_up(lambda text: None)
        return WorkerReady(self._experiment.world.spec, socket.gethostname(), os.getpid(), versions())

    def _begin(self, start: WorkerInit) -> None:
        experiment = self._experiment
        if experiment.learner is not None:
            self._learner = experiment.learner()
        else:
            self._learner = build_learner(experiment.algorithm, start.spec, experiment.settings, experiment.seed)
        self._take_weights(start.weights)
        self._version = start.version
        for name, state in start.parts.items():
            experiment.parts[name].restore(state)
        rows = start.spec.num_worlds * start.spec.num_agents
        actor = LearnerRows(self._learner, start.first_row, rows)
        rollout, seed = experiment.settings.rollout, self._share.seed_of(start.times_begun)
        self._collector = Collector(
            experiment.world, actor, rollout.horizon, seed, longest_horizon=rollout.longest_horizon
        )
        self._recorder = None if experiment.recorder is None else experiment.recorder()
        if self._recorder is not None:
            self._collector.observers.append(self._recorder)
        if start.state is not None:
            self._restore(start.state)

    def _collect(self, task: Task) -> RolloutResult:
        began, worked, before = time.perf_counter(), time.process_time(), self._collector.steps_taken
        self._take_weights(task.weights)
        if task.version > self._version:
            self._experiment.after_update(self._learner)
        self._version = task.version
        if task.explored is not None and (counter := counting(self._learner)) is not None:
            counter.explored = task.explored
        collector = self._collector
        batch = collector.collect() if task.quota is None else collector.collect_episodes(task.quota)
        return RolloutResult(
            batch=batch,
            episodes=collector.pop_episodes(),
            ticks=None if self._recorder is None else self._recorder.pop(task.iteration),
            steps=collector.steps_taken - before,
            state=self._state(),
            seconds=time.perf_counter() - began,
            processor_seconds=time.process_time() - worked,
        )

    def _state(self) -> dict[str, Any]:
        acting = {name: part for name, part in self._learner.state_dict().items() if name in ACTING}
        throwing = {name: part for name, part in self._experiment.parts.items() if isinstance(part, HasRngState)}
        return {
            "collector": self._collector.state(),
            "actor": to_arrays(acting),
            "dice": {name: part.dice() for name, part in throwing.items()},
        }

    def _restore(self, state: Mapping[str, Any]) -> None:
        """Go on where another worker was."""
        network = self._learner.state_dict()["network"]
        self._learner.load_state_dict({"network": network, **to_tensors(dict(state.get("actor", {})))})
        self._collector.restore(state["collector"], anew=self._experiment.world_lasts is False)
        for name, dice in state.get("dice", {}).items():
            part = self._experiment.parts[name]
            assert isinstance(part, HasRngState), f"{name} has no dice"
            part.set_rng_state(dice)

    def _take_weights(self, weights: Mapping[str, Array]) -> None:
        self._learner.load_state_dict({"network": to_tensors(dict(weights))})


class LearnerRows:
    """A learner as the actor of some of its rows: to it they keep the places that they have among all.

    Args:
        learner: Decides.
        first: Which of all rows is the first here.
        rows: How many there are in all.
    """

    def __init__(self, learner: Learner, first: int, rows: int) -> None:
        self._learner, self._first, self._rows = learner, first, rows
        self.device = learner.device

    @property
    def columns(self) -> Mapping[str, ArraySpec]:
        """What `act` notes for each row."""
        return self._learner.columns

    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: Any = None,
        rows: Array | None = None,
    ) -> Decision:
        """Decide for R rows; see `Actor.act`."""
        here = np.arange(len(next(iter(observations.values())))) if rows is None else rows
        return self._learner.act(observations, action_mask, generator=generator, rows=self._first + here)

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        every = np.zeros(self._rows, bool)
        every[self._first : self._first + len(rows)] = rows
        self._learner.reset_state(every)


def spec_of_all(specs: list[Any]) -> Any:
    """Return what the worlds of several workers promise together."""
    return replace(specs[0], num_worlds=sum(spec.num_worlds for spec in specs))
