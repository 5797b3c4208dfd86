"""What a DeepRacer-for-Cloud folder is set to, what is at work in it, what its bucket holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.worlds.deepracer.actions.drfc.installation import InstallationRequest
from racecraft.worlds.deepracer.actions.drfc.jobs import latest_job

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder

SETTINGS = {
    "track": "DR_WORLD_NAME",
    "race": "DR_RACE_TYPE",
    "car": "DR_CAR_NAME",
    "model prefix": "DR_LOCAL_S3_MODEL_PREFIX",
    "custom files": "DR_LOCAL_S3_CUSTOM_FILES_PREFIX",
    "clone": "DR_LOCAL_S3_PRETRAINED",
    "clone of": "DR_LOCAL_S3_PRETRAINED_PREFIX",
}


@dataclass(frozen=True)
class Summary:
    """Settings, jobs and models of an installation."""

    facts: dict[str, Any]
    notes: tuple[str, ...]
    """What was noticed while reading its files."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return settings, jobs and models by name."""
        return self.facts


@action
def summary(request: InstallationRequest, progress: Progress = quiet) -> Summary:
    """Show what run.env asks for, what is at work under this run id, and which models the bucket holds.

    Example: racecraft dr summary
    """
    drfc = request.installation.open()
    return Summary(summary_of(drfc), drfc.notes)


def summary_of(drfc: DrfcFolder) -> dict[str, Any]:
    """Return settings, jobs and models by name."""
    from racecraft.formats.run_folder import JOB
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION, TRAINING

    bucket = drfc.bucket
    models = sorted(path.parent.name for path in bucket.glob(f"*/{JOB}")) if bucket.is_dir() else []
    facts: dict[str, Any] = {"installation": str(drfc.path), "run.env": str(drfc.config), "run id": drfc.run_id}
    facts |= {title: drfc.text(name) for title, name in SETTINGS.items()}
    for kind in (TRAINING, EVALUATION):
        job = latest_job(drfc, kind)
        facts[kind] = None if job is None else f"{job.name}: {job.state}"
    return {**facts, "bucket": str(bucket), "bucket is S3": _elsewhere(drfc), "models": models}


def _elsewhere(drfc: DrfcFolder) -> str | None:
    from racecraft.worlds.deepracer.files.drfc_buckets import local_bucket

    bucket = local_bucket(drfc)
    return None if bucket is None else f"{bucket.address} at {bucket.access.endpoint or 'AWS'}"
