"""`dr-start-training`, `dr-increment-training`, `dr-stop-training`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.buckets.training import mirrored
from racecraft.contract.errors import UserInputError
from racecraft.contract.message import Message
from racecraft.worlds.deepracer.cli.dr.bucket_sync import fetch_for_training, place_of_model, require_free, wipe
from racecraft.worlds.deepracer.cli.dr.context import (
    ask_first,
    await_run,
    begin_job,
    follow_job,
    installation,
    refuse_if_busy,
    say_notes,
    stop_latest,
    trained_model,
)

if TYPE_CHECKING:
    from racecraft.storage.mirror_note import Place
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder

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
    fetch_for_training(drfc)
    if not wipe_first:
        _require_free(drfc)
        require_free(place)
    words = ("run-training", "-w") if wipe_first and (model.exists() or place is not None) else ("run-training",)
    again = ("train", f"--run={model.absolute()}", "--resume", "--no-pictures")
    before = job_of(drfc.path, drfc.run_id, TRAINING)
    job = begin_job(context, drfc, TRAINING, model, words, again)
    await_run(drfc, TRAINING, job, before)
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

    def say(text: str) -> None:
        print(text, flush=True)

    drfc = installation(context)
    place = place_of_model(drfc)
    request = _request(drfc)
    planned = plan(request)
    if wipe_first:
        _require_trainable(drfc, planned)
        _wipe(drfc.model, place)
    with mirrored(watcher(sys.stdout), place, say) as watching:
        carry_out(request.kind, planned, watching, say)


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

    job = stop_latest(context, TRAINING, "dr-start-training")
    if job is not None:
        print(f"the model lies in {job.spec.run}")


def _wipe(model: Path, place: Place | None) -> None:
    from racecraft.worlds.deepracer.files.model_copy import wipe_model

    wipe(place)
    if model.exists():
        wipe_model(model)
        print(f"{model}: wiped")


def _require_free(drfc: DrfcFolder) -> None:
    model = drfc.model
    if model.exists() and (not model.is_dir() or any(model.iterdir())):
        raise drfc.error_at(
            "DR_LOCAL_S3_MODEL_PREFIX",
            "a prefix that is free",
            "Give another one, or start with -w to wipe it.",
            found=Message("{model} holds files already", model=model),
        )


def _request(drfc: DrfcFolder) -> Any:
    from racecraft.worlds.deepracer.training.plan import RaceRequest
    from racecraft.worlds.deepracer.training.presets import PRESETS

    preset = drfc.env.run.choice("RACECRAFT_PRESET", "fast", tuple(PRESETS))
    return RaceRequest(drfc.path, run=drfc.model, preset=preset, drfc=drfc)


def _require_trainable(drfc: DrfcFolder, planned: Any) -> None:
    """Refuse what only comes to light when a training begins: what cannot be trained wipes nothing."""
    from racecraft.formats.checkpoint_ranking import load_weights, split_source
    from racecraft.players.open_run import open_run
    from racecraft.worlds.deepracer.training.cloning import require_same_shape
    from racecraft.worlds.deepracer.training.trainer import KIND, load_reward

    load_reward(planned.model.reward, planned.settings.race.reward_seconds).close()
    if planned.request.clone_from is None:
        return
    path, which = split_source(planned.request.clone_from)
    if Path(path).resolve().is_relative_to(drfc.model.resolve()):
        raise drfc.error_at(
            "DR_LOCAL_S3_PRETRAINED_PREFIX",
            "a model that is not the one to be wiped",
            "Give another DR_LOCAL_S3_MODEL_PREFIX, or leave out -w.",
            found=Message("{path}, which -w would wipe", path=path),
        )
    older = open_run(path)
    older.read_job_of(KIND)
    require_same_shape(planned, path, load_weights(older, which)[1])
