"""What a reward function pays for, before a training and after it."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    import polars as pl

    from racecraft.worlds.deepracer.driving.reward.cases import Result
    from racecraft.worlds.deepracer.driving.reward.check import RewardCheck
    from racecraft.worlds.deepracer.driving.reward.lines_paid import LinesPaid
    from racecraft.worlds.deepracer.driving.reward.pay_map import PayMap, Pull
    from racecraft.worlds.deepracer.driving.reward.paying import Payer
    from racecraft.worlds.deepracer.driving.reward.rescore import Rescored
    from racecraft.worlds.deepracer.tracks.track import Track

FILE = "reward_function.py, or the folder that holds one."
LOGS = "Run folders, DeepRacer log folders, .tar.gz, logs or traces."
LOG_TRACK = "The track they were driven on, or its waypoint file; found by default."
PAGE = "Write one page (.html) that works offline."
PICTURE = "Draw it into this file (.png, .svg or .pdf)."
PAGE_SPEED = 2.0
"""m/s, of the map on the page."""
MAX_TRACED = 2000
"""Rows that are explained: the latest whole episodes, as a reward may keep what an episode began with."""


@dataclass(frozen=True, kw_only=True)
class CheckRewardRequest(Request):
    """Which reward is looked at, and for what."""

    file: Path = argument(FILE)
    for_: str | None = option(None, "race: a reward by which slow laps earn more counts as a fault.", choices=("race",))
    track: str = option("reinvent_base", "The track of the map on the page.")
    page: Path | None = option(None, PAGE)


@dataclass(frozen=True, kw_only=True)
class MapRewardRequest(Request):
    """Which reward is shown on which track, and how the car drives there."""

    file: Path = argument(FILE)
    track: str = option(MISSING, "A name from `racecraft tracks list`, or a waypoint file (.npy).")
    speed: float = option(2.0, "Commanded speed, m/s.", low=0.1, high=5.0)
    heading: float = option(0.0, "Against the road, degrees, left positive.")
    steering: float = option(0.0, "Commanded angle, degrees, left positive.")
    term: str | None = option(None, "Show this variable of the function in place of the pay.")
    table: str | None = option(
        None,
        "Also tell what each action of this table earns, held for half a second: a model_metadata.json, "
        "'default' or 7x1.5,2.5.",
    )
    picture: Path | None = option(None, PICTURE)
    page: Path | None = option(None, PAGE)


@dataclass(frozen=True, kw_only=True)
class RescoreRequest(Request):
    """Which laps are paid again by which reward."""

    file: Path = argument(FILE)
    logs: tuple[Path, ...] = argument(LOGS)
    track: str | None = option(None, LOG_TRACK)
    picture: Path | None = option(None, PICTURE)
    page: Path | None = option(None, PAGE)


@dataclass(frozen=True, kw_only=True)
class RewardCasesRequest(Request):
    """Which reward is tried by which cases."""

    file: Path = argument(FILE)
    cases: Path | None = option(None, "The file of cases. [default: reward_test.toml beside the function]")


@dataclass(frozen=True, kw_only=True)
class ExplainRewardRequest(Request):
    """Whose reward is traced line by line."""

    run: Path = argument("Run folder, or any log with --reward.")
    reward: Path | None = option(None, "The reward function. [default: the run's own]")
    track: str | None = option(None, LOG_TRACK)


@dataclass(frozen=True, kw_only=True)
class SamplesRequest(Request):
    """Which sample is wanted."""

    name: str | None = argument("Print this sample; without a name all are listed.", None)


@dataclass(frozen=True)
class CheckedReward:
    """What is wrong with a reward, and where the page is."""

    check: RewardCheck
    page: Path | None

    @property
    def exit_code(self) -> int:
        """1 where there is a fault."""
        return int(bool(self.check.faults))

    def as_dictionary(self) -> dict[str, Any]:
        """Return the findings by name, with the page."""
        return self.check.as_dictionary() | _files(page=self.page)


@dataclass(frozen=True)
class MappedReward:
    """What a reward pays at every place of a track, and which actions it pulls to."""

    track: Track
    speed: float
    map: PayMap
    pull: Pull | None
    files: Mapping[str, str]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the map by name, with the pull and the files."""
        pull = {} if self.pull is None else {"pull": self.pull.as_dictionary()}
        return self.map.as_dictionary() | pull | dict(self.files)


