"""Compile kernels and keep them: decorators, the cache on disk and its key.

Numba keeps compiled code beside a hash of the *one* file a function stands in; a kernel that calls a kernel of another
file, or that froze a number of one, would go on with the old one after an edit there. So the cache folder's name holds
a hash of every kernel source of the package and of whatever those import from it (`sources`), of Numba's version and of
ours: an edit anywhere a kernel looks starts a fresh folder.

Numba keeps it by the path of that file as well, so that each copy of one package would be compiled anew: a checkout
beside another, a fresh clone, an environment that is made again. The folder's name says already what the code was made
of, so here a file is known by its place in the package (`KeptByContents`).

What is optimised and translated is a whole: a kernel that Python calls, with all that it calls (`whole.py`).

Importing this module points Numba's cache at that folder (unless `NUMBA_CACHE_DIR` is set); it compiles nothing.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numba
import numba.core.caching as numba_caching
from numba import njit
from numba import prange as prange

import racecraft
from racecraft.contract.user_cache import user_cache

_config: Any = numba.config
TRIED = (0, 63), (0, 68)
"""First and last version of Numba whose inside `whole.py` was tried with."""
if TRIED[0] <= numba.version_info[:2] <= TRIED[1]:
    from racecraft.kernels.whole import compiled_whole

    compiled: Callable[..., Any] = compiled_whole
else:  # Numba's own way gives the same results, and takes twice as long the first time
    compiled = partial(njit, cache=True, nogil=True, error_model="numpy")


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function for one core; other kernels may call it. Results are plain IEEE, the same everywhere."""
    return compiled(function)


def lean_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel that makes no array and returns numbers only: nobody counts who holds its arrays.

    Numba counts the holders of every array that a kernel hands on or slices, each time with an instruction that locks
    the memory: three quarters of a game's turn went there, and threads that share an array wait for each other. The
    arrays are the caller's, who outlives the call, so that there is nothing to count. What would make an array does not
    compile ("NRT required but not enabled"), a copy from slice to slice among it: write a loop. A slice returned would
    be a reference that nobody holds. The bits are the same.
    """
    return compiled(function, _nrt=False)


def inner_kernel(function: Callable[..., Any]) -> Any:
    """Compile a lean kernel that is laid into each kernel which calls it, for those called many times in one step.

    To call a kernel costs seven numbers an array, handed over on the stack; with ten arrays that is more than most of
    these functions do. The bits are the same.
    """
    return compiled(function, forceinline=True, _nrt=False)


def parallel_kernel(function: Callable[..., Any]) -> Any:
    """Compile a function whose `prange` loop over worlds is shared among the threads.

    Each world must write only its own rows; then the bits do not depend on the number of threads.

    The loop's number is signed while Numba looks at the types and unsigned in the shared body: every kernel that is
    given it would be compiled for both. `n = np.int64(world)` at the head of the loop spares the user that.
    """
    return compiled(function, parallel=True)


def set_threads(count: int) -> None:
    """Let kernels use `count` threads (1 to the number Numba started with); more is cut to what there is."""
    numba.set_num_threads(max(1, min(count, _config.NUMBA_NUM_THREADS)))


def threads() -> int:
    """Return how many threads kernels use now."""
    return int(numba.get_num_threads())


def cache_folder() -> Path:
    """Return the folder that holds this version's compiled kernels; it may not exist yet."""
    return user_cache() / "racecraft" / f"kernels-{_sources_hash()}"


def is_warm(kernel: str) -> bool:
    """Tell whether a kernel of this version was compiled on this machine before.

    Args:
        kernel: File and function, such as "race.tick". Others of this version say nothing of it: whoever played with
            snakes first has compiled their kernels and no car's.
    """
    return any(cache_folder().rglob(f"{kernel}-*.nbc"))


def sources(package: Path) -> list[Path]:
    """Return the files that compiled code is made of: every `kernels/*.py`, and what they import at their top, onward.

    Kernels freeze the globals they use. A number that `kernels/race.py` takes from `worlds/deepracer/env/vehicle.py`
    stands in the machine code, so that an edit there is an edit of the kernel.
    """
    return sorted(_read_by(package.rglob("kernels/*.py"), package))


def read_by(kernel_file: Path, package: Path) -> list[Path]:
    """Return the files that one kernel file's compiled code is made of, itself among them."""
    return sorted(_read_by([kernel_file], package))


def _read_by(files: Iterable[Path], package: Path) -> set[Path]:
    found: set[Path] = set()
    waiting = list(files)
    while waiting:
        source = waiting.pop()
        if source not in found:
            found.add(source)
            waiting += _imported(source.read_text(encoding="utf-8"), package)
    return found


_IMPORT = re.compile(r"^(?:from racecraft\.?([\w.]*) import (\([^)]*\)|.*)|import racecraft\.([\w.]+))", re.MULTILINE)
"""An import at the top of a file; read by its look, since to parse thirty files takes longer than to hash them."""


def _imported(text: str, package: Path) -> Iterator[Path]:
    """Yield the files of the package that a module's text imports."""
    for parent, names, module in _IMPORT.findall(text):
        place = package.joinpath(*(parent or module).split("."))
        for path in (place, *(place / name for name in re.findall(r"\w+", names))):
            yield from (file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file())


def _sources_hash() -> str:
    digest = hashlib.sha256(f"{racecraft.__version__} numba {numba.__version__} {sys.version_info[:2]}".encode())
    package = Path(racecraft.__file__).parent
    for source in sources(package):
        digest.update(source.relative_to(package).as_posix().encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:12]


_package = Path(racecraft.__file__).parent


def write_nothing() -> None:
    """Keep no machine code from now on: this process may read files and write none."""
    KeptByContents.may_write = False
    vars(numba_caching)["Cache"].save_overload = lambda cache, signature, data: None


class KeptByContents(numba_caching._CacheLocator):
    """Where Numba keeps the code of a kernel: in the folder of these sources, whatever path they have."""

    may_write = True

    def __init__(self, function: Callable[..., Any], source: Path) -> None:
        """Take a kernel and its file, relative to the package."""
        self._line = function.__code__.co_firstlineno
        self._place = Path(_config.CACHE_DIR, "-".join(source.parts[:-1]))

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(self._place)

    def get_source_stamp(self) -> str:
        """Return what tells that the source is still the same: the folder's name does."""
        return self._place.parent.name

    def get_disambiguator(self) -> str:
        """Return what tells functions of one name in one file apart."""
        return str(self._line)

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> KeptByContents | None:
        """Return a place for a function of one of `sources`; None for any other, which Numba keeps its own way."""
        if Path(file).is_relative_to(_package) and Path(file).parent.name == "kernels":
            kept = cls(function, Path(file).relative_to(_package))
            with contextlib.suppress(OSError):
                if cls.may_write:
                    kept.ensure_cache_path()
                return kept
        return None


if not os.environ.get("NUMBA_CACHE_DIR"):
    _config.CACHE_DIR = str(cache_folder())
    _impl: Any = vars(numba_caching).get("CacheImpl") or vars(numba_caching)["_CacheImpl"]  # the older name
    _impl._locator_classes.insert(0, KeptByContents)
