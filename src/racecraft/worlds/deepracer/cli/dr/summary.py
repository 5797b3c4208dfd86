"""`dr-summary`: what this installation is set to, what is at work in it, what its bucket holds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from racecraft.cli.options import Json
from racecraft.worlds.deepracer.cli.dr.context import installation, latest_job

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder

TOLD = {
    "track": "DR_WORLD_NAME",
    "race": "DR_RACE_TYPE",
    "car": "DR_CAR_NAME",
    "model prefix": "DR_LOCAL_S3_MODEL_PREFIX",
    "custom files": "DR_LOCAL_S3_CUSTOM_FILES_PREFIX",
    "clone": "DR_LOCAL_S3_PRETRAINED",
    "clone of": "DR_LOCAL_S3_PRETRAINED_PREFIX",
}


def summary(context: typer.Context, json: Json = False) -> None:
    """Show what run.env asks for, what is at work under this run id, and which models the bucket holds.

    Example: racecraft dr summary
    """
    from racecraft.cli.output import print_json

    drfc = installation(context)
    facts = _facts(drfc)
    if json:
        print_json(facts)
        return
    width = max(map(len, facts))
    for name, value in facts.items():
        shown = ", ".join(value) if isinstance(value, list) else value
        print(f"{name:{width}}  {'-' if shown in (None, '') else shown}")
    for note in drfc.notes:
        print(f"- {note}")


def _facts(drfc: DrfcFolder) -> dict[str, Any]:
    from racecraft.formats.run_folder import JOB
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION, TRAINING

    bucket = drfc.bucket
    models = sorted(path.parent.name for path in bucket.glob(f"*/{JOB}")) if bucket.is_dir() else []
    facts: dict[str, Any] = {"installation": str(drfc.path), "run.env": str(drfc.config), "run id": drfc.run_id}
    facts |= {told: drfc.text(name) for told, name in TOLD.items()}
    for kind in (TRAINING, EVALUATION):
        job = latest_job(drfc, kind)
        facts[kind] = None if job is None else f"{job.name}: {job.state}"
    return {**facts, "bucket": str(bucket), "bucket is S3": _elsewhere(drfc), "models": models}


def _elsewhere(drfc: DrfcFolder) -> str | None:
    from racecraft.worlds.deepracer.files.drfc_buckets import local_bucket

    bucket = local_bucket(drfc)
    return None if bucket is None else f"{bucket.address} at {bucket.access.endpoint or 'AWS'}"
