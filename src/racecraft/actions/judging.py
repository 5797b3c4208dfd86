"""Judge what was trained, whatever its world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.actions.named_run import RUN_HELP, named_run
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option


@dataclass(frozen=True, kw_only=True)
class EpisodesRequest(Request):
    """Which run is judged, by how much."""

    run: str = argument(RUN_HELP, metavar="RUN[:which]")
    checkpoint: str | None = option(None, "best, last, the number of an iteration, or a merit; by default the best.")
    episodes: int | None = option(None, "How many count.", low=1)


@action
def evaluate_episodes(request: EpisodesRequest, progress: Progress = quiet) -> Figures:
    """Judge the greedy policy of a run by whole episodes.

    Examples:

        racecraft evaluate runs/CartPole-v1-1 --episodes 100

    Raises:
        UserInputError: The run cannot be used or judged.
    """
    from racecraft.evaluation.evaluate_run import evaluate_run

    run, checkpoint = named_run(request.run, request.checkpoint)
    values = {} if request.episodes is None else {"episodes": request.episodes}
    return Figures(evaluate_run(run, checkpoint or "", **values))


def evaluate(run: str | Path, **values: Any) -> Mapping[str, Any]:
    """Judge the greedy policy of a run; return the figures that `racecraft evaluate --json` prints.

    Args:
        run: The run folder; RUN:best, RUN:last and RUN:N name a checkpoint.
        values: Of a car: `track`, `laps`, or `tracks`, several names, for a row a track; with any other option of the
            command, such as `video="lap.mp4"` or `number_of_trials=3`, it drives and leaves files as the command does.
            Of others: `episodes`, `seed`.

    Raises:
        RunFolderError: There is no run folder.
        CheckpointError: No such checkpoint.
    """
    from racecraft.contract.kinds import find_kind
    from racecraft.evaluation.evaluate_run import evaluate_run
    from racecraft.formats.checkpoint_ranking import split_source
    from racecraft.formats.run_folder import RunFolder

    path, _ = split_source(str(run))
    kind = find_kind(str(RunFolder.open(path).read_job().get("kind")), path)
    if kind.evaluate_action and values.keys() - set(kind.evaluate_words):
        done: Mapping[str, Any] = kind.piece("evaluate_action")(str(run), **values).as_dictionary()
        return done
    return evaluate_run(run, **values)


def refuse_options(kind: str, given: Mapping[str, Any]) -> None:
    """Refuse options that say nothing of a run of this kind.

    Args:
        kind: Of the run's world.
        given: The options by their spelling.

    Raises:
        SettingError: One of them was given.
    """
    for name in given:
        raise SettingError("{option} says nothing of a {kind} run; expected it left out.", option=name, kind=kind)
