"""`dr-start-training`, `dr-increment-training`, `dr-stop-training`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.actions.mirroring import mirrored
from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.actions.drfc.jobs import (
    await_run,
    begin_job,
    refuse_if_busy,
    stop_latest,
    trained_model,
)
from racecraft.worlds.deepracer.actions.drfc.sync import fetch_for_training, place_of_model, require_free
from racecraft.worlds.deepracer.actions.drfc.training import (
    require_free_model,
    require_trainable,
    training_request,
    wipe_run,
)
from racecraft.worlds.deepracer.cli.dr.context import SHOWN, ask_first, follow_job, installation, say_notes

if TYPE_CHECKING:
    pass

Wipe = Annotated[bool, typer.Option("-w", help="Wipe the prefix first, where a model lies there already.")]
Quiet = Annotated[bool, typer.Option("-q", help="Show no log; dr-logs-sagemaker shows it later.")]


def start_training(
    context: typer.Context,
    wipe_first: Wipe = False,
    quiet: Quiet = False,
    sagemaker: Annotated[bool, typer.Option("-s", help="Show the log of the learner, as is done anyway.")] = False,
    robomaker: Annotated[int | None, typer.Option("-r", help="Show the log of the simulator instead.")] = None,
    all_logs: Annotated[bool, typer.Option("-a", help="Show all logs: there is one program, so it is one.")] = False,
    viewer: Annotated[bool, typer.Option("-v", help="Open the viewer as well.")] = False,
) -> None:
    """Train what run.env asks for, in the background, until dr-stop-training or RACECRAFT_STOP.

    Examples:

        racecraft dr start-training

        racecraft dr start-training -w -q
    """
    from racecraft.worlds.deepracer.cli.dr.logs import follow_simulator
    from racecraft.worlds.deepracer.cli.dr.pages import open_viewer
    from racecraft.worlds.deepracer.files.drfc_jobs import TRAINING, job_of

    drfc = installation(context)
    say_notes(drfc)
    model = drfc.model
    refuse_if_busy(drfc, TRAINING, model)
    place = place_of_model(drfc)
    fetch_for_training(drfc, SHOWN)
    if not wipe_first:
        require_free_model(drfc)
        require_free(place)
    words = ("run-training", "-w") if wipe_first and (model.exists() or place is not None) else ("run-training",)
    again = ("train", f"--run={model.absolute()}", "--resume", "--no-pictures")
    before = job_of(drfc.path, drfc.run_id, TRAINING)
    job = begin_job(context.obj, drfc, TRAINING, model, words, again)
    if not await_run(drfc, TRAINING, job, before, SHOWN):
        return
    print(f"{job.name} trains run id {drfc.run_id} into {model}; dr-stop-training ends it")
    if viewer:
        open_viewer(context, drfc)
    if robomaker is not None:
        follow_simulator(drfc, job, robomaker)
    elif not quiet or sagemaker or all_logs:
        follow_job(job)


def run_training(context: typer.Context, wipe_first: Wipe = False) -> None:
    """Train in this process what run.env asks for; dr-start-training has it done in the background."""
    import sys

    from racecraft.training.progress import watcher
    from racecraft.training.worlds import carry_out, plan

    drfc = installation(context)
    place = place_of_model(drfc)
    request = training_request(drfc)
    planned = plan(request)
    if wipe_first:
        require_trainable(drfc, planned)
        wipe_run(drfc.model, place, SHOWN)
    with mirrored(watcher(sys.stdout), place, SHOWN) as watching:
        carry_out(request.kind, planned, watching, SHOWN)


def increment_training(
    context: typer.Context,
    force: Annotated[bool, typer.Option("-f", help="Ask no question.")] = False,
    wipe: Annotated[bool, typer.Option("-w", help="Wipe the next prefix, where a model lies there already.")] = False,
    prefix: Annotated[str, typer.Option("-p", help="The next prefix; by default this one, its number raised.")] = "",
    delimiter: Annotated[str, typer.Option("-d", help="What stands before that number.")] = "-",
) -> None:
    """Write into run.env that the next training begins with the model of this one; the old file stays as run.env.bak.

    Example: racecraft dr increment-training -f
    """
    from racecraft.worlds.deepracer.files.model_copy import require_empty, wipe_model
    from racecraft.worlds.deepracer.files.run_env import edit_run_env, next_prefix

    drfc = installation(context)
    now = drfc.text("DR_LOCAL_S3_MODEL_PREFIX")
    trained_model(drfc)
    following = prefix or next_prefix(now, delimiter)
    target = drfc.in_bucket(following)
    if target == drfc.model:
        raise UserInputError(
            "-p {following}: is the prefix of this training already; expected another one.", following=following
        )
    ask_first(f"Train {following} next, beginning with {now}, and write that into {drfc.config}?", force)
    if wipe:
        wipe_model(target)
    require_empty(target)
    edit_run_env(
        drfc.config,
        {
            "DR_LOCAL_S3_PRETRAINED": "True",
            "DR_LOCAL_S3_PRETRAINED_PREFIX": now,
            "DR_LOCAL_S3_MODEL_PREFIX": following,
        },
    )
    print(f"{drfc.config}: the next training is {following} and begins with {now}; the old file is {drfc.config}.bak")
    print("dr-update-env takes it over into this shell.")


def stop_training(context: typer.Context) -> None:
    """Stop the training of this run id: its last iteration is saved, and it can go on later.

    Example: racecraft dr stop-training
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import TRAINING

    job = stop_latest(context.obj, TRAINING, "dr-start-training", SHOWN)
    if job is not None:
        print(f"the model lies in {job.spec.run}")
