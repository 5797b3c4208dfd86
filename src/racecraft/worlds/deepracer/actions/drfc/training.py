"""What a training of a DeepRacer-for-Cloud folder begins from, and what it wipes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.contract.message import Message
from racecraft.contract.progress import Progress
from racecraft.worlds.deepracer.actions.drfc.sync import wipe

if TYPE_CHECKING:
    from racecraft.storage.mirror_note import MirrorLocation
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder


def training_request(drfc: DrfcFolder) -> Any:
    """Return the request of the training that run.env asks for."""
    from racecraft.worlds.deepracer.training.plan import RaceRequest
    from racecraft.worlds.deepracer.training.presets import PRESETS

    preset = drfc.env.run.choice("RACECRAFT_PRESET", "fast", tuple(PRESETS))
    return RaceRequest(drfc.path, run=drfc.model, preset=preset, drfc=drfc)


def require_free_model(drfc: DrfcFolder) -> None:
    """Refuse a model prefix that holds files.

    Raises:
        RunEnvError: It does.
    """
    model = drfc.model
    if model.exists() and (not model.is_dir() or any(model.iterdir())):
        raise drfc.error_at(
            "DR_LOCAL_S3_MODEL_PREFIX",
            "a prefix that is free",
            "Give another one, or start with -w to wipe it.",
            found=Message("{model} holds files already", model=model),
        )


def require_trainable(drfc: DrfcFolder, planned: Any) -> None:
    """Refuse what only comes to light when a training begins: what cannot be trained wipes nothing."""
    from racecraft.formats.checkpoint_ranking import load_weights, split_source
    from racecraft.players.open_run import open_run
    from racecraft.worlds.deepracer.training.trainer import KIND, load_reward
    from racecraft.worlds.deepracer.training.weight_transfer import require_same_shape

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


def wipe_run(model: Path, place: MirrorLocation | None, progress: Progress) -> None:
    """Take a model away, here and in its bucket."""
    from racecraft.worlds.deepracer.files.model_copy import wipe_model

    wipe(place, progress)
    if model.exists():
        wipe_model(model)
        progress(f"{model}: wiped")
