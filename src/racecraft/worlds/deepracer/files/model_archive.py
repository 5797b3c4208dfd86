"""Archives of models: only files that belong to a model are written. Begin with `unpack_model`.

DeepRacer for Cloud, AWS's consoles and physical cars give `.tar.gz`; one console gave a ZIP under that name. All are
read by `formats/archive.py`, which refuses what is dangerous.
"""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath

from racecraft.formats.archive import ArchiveError, unpack
from racecraft.worlds.deepracer.files.trained_model import PARAMS

KIND = "an archive of a DeepRacer model (.tar.gz or .zip): a car's, a console's or DeepRacer for Cloud's"
MB = 2**20
WANTED: tuple[tuple[str, int], ...] = (
    (r"model_metadata\.json|hyperparameters\.json|deepracer_checkpoints\.json", MB),
    (r"reward_function\.py|\.?coach_checkpoint|checkpoint", MB),
    (PARAMS.pattern, 10 * MB),
    (r"model(_\d+)?\.pb", 2048 * MB),
    (r".+\.ckpt\.index", 64 * MB),
    (r".+\.ckpt\.meta", 512 * MB),
    (r".+\.ckpt\.data-\d{5}-of-\d{5}", 4096 * MB),
)
"""Names of a model's files, and the most bytes each may have."""


def unpack_model(path: str | Path, into: str | Path) -> list[Path]:
    """Unpack what belongs to a model, and return the files that were written.

    Args:
        path: The archive.
        into: An empty folder.

    Raises:
        ArchiveError: It is not an archive, damaged, dangerous, or holds nothing of a model.
        OutputFileError: There is no room for it.
    """
    written = unpack(path, into, KIND, max_size_of=_limit_for)
    if not written:
        raise ArchiveError(path, "it holds no file of a model", "model_metadata.json with weights (.pb or .ckpt)")
    return written


def _limit_for(place: PurePosixPath) -> int | None:
    """Return the most bytes a model's file of this name may have; None: it is none."""
    if place.name.startswith("._"):
        return None  # what macOS keeps beside a file
    return next((limit for pattern, limit in WANTED if re.fullmatch(pattern, place.name)), None)
