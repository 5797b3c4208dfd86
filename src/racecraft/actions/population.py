"""Train a population in rounds. Begin with `train_members`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.contract.progress import Progress

if TYPE_CHECKING:
    from racecraft.formats.population import MemberRound, PopulationRecord
    from racecraft.jobs.tuning.space import Parameter

PBT = "pbt"
"""The sampler that is a population."""
NOT_OF_POPULATIONS = ("--trials", "--pruner", "--last", "--from")
PAGE = "population.html"


@dataclass(frozen=True)
class TrainedPopulation:
    """A population as far as it was trained."""

    folder: Path
    record: PopulationRecord

    @property
    def best_run(self) -> Path | None:
        """The run of the best member; None: no member has a score."""
        from racecraft.jobs.tuning.training_trials import TRIALS

        best = self.record.best
        return None if best is None else self.folder / TRIALS / best.run

    def as_dictionary(self) -> dict[str, Any]:
        """Return folder, page, record and the best member."""
        from racecraft.formats.population import FILE

        best = self.record.best
        figures = None if best is None else {**vars(best), "values": dict(best.values), "run": self.best_run}
        files = {"page": self.folder / PAGE, "record": self.folder / FILE}
        return {"tuning": self.folder, "members": len(self.record.members), "best": figures, **files}


def train_members(
    record: PopulationRecord,
    parameters: Mapping[str, Parameter],
    folder: Path,
    parallel: int | None,
    progress: Progress,
) -> TrainedPopulation:
    """Train a population, or go on with the one in the folder; leave its page."""
    from racecraft.formats.atomic import make_folder
    from racecraft.formats.population import read_population
    from racecraft.jobs.capacity import Capacity
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.tuning.dry_run import require_understood
    from racecraft.jobs.tuning.population import check_population, train
    from racecraft.jobs.tuning.population_trials import PopulationTrials, check_round
    from racecraft.jobs.tuning.training_trials import Objective

    check_population(record.size, record.rounds)
    check_round(record.command, parameters)
    require_understood(record.command, parameters)
    aim = Objective(record.objective, record.maximise, take_last=True)
    cores = Capacity.of_machine().cores
    at_a_time = min(parallel or max(1, cores // 2), record.size)
    make_folder(folder)
    launch = PopulationTrials(folder, record.command, aim, max(1, cores // at_a_time), JobPaths.of_user())
    progress(f"{folder}: {record.size} members, {record.rounds} rounds, {at_a_time} at a time")
    try:
        train(folder, record, parameters, launch, at_a_time, lambda one: progress(_line(one)))
    finally:
        stands = read_population(folder) or record
        _leave(folder, stands)
    return TrainedPopulation(folder, stands)


def _line(one: MemberRound) -> str:
    from racecraft.analysis.tuning_page import plain

    values = ", ".join(f"{name}={plain(value)}" for name, value in one.values.items())
    ended = plain(one.score) if one.score is not None else f"failed: {one.note}"
    taken = "" if one.parent is None else f" | weights of {one.parent}"
    return f"round {one.round} | member {one.member} | {ended} | {values}{taken}"


def _leave(folder: Path, record: PopulationRecord) -> None:
    from racecraft.analysis.population_page import write_population_page
    from racecraft.jobs.tuning.training_trials import TRIALS

    best = record.best
    command = "" if best is None else f"racecraft evaluate {folder / TRIALS / best.run} --checkpoint {best.iteration}"
    title = f"Population {folder.name}: {' '.join(record.command)}"
    write_population_page(folder / PAGE, record, title, command)
