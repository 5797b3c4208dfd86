"""`racecraft leaderboards FOLDER`: AWS's races of 2019 to 2025, from the user's copy of the public archive."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.evaluation.laps import LapReport
    from racecraft.worlds.deepracer.files.leaderboards import Leaderboard
    from racecraft.worlds.deepracer.players.trained_car import TrainedCar
    from racecraft.worlds.deepracer.tracks.track import Track

MOST_ROWS = 25


def leaderboards(
    folder: Annotated[Path, typer.Argument(help="Your copy of the archive, or its folder with leaderboards.csv.")],
    run: Annotated[
        str | None, typer.Option(help="RUN[:best|last|N]: let it drive, and set its laps beside the races.")
    ] = None,
    track: Annotated[
        str | None, typer.Option(help="Only races on this track; with --run by default that of its training.")
    ] = None,
    laps: Annotated[int, typer.Option(min=1, max=100, help="Laps that the run drives.")] = 5,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """List the races of a copy of AWS's public leaderboards, or set a run's laps beside those on its track.

    Examples:

        racecraft leaderboards deepracer-race-data

        racecraft leaderboards deepracer-race-data --track reInvent2019_track

        racecraft leaderboards deepracer-race-data --run runs/reInvent2019_track-1 --laps 10
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.files.leaderboards import read_leaderboards

    boards, report, driven = read_leaderboards(folder), None, ""
    if run is not None:
        car, circuit = _car_and_circuit(run, track)
        track = circuit.name
    shown = _on_track(boards, track)
    if run is not None:
        report, driven = _driven(car, circuit, laps, json), car.settings.race.type
    rows = [_row(board) if report is None else _placed_row(board, report, driven) for board in shown]
    facts: dict[str, Any] = {"races": rows, "track": track}
    if report is not None:
        from racecraft.worlds.deepracer.evaluation.history import OTHER_PHYSICS

        facts |= {"run": run, "laps": report.as_dictionary(), "note": OTHER_PHYSICS}
    if json:
        print_json(facts)
        return
    _print(facts, report)


def _car_and_circuit(run: str, track: str | None) -> tuple[TrainedCar, Track]:
    """Return the car of a run, and the circuit that it is to drive on: the one it was trained on if none is named."""
    from racecraft.formats.checkpoint_ranking import split_source
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car

    named = _circuit(track) if track else None
    car = load_trained_car(*split_source(run))
    return car, named or car.trained_on


def _driven(car: TrainedCar, circuit: Track, laps: int, json: bool) -> LapReport:
    from racecraft.cli.output import say
    from racecraft.worlds.deepracer.evaluation.laps import judge_laps

    say(f"Driving {laps} laps on {circuit.name} …", quiet_stdout=json)
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


def _print(facts: dict[str, Any], report: LapReport | None) -> None:
    from rich.table import Table

    from racecraft.cli.output import print_table

    table = Table(box=None, pad_edge=False, header_style="bold")
    heads = ["launched", "race", "track", "type", "timed by", "racers", "winner", "s"]
    heads += [] if report is None else ["you, s", "place"]
    for head in heads:
        table.add_column(head, justify="right" if head in ("racers", "s", "you, s", "place") else "left")
    rows = facts["races"]
    for row in rows if report is not None else rows[-MOST_ROWS:]:
        timed = row["timing"] if row["laps"] == 1 else f"{row['timing']} of {row['laps']} laps"
        cells = [row["date"], row["name"], row["track"], row["type"].lower().replace("_", " "), timed,
                 str(row["racers"]), row["winner"] or "–", _seconds(row["winner_seconds"])]  # fmt: skip
        if report is not None:
            cells += [_seconds(row["own_seconds"]), "–" if row["own_rank"] is None else str(row["own_rank"])]
        table.add_row(*cells)
    print_table(table)
    if report is None and len(rows) > MOST_ROWS:
        print(f"The latest {MOST_ROWS} of {len(rows)} races; --track NAME shows all on one track, --json all of them.")
    if report is not None:
        print(
            f"{report.full_laps} of {len(report)} laps were driven to the end; a race over several wants so many in a "
            f"row, and one of another kind gives no place. {facts['note']}"
        )


def _seconds(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"