@dataclass(frozen=True)
class RescoredLaps:
    """Old laps paid by another reward."""

    laps: Rescored
    files: Mapping[str, str]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the laps by name, with the files."""
        return self.laps.as_dictionary() | dict(self.files)


@dataclass(frozen=True)
class TestedReward:
    """Whether a reward pays as its cases expect."""

    results: Sequence[Result]

    @property
    def failed(self) -> int:
        """How many cases fail."""
        return sum(not result.passed for result in self.results)

    @property
    def exit_code(self) -> int:
        """1 where a case fails."""
        return int(self.failed > 0)

    def as_dictionary(self) -> dict[str, Any]:
        """Return the cases, and how many fail."""
        rows = [{"name": one.case.name, "passed": one.passed, "text": one.text} for one in self.results]
        return {"cases": rows, "failed": self.failed}


@dataclass(frozen=True)
class ExplainedReward:
    """Which lines of a reward paid, and where."""

    track: Track
    lines: LinesPaid

    def as_dictionary(self) -> dict[str, Any]:
        """Return the lines by name, with the track."""
        return {"track": self.track.name, **self.lines.as_dictionary()}


@dataclass(frozen=True)
class RewardSamples:
    """One sample, or what there is."""

    name: str | None
    text: str
    samples: Mapping[str, str]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the sample, or a sentence about each."""
        return {"samples": self.samples} if self.name is None else {"name": self.name, "text": self.text}


@action
def check_reward(request: CheckRewardRequest, progress: Progress = quiet) -> CheckedReward:
    """Look for faults before a training: errors on 200 moments, slips of unit and sign, what pays more than lapping.

    Exit code 0: no fault; 1: at least one; 2: the file cannot be loaded.

    Examples:

        racecraft reward check my-car/reward_function.py

        racecraft reward check my-car --for race --json

        racecraft reward check my-car --page reward.html
    """
    from racecraft.worlds.deepracer.analysis.reward_page import write_reward_page
    from racecraft.worlds.deepracer.driving.reward.check import check_reward as check_file
    from racecraft.worlds.deepracer.driving.reward.pay_map import pay_map
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    found = check_file(_file(request.file), for_race=request.for_ == "race")
    if request.page is not None:
        mapped = pay_map(_payer(request.file), load_track(request.track), PAGE_SPEED)
        write_reward_page(request.page, str(found.source.path), found, mapped)
    return CheckedReward(found, request.page)


@action
def map_reward(request: MapRewardRequest, progress: Progress = quiet) -> MappedReward:
    """Show what a reward pays at every place of a track, at one speed and heading; one term at a time with --term.

    Examples:

        racecraft reward map my-car --track reinvent_base --picture pay.png

        racecraft reward map my-car --track reinvent_base --speed 3 --term on_line --picture line.png

        racecraft reward map my-car --track reinvent_base --table my-car/model_metadata.json --json
    """
    from math import radians

    from racecraft.worlds.deepracer.analysis.reward_page import write_reward_page
    from racecraft.worlds.deepracer.driving.reward.pay_map import draw_map, pay_map
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    track, payer = load_track(request.track), _payer(request.file)
    heading, steering = radians(request.heading), radians(request.steering)
    mapped = pay_map(payer, track, request.speed, heading, steering, request.term)
    if request.term is not None and request.term not in mapped.terms:
        raise SettingError(
            "--term is {found!r}; expected a variable that holds a number. {hint}",
            found=request.term,
            hint=nearest(request.term, mapped.terms),
        )
    pull = None if request.table is None else _pull(payer, track, request.table, request.speed)
    if request.picture is not None:
        title = f"{track.name}: {mapped.what} at {request.speed:g} m/s, heading {request.heading:+g}°"
        draw_map(mapped, request.picture, title)
    if request.page is not None:
        write_reward_page(request.page, f"{_file(request.file).name} on {track.name}", mapped=mapped)
    return MappedReward(track, request.speed, mapped, pull, _files(picture=request.picture, page=request.page))


def _pull(payer: Payer, track: Track, table: str, speed: float) -> Pull:
    """Return what each action of a table earns.

    Raises:
        SettingError: The table has ranges.
    """
    from racecraft.worlds.deepracer.driving.action_tables import read_table
    from racecraft.worlds.deepracer.driving.reward.pay_map import pull_of_actions
    from racecraft.worlds.deepracer.env.actions import ActionTable
    from racecraft.worlds.deepracer.env.vehicle import PROFILES

    actions = read_table(table)
    if not isinstance(actions, ActionTable):
        raise SettingError("--table {found} has ranges; expected a table of actions.", found=table)
    return pull_of_actions(payer, track, PROFILES["v6"], actions, speed)


