"""A model from one bucket of a DeepRacer-for-Cloud folder to another, as whole folders."""

from __future__ import annotations

from dataclasses import MISSING, dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.actions.export import ExportedRun
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import option
from racecraft.worlds.deepracer.actions.drfc.installation import InstallationRequest
from racecraft.worlds.deepracer.actions.drfc.jobs import trained_model
from racecraft.worlds.deepracer.actions.drfc.models import ModelCopy, raise_upload_prefix
from racecraft.worlds.deepracer.actions.drfc.sync import (
    fetched_model,
    place_in_bucket,
    place_of_model,
    place_of_upload,
    send,
)

CAR_ZIP = "carfile.tar.gz"
"""What the archive is called, as at DeepRacer for Cloud."""


@dataclass(frozen=True, kw_only=True)
class ForceRequest(InstallationRequest):
    """Which installation, and whether a question is asked."""

    force: bool = option(False, "Ask no question.", "-f")


@dataclass(frozen=True, kw_only=True)
class CarZipRequest(ForceRequest):
    """Where the archive goes."""

    local: bool = option(False, "Into the model's own folder in the local bucket.", "-L")


@dataclass(frozen=True, kw_only=True)
class CopyRequest(ForceRequest):
    """How a model is copied."""

    wipe: bool = option(False, "Wipe the target first, where a model lies there already.", "-w")
    dry_run: bool = option(False, "Say what would be done, and do nothing.", "-d")
    checkpoint: str | None = option(None, "The number of an iteration: only its weights go along.", "-c")


@dataclass(frozen=True, kw_only=True)
class UploadRequest(CopyRequest):
    """Which model is uploaded, and where."""

    best: bool = option(False, "The best checkpoint; by default the last.", "-b")
    prefix: str = option("", "The model to upload; by default that of run.env.", "-p")
    increment: bool = option(False, "First raise the number in DR_UPLOAD_S3_PREFIX.", "-1")
    import_: bool = option(False, "Import it into the console, which has closed: refused.", "-i")
    import_as: str = option("", "The same under a name: refused.", "-I")
    local: bool = option(False, "Into the local bucket.", "-L")


@dataclass(frozen=True, kw_only=True)
class DownloadRequest(CopyRequest):
    """Which model is downloaded, and what it is called here."""

    source: str = option(MISSING, "s3://BUCKET/PREFIX of one of our buckets, or a folder.", "-s")
    target: str = option(MISSING, "The prefix in the local bucket that it gets.", "-t")


@dataclass(frozen=True)
class CopiedModel:
    """A model that was copied, or would be."""

    source: Path
    target: Path
    description: str
    is_copied: bool


@dataclass(frozen=True)
class RaisedPrefix:
    """DR_UPLOAD_S3_PREFIX after its number was raised."""

    prefix: str


@action
def upload_model(request: UploadRequest, progress: Progress = quiet) -> CopiedModel:
    """Copy a model with one checkpoint into the bucket for uploads, under DR_UPLOAD_S3_PREFIX.

    Examples:

        racecraft dr upload-model -f -b

        racecraft dr upload-model -fbL
    """
    _require_possible(request)
    drfc = request.open(progress)
    if request.increment:
        raised = raise_upload_prefix(drfc, request.dry_run)
        progress(f"DR_UPLOAD_S3_PREFIX {'would be' if request.dry_run else 'is'} {raised}")
        drfc = request.installation.open()
    target = drfc.in_bucket(drfc.text("DR_UPLOAD_S3_PREFIX")) if request.local else drfc.upload
    source = drfc.in_bucket(request.prefix) if request.prefix else trained_model(drfc).path
    which = "best" if request.best else request.checkpoint or "last"
    place = place_of_upload(drfc, request.local)
    return _copied(ModelCopy(source=source, target=target, which=which, place=place), request, progress)


@action
def increment_upload_model(request: ForceRequest, progress: Progress = quiet) -> RaisedPrefix:
    """Raise the number at the end of DR_UPLOAD_S3_PREFIX in run.env; the old file stays as run.env.bak.

    Example: racecraft dr increment-upload-model -f
    """
    drfc = request.installation.open()
    if not request.force:
        progress.confirm(f"Write another DR_UPLOAD_S3_PREFIX into {drfc.config}?")
    return RaisedPrefix(raise_upload_prefix(drfc))


@action
def download_model(request: DownloadRequest, progress: Progress = quiet) -> CopiedModel:
    """Copy a model into the local bucket, from where a training can begin with it.

    Example: racecraft dr download-model -s s3://upload/fast-car-1 -t fast-car-2 -f
    """
    drfc, source = request.open(progress), request.source
    folder = fetched_model(drfc, source, progress) if source.startswith("s3://") else Path(source)
    place = place_in_bucket(drfc, request.target)
    copy = ModelCopy(source=folder, target=drfc.in_bucket(request.target), which=request.checkpoint, place=place)
    return _copied(copy, request, progress)


@action
def upload_car_zip(request: CarZipRequest, progress: Progress = quiet) -> ExportedRun:
    """Make the archive that a physical car drives with, of the best checkpoint, into the bucket for uploads.

    Example: racecraft dr upload-car-zip -L -f
    """
    from racecraft.actions.export import export_run

    drfc = request.open(progress)
    model = trained_model(drfc).path
    target = (model if request.local else drfc.upload) / CAR_ZIP
    if target.exists() and not request.force:
        progress.confirm(f"{target} stands there already. Write over it?")
    exported = export_run(str(model), to="car", output=target)
    send(target, place_of_model(drfc) if request.local else place_of_upload(drfc, local=False), progress)
    return exported


def _require_possible(request: UploadRequest) -> None:
    if request.import_ or request.import_as:
        raise SettingError("-i: the console that models were imported into has closed; expected -i left out.")
    if request.best and request.checkpoint is not None:
        raise SettingError(
            "-b and -c {checkpoint}: two checkpoints are asked for; expected one of them.",
            checkpoint=request.checkpoint,
        )


def _copied(copy: ModelCopy, request: CopyRequest, progress: Progress) -> CopiedModel:
    """Copy a model when the user agrees."""
    description = copy.description()
    if not request.dry_run:
        if not request.force:
            progress.confirm(f"Copy {description}?")
        copy.copy(request.wipe, progress)
    return CopiedModel(copy.source, copy.target, description, not request.dry_run)
