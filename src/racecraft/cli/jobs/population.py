"""`racecraft tune --sampler pbt`: a population that trains in rounds."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from racecraft.formats.population import MemberRound, PopulationRecord
    from racecraft.jobs.tuning.space import Parameter

PBT = "pbt"
NOT_OF_POPULATIONS = ("trials", "pruner", "last", "from_")
PAGE = "population.html"


def train_population(
    record: PopulationRecord, parameters: Mapping[str, Parameter], folder: Path, parallel: int | None, json: bool
) -> None:
    """Train a population, or go on with the one in the folder; leave its page."""
    from racecraft.analysis.tuning_page import plain
    from racecraft.cli.output import print_json, say
    from racecraft.formats.atomic import make_folder
    from racecraft.formats.population import FILE, read_population
    from racecraft.jobs.capacity import Capacity
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.tuning.dry_run import require_understood
    from racecraft.jobs.tuning.population import check_population, train
    from racecraft.jobs.tuning.population_trials import PopulationTrials, check_round
    from racecraft.jobs.tuning.training_trials import TRIALS, Objective

    check_population(record.size, record.rounds)
    check_round(record.command, parameters)
    require_understood(record.command, parameters)
    aim = Objective(record.objective, record.maximise, take_last=True)
    cores = Capacity.of_machine().cores
    at_a_time = min(parallel or max(1, cores // 2), record.size)
    make_folder(folder)
    launch = PopulationTrials(folder, record.command, aim, max(1, cores // at_a_time), JobPaths.of_user())
    say(f"{folder}: {record.size} members, {record.rounds} rounds, {at_a_time} at a time", quiet_stdout=json)
    try:
        train(folder, record, parameters, launch, at_a_time, lambda one: say(_line(one), quiet_stdout=json))
    finally:
        stands = read_population(folder) or record
        _leave(folder, stands)
    best = stands.best
    run = None if best is None else folder / TRIALS / best.run
    if json:
        told = None if best is None else {**vars(best), "values": dict(best.values), "run": str(run)}
        places = {"page": str(folder / PAGE), "record": str(folder / FILE)}
        print_json({"tuning": str(folder), "members": len(stands.members), "best": told, **places})
        return
    if best is None:
        print("nobody came to a score")
        return
    print(f"best: member {best.member} at the end of round {best.round}, {plain(best.score)}")
    print(f"  {run}, checkpoint {best.iteration}")
    for name, value in best.values.items():
        print(f"  {name} = {plain(value)}")
    print(f"page: {folder / PAGE}")


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
