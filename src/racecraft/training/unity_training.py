"""Train on a Unity scene, on the same loop as the cars. Begin with `train_unity`.

    plan → players that teach, one that judges → settings, the scene heard → the common run-up → what came of it

The agents of a behavior learn side by side in one player (or several). `unity_plan.py` reads what was asked,
`unity_judges.py` says how good a policy is, `run_up.py` carries it out.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.algorithms.ppo import PpoLearner
from racecraft.envs.unity.behaviors import card_of
from racecraft.envs.unity.wire import EDITOR_PORT
from racecraft.envs.unity.world import UnityWorld
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy
from racecraft.training.events import Listener
from racecraft.training.loop import Judge, Outcome
from racecraft.training.restoring import Say
from racecraft.training.run_up import Course, resume, summary_of, train
from racecraft.training.stopping import Stop, parse_stops
from racecraft.training.unity_judges import SceneJudge, TrainingEpisodesJudge
from racecraft.training.unity_plan import (
    KIND,
    TRAINER_FILE,
    UnityPlan,
    UnityRequest,
    plan_resume,
    plan_unity,
    settle,
    stops_for,
)

__all__ = ["TrainedUnity", "UnityRequest", "resume_unity", "train_unity"]

OBSERVATIONS = "observations.safetensors"
"""What the judged policy saw, in the run folder; an export is checked on it."""


@dataclass(frozen=True)
class TrainedUnity:
    """A training that ended, and where it lies."""

    run: RunFolder
    outcome: Outcome
    build: str
    behavior: str
    seed: int
    notes: tuple[str, ...]
    seconds_in_all: float
    """Players' starts included."""

    def summary(self) -> dict[str, Any]:
        """Return the figures of `racecraft unity train --json`."""
        return {
            "build": self.build,
            "behavior": self.behavior,
            **summary_of(self.outcome, self.run, self.seed),
            "seconds_with_start": round(self.seconds_in_all, 3),
            "notes": list(self.notes),
        }


def train_unity(request: UnityRequest, listener: Listener, say: Say = print) -> TrainedUnity:
    """Train until a stop holds.

    Args:
        request: What is trained.
        listener: Watches the training.
        say: Says a line to a person.

    Raises:
        UserInputError: A build, a configuration, a setting or a stop that cannot be used.
        UnityError: A player cannot be brought to talk, or was lost.
    """
    return _carry_out(plan_unity(request), listener, say)


def resume_unity(path: Path, stops: tuple[str, ...], listener: Listener, say: Say = print) -> TrainedUnity:
    """Go on with a run from its last whole iteration.

    Weights, optimiser, exploration and counts go on as they were. What happens inside a player cannot be kept, so the
    episodes under way are lost and new ones begin; that is said.

    Args:
        path: The run folder.
        stops: New stops; none: those the run was begun with.
        listener: Watches the training.
        say: Says a line to a person.

    Raises:
        RunFolderError: No run of a Unity scene, its scene has changed, or it is being trained.
        UnityError: A player cannot be brought to talk, or was lost.
    """
    return _carry_out(plan_resume(path, stops), listener, say)


def _carry_out(plan: UnityPlan, listener: Listener, say: Say) -> TrainedUnity:
    began = time.perf_counter()
    if plan.build.is_editor:
        say(f"waiting on port {EDITOR_PORT} for the Unity Editor: press Play there")
    with _opened(plan) as course:
        if plan.begun is not None:
            run, outcome = plan.begun, resume(course, plan.begun, listener, say)
        else:
            run, outcome = train(course, plan.request.run, listener, say, plan.request.clone_from)
    seconds = time.perf_counter() - began
    behavior = course.card["behavior"]["name"].split("?")[0]
    return TrainedUnity(run, outcome, plan.build_name, behavior, plan.seed, course.notes, seconds)


@contextlib.contextmanager
def _opened(plan: UnityPlan) -> Iterator[Course]:
    """Start the players, and settle what only the scene could tell; the players are ended afterwards."""
    with contextlib.ExitStack() as players:
        world = UnityWorld(plan.build, **plan.words())
        players.callback(world.close)
        behavior = world.behavior
        settings, notes = settle(plan, behavior, world.spec.num_worlds)
        if plan.begun is None:
            stops = stops_for(plan.request, plan.config.behavior(behavior.name).max_steps, plan.build_name)
        else:
            stops = parse_stops(plan.request.stops)
        judged: UnityWorld | None = None
        if not plan.build.is_editor:
            judged = UnityWorld(plan.build, **plan.words(for_judge=True))
            players.callback(judged.close)

        yield Course(
            kind=KIND,
            world=world,
            settings=settings,
            seed=plan.seed,
            stops=stops,
            judge=lambda learner, run: _judge(judged, learner, run, settings.evaluation.episodes, stops),
            asked=plan.asked(behavior),
            card={"build": plan.build_name, "behavior": card_of(behavior)},
            title=f"{behavior.base_name} of {plan.build_name}",
            folder_name=_file_name(behavior.base_name),
            notes=notes,
            files={} if plan.request.config is None else {TRAINER_FILE: plan.request.config.read_bytes()},
            lasting=False,
        )


def _judge(
    judged: UnityWorld | None, learner: PpoLearner, run: RunFolder, episodes: int, stops: tuple[Stop, ...]
) -> Judge:
    threshold = next((stop.amount for stop in stops if stop.kind == "score"), None)
    if judged is None:
        return TrainingEpisodesJudge(threshold)
    return SceneJudge(judged, GreedyPolicy(learner), episodes, threshold, run.path / OBSERVATIONS)


def _file_name(behavior: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in behavior)
