"""`sagemaker_rl.mpi_launcher`: runs a preset once for every process of every host; here it is run once, in this one."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from racecraft.compat.baselines_training import TAGGED
from racecraft.contract.errors import InputFileError

_running: list[str] = []
"""Presets that are being run by a launcher."""


class MPILauncher:
    """Runs a preset.

    Args:
        train_script: A Python file beside the script.
        train_script_args: Its words.
        num_of_processes_per_host: How many MPI would begin.
        instance_type: What it would run on.
    """

    def __init__(
        self,
        train_script: str,
        train_script_args: Sequence[str] | None = None,
        num_of_processes_per_host: int = 1,
        instance_type: Any = False,
    ) -> None:
        self._script, self._args = train_script, list(train_script_args or ())

    def mpi_run(self) -> None:
        """Run it, here and once; lines of its table look as mpirun tags them."""
        path = Path(sys.argv[0]).absolute().parent / self._script
        if not path.is_file():
            beside = ", ".join(sorted(one.name for one in path.parent.glob("preset*.py")))
            raise InputFileError(path, "there is no such preset", f"one of {beside or 'none stands there'}")
        print("- mpirun: worlds stand side by side in one process, whatever the hosts")
        before = sys.argv
        sys.argv = [str(path), *self._args]
        _running.append(str(path))
        try:
            runpy.run_path(str(path), run_name="__main__")
        finally:
            _running.pop()
            sys.argv = before


def tag() -> str:
    """Return what stands before every line of a preset's table."""
    return TAGGED if _running else ""


__all__ = ["MPILauncher"]
