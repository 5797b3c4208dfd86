"""The processor made ready for a training: threads shared, numbers next to nothing taken for zero."""

from __future__ import annotations

import ctypes
import os
import sys

import torch

from racecraft.contract.errors import SettingError

KERNELS = "racecraft.kernels.compile"
"""The importer of Numba. Worlds are open before the cores are shared: where none has kernels it is not imported, which
saves 0.2 s."""
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3
"""Names of `mallopt`, as <malloc.h> has them."""
KEPT_BYTES = 1 << 30
"""Pieces up to this are kept, and as much free memory at the end of the heap."""
MAX_IN_OLD_LIBRARIES = 32 << 20
"""Older versions of the GNU C library refuse a larger M_MMAP_THRESHOLD and answer 0 (mallopt(3))."""


def prepare_processor(count: int | None, device: str = "cpu") -> None:
    """Share the cores, worlds and learner taking turns with all of them; take numbers next to nothing for zero.

    The moments that Adam keeps of a weight that learns no more shrink by a tenth a step, and after some 700 steps are
    denormal numbers, which cost the processor a hundred times as much as others: the preset aws, with its many idle
    units, needed 1.7 times as long for a row from there on. Threads that begin later inherit it.

    Raises:
        SettingError: The device asked for is not there.
    """
    if device == "cuda" and not torch.cuda.is_available():
        raise SettingError("runtime.device is cuda, but this PyTorch sees no CUDA device; expected cpu here.")
    wanted = count or os.cpu_count() or 1
    if kernels := sys.modules.get(KERNELS):
        kernels.set_threads(wanted)
    torch.set_num_threads(wanted)
    torch.set_flush_denormal(True)
    keep_freed_memory()


def keep_freed_memory() -> None:
    """Let what a layer frees be taken again by the next one, and not go back to the system in between.

    A minibatch's layers are a few MiB each. The GNU C library gives pieces of that size back as soon as they are freed,
    and has the system fill the next one with zeros, page by page: 47,000 page faults in one update of the default car,
    a third of its time. What a training holds at its peak it now holds until it ends. Other C libraries are left alone.
    """
    if sys.platform != "linux":
        return
    try:
        mallopt = ctypes.CDLL("libc.so.6").mallopt
    except (OSError, AttributeError):
        return
    if not mallopt(M_MMAP_THRESHOLD, KEPT_BYTES):
        mallopt(M_MMAP_THRESHOLD, MAX_IN_OLD_LIBRARIES)
    mallopt(M_TRIM_THRESHOLD, KEPT_BYTES)
