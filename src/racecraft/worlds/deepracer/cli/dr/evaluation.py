"""`dr-start-evaluation`, `dr-stop-evaluation`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from racecraft.worlds.deepracer.actions.drfc.jobs import begin_job, refuse_if_busy, stop_latest, trained_model
from racecraft.worlds.deepracer.actions.drfc.sync import place_of_model, send
from racecraft.worlds.deepracer.cli.dr.context import SHOWN, follow_job, installation, say_notes
from racecraft.worlds.deepracer.cli.dr.training import Quiet

CLONE_END = "-E"
"""What a clone to be judged is called after its model, as at DeepRacer for Cloud."""


def start_evaluation(
    context: typer.Context,
    quiet: Quiet = False,
    clone: Annotated[bool, typer.Option("-c", help="Judge a copy of the model, PREFIX-E, made anew.")] = False,
) -> None:
    """Judge the model of run.env in a race with resets and penalties, in the background: DR_EVAL_… says how.

    Example: racecraft dr start-evaluation -q
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION
    from racecraft.worlds.deepracer.files.model_copy import copy_model, wipe_model
    from racecraft.worlds.deepracer.training.race_environment import race_environment

    drfc = installation(context)
    say_notes(drfc)
    model = drfc.model
    refuse_if_busy(drfc, EVALUATION, model)
    race_environment(None, clones=False, drfc=drfc)  # a letter about any value comes now
    source = trained_model(drfc)
    if clone:
        model = model.with_name(model.name + CLONE_END)
        wipe_model(model)
        copy_model(source, model)
        print(f"{source.path}: copied to {model}")
    job = begin_job(context.obj, drfc, EVALUATION, model, ("run-evaluation", str(model.absolute())))
    print(f"{job.name} judges {model}; dr-stop-evaluation ends it")
    if not quiet:
        follow_job(job)


def run_evaluation(context: typer.Context, model: Annotated[Path, typer.Argument(help="The run folder.")]) -> None:
    """Judge a model in this process as run.env asks; dr-start-evaluation has it done in the background."""
    from racecraft.worlds.deepracer.actions.drfc.opponent import race_opponent
    from racecraft.worlds.deepracer.actions.evaluate import evaluate
    from racecraft.worlds.deepracer.cli.evaluate import show
    from racecraft.worlds.deepracer.cli.race import print_standings
    from racecraft.worlds.deepracer.env.settings import HEAD_TO_MODEL
    from racecraft.worlds.deepracer.training.race_rules import judging_in_drfc

    drfc = installation(context)
    rules: dict[str, Any] = judging_in_drfc(drfc.env.run)
    if drfc.text("DR_RACE_TYPE") == HEAD_TO_MODEL:
        raced = race_opponent(drfc, model, rules, SHOWN)
        print(f"{raced.laps} laps on {raced.track.title or raced.track.name}:")
        print_standings(raced.result)
    else:
        trials = rules.pop("laps")
        track, films = drfc.env.run.values.get("DR_WORLD_NAME"), drfc.flag("DR_EVAL_SAVE_MP4")
        show(evaluate(model, track=[track] if track else [], number_of_trials=trials, save_mp4=films, **rules))
    if model.absolute() == drfc.model.absolute():  # a clone is this machine's own
        send(model, place_of_model(drfc), SHOWN)


def stop_evaluation(context: typer.Context) -> None:
    """Stop the evaluation of this run id.

    Example: racecraft dr stop-evaluation
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION

    stop_latest(context.obj, EVALUATION, "dr-start-evaluation", SHOWN)