@action
def rescore(request: RescoreRequest, progress: Progress = quiet) -> RescoredLaps:
    """Pay the laps of old logs again, ours or AWS's: which earn more now, and which change places.

    Examples:

        racecraft reward rescore my-car runs/reinvent_base-1

        racecraft reward rescore new_reward.py model.tar.gz --picture then-and-now.png --json
    """
    from racecraft.worlds.deepracer.driving.reward.rescore import rescore as pay_again

    payer = _payer(request.file)
    ticks, track = _ticks(request.logs, request.track)
    found = pay_again(ticks, track, payer)
    if any("has no objects" in remark for remark in payer.process.source.remarks):
        progress("The function reads objects, and logs do not say where they stood: it is told of none.")
    if request.picture is not None:
        from racecraft.worlds.deepracer.analysis.logs.rescoring import scatter_of_rewards

        scatter_of_rewards(found).save(request.picture)
    if request.page is not None:
        from racecraft.worlds.deepracer.analysis.reward_page import write_reward_page

        names = ", ".join(log.name for log in request.logs)
        write_reward_page(request.page, f"{_file(request.file).name} on {names}", rescored=found)
    return RescoredLaps(found, _files(picture=request.picture, page=request.page))


@action
def run_reward_cases(request: RewardCasesRequest, progress: Progress = quiet) -> TestedReward:
    """Run your own expectations of a reward: cases such as "the centre pays more than the border".

    A file reward_test.toml beside reward_function.py is run before every training. One case:

        [[case]]

        name = "the centre pays more than the border"

        here = { share = 0.1, offset_m = 0.0, speed_mps = 2.0 }

        more_than = { share = 0.1, offset_m = 0.3, speed_mps = 2.0 }

    Other expectations: pays, at_least, at_most, less_than. Other keys of a place: heading_degrees, steering_degrees,
    ticks. Exit code 1 when a case fails.

    Example: racecraft reward test my-car
    """
    from racecraft.worlds.deepracer.driving.reward.cases import CASES, run_cases

    return TestedReward(run_cases(request.cases or _file(request.file).with_name(CASES), _payer(request.file)))


@action
def explain_reward(request: ExplainRewardRequest, progress: Progress = quiet) -> ExplainedReward:
    """Tell which lines of a run's reward paid, and where on the track: its latest rows are paid again, line by line.

    Examples:

        racecraft reward explain runs/reinvent_base-1

        racecraft reward explain model.tar.gz --reward reward_function.py --json
    """
    import numpy as np

    from racecraft.formats.run_folder import REWARD_FUNCTION
    from racecraft.worlds.deepracer.driving.reward.lines_paid import lines_paid
    from racecraft.worlds.deepracer.driving.reward.rescore import rows_of

    payer = _payer(request.reward or request.run / REWARD_FUNCTION)
    ticks, track = _ticks((request.run,), request.track)
    rows, has_reward = rows_of(ticks, track)
    paid = rows[has_reward]
    late = np.flatnonzero(np.diff(ticks["unique_episode"].to_numpy()[has_reward], prepend=-1))
    late = late[len(paid) - late <= MAX_TRACED]
    return ExplainedReward(track, lines_paid(payer, track, paid[late[0] if len(late) else -MAX_TRACED :]))


@action
def reward_samples(request: SamplesRequest, progress: Progress = quiet) -> RewardSamples:
    """List rewards to begin with, or print one.

    Examples:

        racecraft reward samples

        racecraft reward samples metres_gained > reward_function.py
    """
    from racecraft.worlds.deepracer.files.reward_samples import describe_sample, read_sample, sample_names

    if request.name is not None:
        return RewardSamples(request.name, read_sample(request.name), {})
    return RewardSamples(None, "", {one: describe_sample(one) for one in sample_names()})


def _files(**paths: Path | None) -> dict[str, str]:
    """Return the files that were written, by kind."""
    return {kind: str(path) for kind, path in paths.items() if path is not None}


def _file(path: Path) -> Path:
    """Return the reward function that a path means: itself, or the one in a folder."""
    return path / "reward_function.py" if path.is_dir() else path


def _payer(path: Path) -> Payer:
    from racecraft.worlds.deepracer.driving.reward.paying import Payer
    from racecraft.worlds.deepracer.env.reward_process import open_reward

    return Payer(open_reward(_file(path), sys.stderr))


def _ticks(logs: Sequence[Path], track: str | None) -> tuple[pl.DataFrame, Track]:
    """Return the ticks of logs, and the circuit that they were driven on."""
    from racecraft.worlds.deepracer.analysis.logs import circuit_of
    from racecraft.worlds.deepracer.logs import read

    found = read(list(logs))
    return found.require_ticks(), circuit_of(found, track)
