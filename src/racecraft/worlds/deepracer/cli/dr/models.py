"""`dr-upload-model`, `dr-download-model`, `dr-upload-car-zip`: a model from one bucket to another, as whole folders."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.actions.drfc.jobs import trained_model
from racecraft.worlds.deepracer.actions.drfc.models import ModelCopy, raise_upload_prefix
from racecraft.worlds.deepracer.actions.drfc.sync import (
    fetched_model,
    place_in_bucket,
    place_of_model,
    place_of_upload,
    send,
)
from racecraft.worlds.deepracer.cli.dr.context import SHOWN, ask_first, installation, say_notes

CAR_ZIP = "carfile.tar.gz"
"""What the archive is called, as at DeepRacer for Cloud."""

Force = Annotated[bool, typer.Option("-f", help="Ask no question.")]
WipeTarget = Annotated[bool, typer.Option("-w", help="Wipe the target first, where a model lies there already.")]
DryRun = Annotated[bool, typer.Option("-d", help="Say what would be done, and do nothing.")]
Checkpoint = Annotated[str | None, typer.Option("-c", help="The number of an iteration: only its weights go along.")]


def upload_model(
    context: typer.Context,
    force: Force = False,
    wipe: WipeTarget = False,
    dry_run: DryRun = False,
    best: Annotated[bool, typer.Option("-b", help="The best checkpoint; by default the last.")] = False,
    checkpoint: Checkpoint = None,
    prefix: Annotated[str, typer.Option("-p", help="The model to upload; by default that of run.env.")] = "",
    increment: Annotated[bool, typer.Option("-1", help="First raise the number in DR_UPLOAD_S3_PREFIX.")] = False,
    import_: Annotated[bool, typer.Option("-i", help="Import it into the console, which has closed: refused.")] = False,
    import_as: Annotated[str, typer.Option("-I", help="The same under a name: refused.")] = "",
    local: Annotated[bool, typer.Option("-L", help="Into the local bucket.")] = False,
) -> None:
    """Copy a model with one checkpoint into the bucket for uploads, under DR_UPLOAD_S3_PREFIX.

    Examples:

        racecraft dr upload-model -f -b

        racecraft dr upload-model -fbL
    """
    if import_ or import_as:
        raise SettingError("-i: the console that models were imported into has closed; expected -i left out.")
    if best and checkpoint is not None:
        raise SettingError(
            "-b and -c {checkpoint}: two checkpoints are asked for; expected one of them.", checkpoint=checkpoint
        )
    drfc = installation(context)
    say_notes(drfc)
    if increment:
        raise_upload_prefix(drfc, dry_run, SHOWN)
        drfc = installation(context)
    target = drfc.in_bucket(drfc.text("DR_UPLOAD_S3_PREFIX")) if local else drfc.upload
    source = drfc.in_bucket(prefix) if prefix else trained_model(drfc).path
    which = "best" if best else checkpoint or "last"
    copy = ModelCopy(source=source, target=target, which=which, place=place_of_upload(drfc, local))
    _copy(copy, force, wipe, dry_run)


def increment_upload_model(context: typer.Context, force: Force = False) -> None:
    """Raise the number at the end of DR_UPLOAD_S3_PREFIX in run.env; the old file stays as run.env.bak.

    Example: racecraft dr increment-upload-model -f
    """
    drfc = installation(context)
    ask_first(f"Write another DR_UPLOAD_S3_PREFIX into {drfc.config}?", force)
    raise_upload_prefix(drfc, dry_run=False, progress=SHOWN)


def download_model(
    context: typer.Context,
    source: Annotated[str, typer.Option("-s", help="s3://BUCKET/PREFIX of one of our buckets, or a folder.")],
    target: Annotated[str, typer.Option("-t", help="The prefix in the local bucket that it gets.")],
    force: Force = False,
    wipe: WipeTarget = False,
    dry_run: DryRun = False,
    checkpoint: Checkpoint = None,
) -> None:
    """Copy a model into the local bucket, from where a training can begin with it.

    Example: racecraft dr download-model -s s3://upload/fast-car-1 -t fast-car-2 -f
    """
    drfc = installation(context)
    say_notes(drfc)
    folder = fetched_model(drfc, source, SHOWN) if source.startswith("s3://") else Path(source)
    place = place_in_bucket(drfc, target)
    copy = ModelCopy(source=folder, target=drfc.in_bucket(target), which=checkpoint, place=place)
    _copy(copy, force, wipe, dry_run)


def upload_car_zip(
    context: typer.Context,
    local: Annotated[bool, typer.Option("-L", help="Into the model's own folder in the local bucket.")] = False,
    force: Force = False,
) -> None:
    """Make the archive that a physical car drives with, of the best checkpoint, into the bucket for uploads.

    Example: racecraft dr upload-car-zip -L -f
    """
    from racecraft.actions.export import export_run

    drfc = installation(context)
    say_notes(drfc)
    model = trained_model(drfc).path
    target = (model if local else drfc.upload) / CAR_ZIP
    if target.exists():
        ask_first(f"{target} stands there already. Write over it?", force)
    for line in export_run(str(model), to="car", output=target).exported.lines:
        print(line)
    send(target, place_of_model(drfc) if local else place_of_upload(drfc, local=False), SHOWN)


def _copy(copy: ModelCopy, force: bool, wipe: bool, dry_run: bool) -> None:
    """Copy a model when the user agrees."""
    description = copy.description()
    if dry_run:
        print(f"would copy {description}; nothing was done")
        return
    ask_first(f"Copy {description}?", force)
    copy.copy(wipe, SHOWN)
