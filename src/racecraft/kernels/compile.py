"""Compile kernels and keep them: decorators, the cache on disk and its key.

Numba keeps compiled code beside a hash of the *one* file a function stands in; a kernel that calls a kernel of another
file would go on with the old body after an edit there. So the cache folder's name holds a hash of every kernel source
of the package, of Numba's version and of ours: an edit anywhere starts a fresh folder.

Importing this module points Numba's cache at that folder (unless `NUMBA_CACHE_DIR` is set); it compiles nothing.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba import njit
from numba import prange as prange

import racecraft

_config: Any = numba.config


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function for one core; other kernels may call it. Results are plain IEEE, the same everywhere."""
    return njit(cache=True, nogil=True, error_model="numpy")(function)


def parallel_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function whose `prange` loop over worlds is shared among the threads.

    Each world must write only its own rows; then the bits do not depend on the number of threads.
    """
    return njit(cache=True, nogil=True, error_model="numpy", parallel=True)(function)


def set_threads(count: int) -> None:
    """Let kernels use `count` threads (1 to the number Numba started with); more is cut to what there is."""
    numba.set_num_threads(max(1, min(count, _config.NUMBA_NUM_THREADS)))


def threads() -> int:
    """Return how many threads kernels use now."""
    return int(numba.get_num_threads())


def cache_folder() -> Path:
    """Return the folder that holds this version's compiled kernels; it may not exist yet."""
    return _cache_root() / "racecraft" / f"kernels-{_sources_hash()}"


def is_warm() -> bool:
    """Tell whether kernels of this version were compiled on this machine before."""
    return any(cache_folder().rglob("*.nbc"))


def _cache_root() -> Path:
    if override := os.environ.get("RACECRAFT_CACHE"):
        return Path(override)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))


def _sources_hash() -> str:
    digest = hashlib.sha256(f"{racecraft.__version__} numba {numba.__version__} {sys.version_info[:2]}".encode())
    package = Path(racecraft.__file__).parent
    for source in sorted(package.rglob("kernels/*.py")):
        digest.update(source.relative_to(package).as_posix().encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:12]


if not os.environ.get("NUMBA_CACHE_DIR"):
    _config.CACHE_DIR = str(cache_folder())
