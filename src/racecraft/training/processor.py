"""The processor made ready for a training: threads shared, numbers next to nothing taken for zero."""

from __future__ import annotations

import os
import sys

import torch

from racecraft.contract.errors import SettingError

KERNELS = "racecraft.kernels.compile"
"""The importer of Numba. Worlds are open before the cores are shared: where none has kernels it is not imported, which
saves 0.2 s."""


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
