"""AWS's races of 2019 to 2025, from the user's copy of the public archive."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.evaluation.laps import LapReport
    from racecraft.worlds.deepracer.files.leaderboards import Leaderboard
    from racecraft.worlds.deepracer.players.trained_car import TrainedCar
    from racecraft.worlds.deepracer.tracks.track import Track


@dataclass(frozen=True, kw_only=True)
class LeaderboardsRequest(Request):
    """Which races are listed, and which run is set beside them."""

    folder: Path = argument("Your copy of the archive, or its folder with leaderboards.csv.")
    run: str | None = option(None, "RUN[:best|last|N]: let it drive, and set its laps beside the races.")
    track: str | None = option(None, "Only races on this track; with --run by default that of its training.")
    laps: int = option(5, "Laps that the run drives.", low=1, high=100)


@action
def leaderboards(request: LeaderboardsRequest, progress: Progress = quiet) -> Figures:
    """List the races of a copy of AWS's public leaderboards, or set a run's laps beside those on its track.

    Examples:

        racecraft leaderboards deepracer-race-data

        racecraft leaderboards deepracer-race-data --track reInvent2019_track

        racecraft leaderboards deepracer-race-data --run runs/reInvent2019_track-1 --laps 10
    """
    from racecraft.worlds.deepracer.evaluation.history import OTHER_PHYSICS
    from racecraft.worlds.deepracer.files.leaderboards import read_leaderboards

    boards = read_leaderboards(request.folder)
    if request.run is None:
        return Figures({"races": [_row(board) for board in _on_track(boards, request.track)], "track": request.track})
    car, circuit = _car_and_circuit(request.run, request.track)
    on_track = _on_track(boards, circuit.name)
    report = _driven(car, circuit, request.laps, progress)
    rows = [_placed_row(board, report, car.settings.race.type) for board in on_track]
    about = {"run": request.run, "laps": report.as_dictionary(), "note": OTHER_PHYSICS}
    return Figures({"races": rows, "track": circuit.name, **about})


def _car_and_circuit(run: str, track: str | None) -> tuple[TrainedCar, Track]:
    """Return the car of a run, and the circuit that it is to drive on: the one it was trained on if none is named."""
    from racecraft.formats.checkpoint_ranking import split_source
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car

    named = _circuit(track) if track else None
    car = load_trained_car(*split_source(run))
    return car, named or car.trained_on


def _driven(car: TrainedCar, circuit: Track, laps: int, progress: Progress) -> LapReport:
    from racecraft.worlds.deepracer.evaluation.laps import judge_laps

    progress(f"Driving {laps} laps on {circuit.name} …")
    return judge_laps(car.policy, car.world(circuit, num_cars=1, start_shares=[0.0], laps=laps), laps)


def _circuit(track: str) -> Track:
    """Return a circuit.

    Raises:
        SettingError: It is one of the archive's that nobody has.
        TrackError: There is no such circuit.
    """
    from racecraft.contract.errors import SettingError, TrackError
    from racecraft.worlds.deepracer.files.leaderboards import WITHOUT_ROUTE
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    try:
        return load_track(track)
    except TrackError as error:
        if track not in WITHOUT_ROUTE:
            raise
        raise SettingError(
            "No route file of '{track}', the track of a race of 2019, is known here; racers prepared for it on "
            "{without_route}, as far as known another circuit. Expected a route file of your own: "
            "--track {track}.npy.",
            track=track,
            without_route=WITHOUT_ROUTE[track],
        ) from error


def _on_track(boards: list[Leaderboard], track: str | None) -> list[Leaderboard]:
    """Return the races on a track; all where none is named.

    Raises:
        SettingError: There is none on it.
    """
    from racecraft.contract.errors import SettingError, nearest

    if track is None:
        return boards
    same = _names_of(track)
    found = [board for board in boards if not same.isdisjoint(_names_of(board.track))]
    if not found:
        known = sorted({board.track for board in boards})
        raise SettingError(
            "the archive has no race on the track '{track}'. {hint}", track=track, hint=nearest(track, known)
        )
    return found


def _names_of(track: str) -> set[str]:
    """Return the names of a track of the archive: its own, and the catalogue's where that was renamed."""
    from racecraft.worlds.deepracer.tracks.catalogue import known_name

    return {track.casefold(), (known_name(track) or track).casefold()}


def _row(board: Leaderboard) -> dict[str, Any]:
    """Return a race as plain values."""
    from racecraft.worlds.deepracer.files.leaderboards import TIMINGS

    entries = board.entries()
    return {
        "date": board.launched.date().isoformat(), "name": board.name, "division": board.division,
        "track": board.track, "type": board.race_type, "timing": TIMINGS[board.timing], "laps": board.laps,
        "racers": len(entries), "winner": entries[0].alias if entries else None,
        "winner_seconds": entries[0].score_seconds if entries else None,
    }  # fmt: skip


def _placed_row(board: Leaderboard, report: LapReport, driven: str) -> dict[str, Any]:
    """Return a race as plain values, with where own laps would stand."""
    from racecraft.worlds.deepracer.evaluation.history import placed

    place = placed(report, board, driven)
    own = {} if place is None else {"median_seconds": place.median_seconds}
    return {
        **_row(board), **own, "own_seconds": None if place is None else place.own_seconds,
        "own_rank": None if place is None else place.rank,
    }  # fmt: skip
