"""Trains in a kind of world that needs no more than itself: judged by the mean return of whole episodes.

`PlainTraining` is what such a kind names as `WorldKind.training`; examples/fifth_world shows one.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.registry import Algorithm, find_algorithm
from racecraft.contract.world import World
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.settings import RolloutConfig
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import apply_overrides, from_dictionary
from racecraft.training.loop import Outcome
from racecraft.training.request import DEFAULT_ALGORITHM, TrainRequest
from racecraft.training.resume import MessageCallback, open_to_resume
from racecraft.training.return_evaluator import ReturnEvaluator
from racecraft.training.settings import EvaluationConfig, RuntimeConfig, composed
from racecraft.training.stopping import SCORE, StopCondition, parse_stops
from racecraft.training.trainer import Experiment, summary_of

SMALL_WORLDS = Settings(
    rollout=RolloutConfig(num_worlds=8, horizon=32),
    network=NetworkConfig(hidden_units=(64, 64), activation="tanh"),
    evaluation=EvaluationConfig(every=8, episodes=20, stable_after=1),
    runtime=RuntimeConfig(threads=1),
)
"""Settings that serve small worlds of vectors. One thread: networks this small only wait for a second one."""


@dataclass(frozen=True)
class Plan:
    """A request made definite."""

    request: Any
    algorithm: Algorithm
    settings: Settings
    stops: tuple[StopCondition, ...]
    seed: int
    notes: tuple[str, ...] = ()


class PlainTraining:
    """A kind's training, as `training.worlds.WorldTraining` asks for it.

    Args:
        request: The kind's request; the fields that it adds to `TrainRequest` are kept in job.json, as plain values.
        make_world: Function (request, num_worlds) -> World that is learned, or judged, in.
        threshold: Mean return of an episode that counts as solved, where training ends; None: none does.
        settings: Groups of the world and of the loop.
    """

    def __init__(
        self,
        request: type[TrainRequest],
        make_world: Callable[[Any, int], World],
        threshold: float | None = None,
        settings: Settings = SMALL_WORLDS,
    ) -> None:
        self.Request = request
        self._make_world, self._threshold, self._settings = make_world, threshold, settings
        self._own = [field.name for field in fields(request) if field not in fields(TrainRequest)]

    def default_settings(self, algorithm: Algorithm) -> Settings:
        """Return what a training runs with where nothing is set."""
        return composed(self._settings, algorithm)

    def plan(self, request: Any) -> Plan:
        """Read and check what is asked.

        Raises:
            UserInputError: A setting or a stop that is not legal.
        """
        algorithm = find_algorithm(request.algorithm or DEFAULT_ALGORITHM)
        settings = apply_overrides(self.default_settings(algorithm), request.overrides)
        solved = () if self._threshold is None else (f"score={self._threshold:g}",)
        stops = parse_stops(request.stops or (*solved, "minutes=30"), SCORE)
        return Plan(request, algorithm, settings, stops, 1 if request.seed is None else request.seed)

    def plan_resume(self, path: Path, stops: tuple[str, ...] = ()) -> Plan:
        """Read from a run folder what it was asked for; `stops` replaces its own unless empty.

        Raises:
            RunFolderError: No run of this kind.
        """
        _, job, notes = open_to_resume(path, self.Request.kind)
        asked, algorithm = job["asked"], find_algorithm(job["algorithm"])
        request = self.Request(**self._own_of(asked), run=path, seed=job["seed"], algorithm=algorithm.name)
        settings = from_dictionary(self.default_settings(algorithm), job["settings"])
        return Plan(request, algorithm, settings, parse_stops(stops or asked["stops"], SCORE), job["seed"], notes)

    @contextlib.contextmanager
    def build_experiment(self, plan: Plan, on_message: MessageCallback) -> Iterator[Experiment]:
        """Open the worlds that are learned and judged in."""
        settings, kind = plan.settings, self.Request.kind
        own = self._own_of(vars(plan.request))
        world = self._make_world(plan.request, settings.rollout.num_worlds)
        with contextlib.closing(world), contextlib.closing(self._make_world(plan.request, 1)) as judged:
            yield Experiment(
                kind=kind,
                world=world,
                algorithm=plan.algorithm,
                settings=settings,
                seed=plan.seed,
                stops=plan.stops,
                evaluator=lambda learner, _: ReturnEvaluator(
                    judged, judged, GreedyPolicy(learner), settings.evaluation.episodes, self._threshold
                ),
                request=own,
                metadata=own,
                title=world.spec.name,
                folder_name=kind,
                notes=plan.notes,
            )

    def summary(self, plan: Plan, run: RunFolder, outcome: Outcome) -> dict[str, Any]:
        """Return the figures that `--json` prints."""
        return summary_of(outcome, run, plan.seed)

    @contextlib.contextmanager
    def judging_world(self, run: RunFolder, num_worlds: int) -> Iterator[World]:
        """Open the worlds of a run to judge in them, for `WorldKind.judging_world`."""
        request = self.Request(**self._own_of(run.read_job()["asked"]))
        with contextlib.closing(self._make_world(request, num_worlds)) as world:
            yield world

    def _own_of(self, words: Any) -> dict[str, Any]:
        return {name: words[name] for name in self._own}
