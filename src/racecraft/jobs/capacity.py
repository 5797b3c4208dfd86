"""Cores and memory of this machine, as far as this process may use them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import psutil

from racecraft.formats.job_spec import JobSpec
from racecraft.jobs.states import JobError

CGROUP_LIMIT = Path("/sys/fs/cgroup/memory.max")


@dataclass(frozen=True)
class Capacity:
    """What a machine has, or what is left of it."""

    cores: int
    memory_mib: int

    @classmethod
    def of_machine(cls) -> Capacity:
        """Return what this process may use; a container's limit counts."""
        cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        return cls(cores, _memory_bytes() // 2**20)

    def taken_by(self, spec: JobSpec) -> Capacity:
        """Return what a job takes of it."""
        return Capacity(self.cores if spec.cores is None else spec.cores, spec.memory_mib)

    def without(self, taken: Capacity) -> Capacity:
        """Return what is left."""
        return Capacity(self.cores - taken.cores, self.memory_mib - taken.memory_mib)

    def has(self, wanted: Capacity) -> bool:
        """Tell whether that much is here."""
        return wanted.cores <= self.cores and wanted.memory_mib <= self.memory_mib

    def require(self, spec: JobSpec) -> None:
        """Refuse a job that this machine could never start.

        Raises:
            JobError: It takes more than all there is.
        """
        wanted = self.taken_by(spec)
        if not self.has(wanted):
            raise JobError(
                "Job {name} takes {cores} cores and {memory_mib} MiB; this machine has "
                "{cores_2} and {memory_mib_2}. Ask for less with --cores and --memory.",
                name=spec.name,
                cores=wanted.cores,
                memory_mib=wanted.memory_mib,
                cores_2=self.cores,
                memory_mib_2=self.memory_mib,
            )


def _memory_bytes() -> int:
    total = int(psutil.virtual_memory().total)
    try:
        limit = CGROUP_LIMIT.read_text().strip()
    except OSError:
        return total
    return min(total, int(limit)) if limit.isdigit() else total
