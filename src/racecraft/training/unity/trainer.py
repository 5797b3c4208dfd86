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

from racecraft.algorithms.multi_policy import Committee, Learner
from racecraft.algorithms.ppo import PpoLearner
from racecraft.envs.unity.cards import card_for
from racecraft.envs.unity.several import ALLOWED, WHOSE
from racecraft.envs.unity.wire import EDITOR_PORT
from racecraft.envs.unity.world import UnityWorld, spec_of
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy
from racecraft.training.callbacks import Listener
from racecraft.training.loop import Judge, Outcome
from racecraft.training.resume import Say
from racecraft.training.stopping import Stop, parse_stops
from racecraft.training.trainer import Course, resume, summary_of, train
from racecraft.training.unity.evaluator import SceneJudge, TrainingEpisodesJudge
from racecraft.training.unity.plan import (
    KIND,
    TRAINER_FILE,
    UnityPlan,
    UnityRequest,
    plan_resume,
    plan_unity,
    stops_for,
)
from racecraft.training.unity.settling import Settled, settle

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
    """Who learned; several names with commas between."""
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
    return TrainedUnity(run, outcome, plan.build_name, course.title.split(" of ")[0], plan.seed, course.notes, seconds)


@contextlib.contextmanager
def _opened(plan: UnityPlan) -> Iterator[Course]:
    """Start the players, and settle what only the scene could tell; the players are ended afterwards."""
    with contextlib.ExitStack() as players:
        world = UnityWorld(plan.build, **plan.words())
        players.callback(world.close)
        behaviors = world.behaviors
        settled = settle(plan, behaviors, world.rows_of)
        stops = parse_stops(plan.request.stops)
        if plan.begun is None:
            stops = stops_for(plan.request, settled.max_steps, plan.build_name)
        judged: UnityWorld | None = None
        if not plan.build.is_editor:
            judged = UnityWorld(plan.build, **plan.words(for_judge=True))
            players.callback(judged.close)

        names = [behavior.base_name for behavior in behaviors]
        yield Course(
            kind=KIND,
            world=world,
            settings=settled.shared,
            seed=plan.seed,
            stops=stops,
            judge=lambda learner, run: _judge(world, judged, learner, run, settled.shared.evaluation.episodes, stops),
            asked=plan.asked(behaviors),
            card={"build": plan.build_name, **card_for(behaviors, settled.each)},
            title=f"{', '.join(names)} of {plan.build_name}",
            folder_name=_file_name("-".join(names)),
            notes=settled.notes,
            files={} if plan.request.config is None else {TRAINER_FILE: plan.request.config.read_bytes()},
            learner=lambda: _learner(world, settled, plan.seed),
            lasting=False,
        )


def _learner(world: UnityWorld, settled: Settled, seed: int) -> Learner:
    """Return the learner of a behavior, or a committee where several learn."""
    device = settled.shared.runtime.device
    if len(world.behaviors) == 1:
        return PpoLearner(world.spec, settled.shared.network, settled.shared.ppo, seed, device)
    members = {}
    for number, behavior in enumerate(world.behaviors):
        rows, own = world.rows_of[behavior.base_name], settled.each[behavior.base_name]
        spec = spec_of(behavior, behavior.base_name, rows.stop - rows.start)
        members[behavior.base_name] = PpoLearner(spec, own.network, own.ppo, seed + 1_000 * number, device)
    return Committee(world.spec, members, WHOSE, ALLOWED)


def _judge(
    world: UnityWorld,
    judged: UnityWorld | None,
    learner: Learner,
    run: RunFolder,
    episodes: int,
    stops: tuple[Stop, ...],
) -> Judge:
    threshold = next((stop.amount for stop in stops if stop.kind == "score"), None)
    if judged is None:
        return TrainingEpisodesJudge(threshold, world.rows_of)
    return SceneJudge(judged, GreedyPolicy(learner), episodes, threshold, run.path / OBSERVATIONS)


def _file_name(behavior: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in behavior)
