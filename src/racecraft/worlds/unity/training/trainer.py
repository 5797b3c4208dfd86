"""Train on a Unity scene: what it brings along to the common steps. Begin with `build_experiment`.

    plan → players that teach, one that judges → settings, the scene heard → `Experiment` → `training/trainer.py`

The agents of a behavior learn side by side in one player (or several). `plan.py` reads what was asked,
`resolve_settings.py` hears the scene, `evaluator.py` says how good a policy is.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from typing import Any

from racecraft.algorithms.building import build_learner
from racecraft.algorithms.learner import Learner
from racecraft.algorithms.multi_policy import MultiPolicyLearner, group_spec
from racecraft.formats.atomic import write_atomic
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy, spec_in
from racecraft.training.loop import Evaluator, Outcome
from racecraft.training.named_files import lay_named_files, named_files
from racecraft.training.resume import MessageCallback
from racecraft.training.stopping import SCORE, StopCondition, parse_stops
from racecraft.training.trainer import Experiment, summary_of
from racecraft.worlds.unity.env.behavior_specs import card_for
from racecraft.worlds.unity.env.wire import EDITOR_PORT
from racecraft.worlds.unity.env.world import UnityWorld
from racecraft.worlds.unity.files.trainer_config import DEFAULT_MAX_STEPS
from racecraft.worlds.unity.training.curriculum import Curriculum
from racecraft.worlds.unity.training.evaluator import SceneEvaluator, TrainingEpisodesEvaluator
from racecraft.worlds.unity.training.plan import (
    KIND,
    TRAINER_FILE,
    UnityPlan,
    UnityRequest,
    default_settings,
    plan_resume,
    plan_unity,
    stops_for,
    with_scene,
)
from racecraft.worlds.unity.training.resolve_settings import ResolvedSettings, file_name, own_groups, resolve, whose

__all__ = ["KIND", "Request", "UnityRequest", "default_settings", "build_experiment", "plan", "plan_resume", "summary"]

Request = UnityRequest
plan = plan_unity

OBSERVATIONS = "observations.safetensors"
"""What the judged policy saw, in the run folder; an export is checked on it."""


@contextlib.contextmanager
def build_experiment(planned: UnityPlan, on_message: MessageCallback) -> Iterator[Experiment]:
    """Start the players, and settle what only the scene could tell; the players are ended afterwards.

    Weights, optimiser, exploration and counts of a resumed run go on as they were. What happens inside a player cannot
    be kept, so the episodes under way are lost and new ones begin; that is said.

    Raises:
        RunFolderError: A resumed run's scene has changed.
        UnityError: A player cannot be brought to talk.
    """
    if planned.build.is_editor:
        on_message(f"waiting on port {EDITOR_PORT} for the Unity Editor: press Play there")
    with contextlib.ExitStack() as players:
        world = UnityWorld(planned.build, **planned.world_arguments())
        players.callback(world.close)
        behaviors = world.behaviors
        planned = with_scene(planned, behaviors)
        settled = resolve(planned, behaviors, world.rows_of)
        stops = parse_stops(planned.request.stops, SCORE)
        if planned.resumed_run is None:
            stops = stops_for(planned.request, settled.max_steps, planned.build_name)
        judged: UnityWorld | None = None
        if not planned.build.is_editor:
            judged = UnityWorld(planned.build, **planned.world_arguments(for_judge=True))
            players.callback(judged.close)
        curriculum = _curriculum(planned, world, judged, on_message)
        names = ", ".join(behavior.base_name for behavior in behaviors)
        episodes = settled.shared.evaluation.episodes
        yield Experiment(
            kind=KIND,
            world=world,
            algorithm=planned.algorithm,
            settings=settled.shared,
            seed=planned.seed,
            stops=stops,
            evaluator=lambda learner, run: _evaluator(world, judged, learner, run, episodes, stops, curriculum),
            request=planned.request_values(behaviors),
            metadata={
                "build": planned.build_name, **card_for(behaviors, own_groups(settled, planned.algorithm)),
            },
            title=f"{names} of {planned.build_name}",
            folder_name=file_name(names.replace(", ", "-")),
            notes=settled.notes,
            copy_user_files=lambda run: _copy_files(planned, settled, run),
            learner=lambda: _learner(planned, world, settled),
            world_lasts=False,
            same_shape=_require_same_heads,
            stays="a Unity scene is a program of its own, begun and ended beside its training.",
        )  # fmt: skip


def summary(planned: UnityPlan, run: RunFolder, outcome: Outcome) -> dict[str, Any]:
    """Return the figures of `racecraft unity train --json`."""
    job = run.read_job()
    return {
        "build": planned.build_name,
        "behavior": job["title"].split(" of ")[0],
        **summary_of(outcome, run, planned.seed),
        "notes": job["notes"],
    }


def _require_same_heads(path: str, metadata: Mapping[str, Any]) -> tuple[str, ...]:
    spec_in(RunFolder.open(path), metadata)
    return ()


def _learner(planned: UnityPlan, world: UnityWorld, settled: ResolvedSettings) -> Learner:
    """Return the learner of a behavior, or one of several where several learn."""
    if not world.spec.groups:
        return build_learner(planned.algorithm, world.spec, settled.shared, planned.seed)
    members = {}
    for number, (base, group) in enumerate(world.spec.groups.items()):
        rows = world.rows_of[base]
        spec = group_spec(base, group, rows.stop - rows.start)
        members[base] = build_learner(planned.algorithm, spec, settled.each[base], planned.seed + 1_000 * number)
    return MultiPolicyLearner(world.spec, members)


def _evaluator(
    world: UnityWorld,
    judged: UnityWorld | None,
    learner: Learner,
    run: RunFolder,
    episodes: int,
    stops: tuple[StopCondition, ...],
    curriculum: Curriculum | None,
) -> Evaluator:
    threshold = next((stop.amount for stop in stops if stop.kind == "score"), None)
    if curriculum is not None:
        curriculum.keep_in(run.path)
    if judged is None:
        return TrainingEpisodesEvaluator(threshold, world.rows_of, curriculum)
    return SceneEvaluator(judged, GreedyPolicy(learner), episodes, threshold, run.path / OBSERVATIONS, curriculum)


def _curriculum(
    planned: UnityPlan, world: UnityWorld, judged: UnityWorld | None, on_message: MessageCallback
) -> Curriculum | None:
    """Return the lessons of the configuration's environment parameters; None without any."""
    config = planned.config
    if not config.curricula:
        return None
    max_steps = {base: config.behavior(base).max_steps or DEFAULT_MAX_STEPS for base in world.rows_of}
    worlds = [world] if judged is None else [world, judged]
    return Curriculum(config.curricula, worlds, world.rows_of, max_steps, on_message)


def _copy_files(planned: UnityPlan, settled: ResolvedSettings, run: RunFolder) -> None:
    for number, (base, settings) in enumerate(settled.each.items()):
        if number:  # the first one's are those of the training itself
            lay_named_files(named_files(settings, of=whose(number, base)), run)
    if planned.request.config is not None:
        write_atomic(run.path / TRAINER_FILE, planned.request.config.read_bytes())
