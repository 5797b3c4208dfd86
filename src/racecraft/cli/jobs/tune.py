"""`racecraft tune`."""

from __future__ import annotations

from racecraft.actions.population import PAGE as POPULATION_PAGE
from racecraft.actions.population import TrainedPopulation
from racecraft.actions.tuning import PAGE, TunedSettings, search_settings
from racecraft.cli.from_request import command
from racecraft.cli.jobs.jobs import WORDS


def _show(done: TunedSettings | TrainedPopulation) -> None:
    if isinstance(done, TrainedPopulation):
        _show_population(done)
    else:
        _show_search(done)


def _show_search(done: TunedSettings) -> None:
    from racecraft.analysis.tuning_page import plain

    best = done.study.best()
    if best is None:
        print("no trial came to a score")
        return
    print(f"best: trial {best.number}, {plain(best.score)}")
    for name, value in best.values.items():
        print(f"  {name} = {plain(value)}")
    for name, share in sorted(done.study.importances().items(), key=lambda one: -one[1]):
        print(f"  {name} decides {100 * share:.0f} %")
    print(f"page: {done.folder / PAGE}")


def _show_population(done: TrainedPopulation) -> None:
    from racecraft.analysis.tuning_page import plain

    best = done.record.best
    if best is None:
        print("nobody came to a score")
        return
    print(f"best: member {best.member} at the end of round {best.round}, {plain(best.score)}")
    print(f"  {done.best_run}, checkpoint {best.iteration}")
    for name, value in best.values.items():
        print(f"  {name} = {plain(value)}")
    print(f"page: {done.folder / POPULATION_PAGE}")


tune = command(search_settings, _show)
CONTEXT = WORDS
"""What follows the first word is the training command's own."""
