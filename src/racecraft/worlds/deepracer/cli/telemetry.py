"""`racecraft telemetry`: where laps lose time, and which corner to work on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import typer

from racecraft.cli.option_groups import takes_groups

if TYPE_CHECKING:
    import polars as pl

    from racecraft.worlds.deepracer.driving.telemetry.laps import Laps
    from racecraft.worlds.deepracer.driving.telemetry.losses import LapComparison
    from racecraft.worlds.deepracer.driving.telemetry.reference import Reference
    from racecraft.worlds.deepracer.driving.telemetry.timing import LapTiming
    from racecraft.worlds.deepracer.logs import Logs
    from racecraft.worlds.deepracer.tracks.track import Track

BEST = "best"
SHOWN_LAPS = 10


@dataclass(frozen=True)
class LapOptions:
    """Which laps count."""

    PANEL: ClassVar[str] = "Which laps count"

    phase: Annotated[str | None, typer.Option(help="training, evaluation or leaderboard.")] = None
    iterations: Annotated[
        str | None, typer.Option(help="Iterations of the training, such as 10..20, counted as in AWS's file names.")
    ] = None
    quarter: Annotated[
        int | None, typer.Option(help="Quarter of the episodes, 1 to 4: how early or late in the training.")
    ] = None
    begins: Annotated[
        str | None, typer.Option(help="line: at the start line; rest: from standstill; flying: at speed.")
    ] = None
    within: Annotated[
        float | None, typer.Option(min=0.0, help="At most so many per cent slower than the fastest lap.")
    ] = None
    fastest: Annotated[int | None, typer.Option(min=1, help="So many laps, the fastest.")] = None
    clean: Annotated[bool, typer.Option("--clean", help="Only laps in which the car never left the road.")] = False

    turn: Annotated[str | None, typer.Option(help="Turn 3 with the straight behind it takes 1.6 s at most: 3=1.6.")] = (
        None
    )
    top_speed: Annotated[float | None, typer.Option(help="The car drives so fast somewhere, m/s.")] = None
    mean_reward: Annotated[float | None, typer.Option(help="A tick pays so much on average.")] = None

    def rows(self, laps: Laps) -> Any:
        """Return the rows of the laps that count.

        Raises:
            SettingError: A value that no lap can have.
        """
        from racecraft.contract.errors import SettingError, nearest
        from racecraft.worlds.deepracer.driving.telemetry.filters import LapFilter, read_iterations, read_turn
        from racecraft.worlds.deepracer.logs.columns import PHASES

        if self.phase is not None and self.phase not in PHASES:
            raise SettingError(
                "--phase is {phase!r}; expected one of {phases}. {hint}", phase=self.phase, phases=", ".join(PHASES),
                hint=nearest(self.phase, PHASES),
            )  # fmt: skip
        span = None if self.iterations is None else read_iterations(self.iterations)
        chosen = LapFilter(
            phase=self.phase,
            iterations=span,
            quarter=self.quarter,
            begins=self.begins,
            within_percent=self.within,
            fastest=self.fastest,
            clean=self.clean,
            turn=None if self.turn is None else read_turn(self.turn),
            top_speed_mps=self.top_speed,
            mean_reward=self.mean_reward,
        )
        return chosen.rows(laps)


@takes_groups
def telemetry(
    runs: Annotated[
        list[Path],
        typer.Argument(
            help="Run folder, DeepRacer model or log folder, .tar.gz, log or trace; several: rounds of one training."
        ),
    ],
    *,
    against: Annotated[
        str | None,
        typer.Option(
            help="What the lap is compared with: another run or log (its fastest lap), best (the best known lap, "
            "planned again in some seconds), or a line from `racecraft line --out LINE.csv`. By default the best "
            "corners of all laps together."
        ),
    ] = None,
    lap: Annotated[int, typer.Option(min=1, help="Which lap: 1 is the fastest of those that count.")] = 1,
    sectors: Annotated[int, typer.Option(min=1, max=20, help="Sectors of equal length.")] = 3,
    which: LapOptions,
    track: Annotated[
        str | None, typer.Option(help="The track it was driven on, or its waypoint file; by default it is found.")
    ] = None,
    car: Annotated[
        str | None,
        typer.Option(help="For --against best: v4, v5-classic or v6; by default the run's, or the metadata's version."),
    ] = None,
    page: Annotated[Path | None, typer.Option(help="Write one page (.html) that works offline.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write a row a lap, with sector and corner times.")] = None,
    film: Annotated[
        Path | None, typer.Option(help="Film the lap and its ghosts from above into this MP4 file.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Tell where laps lose time, and which corner to work on.

    Corners are found by curvature and numbered from the start line. Logs of AWS and runs of ours go in alike.

    Examples:

        racecraft telemetry runs/reinvent_base-1

        racecraft telemetry runs/reinvent_base-1 --against best --page laps.html

        racecraft telemetry my-aws-model --against runs/reinvent_base-1 --phase evaluation

        racecraft telemetry round-1 round-2 --begins line --fastest 20 --csv laps.csv
    """
    from racecraft.cli.output import print_json, say
    from racecraft.worlds.deepracer.driving.telemetry.export import facts_of
    from racecraft.worlds.deepracer.driving.telemetry.losses import compare_lap
    from racecraft.worlds.deepracer.driving.telemetry.timing import time_laps
    from racecraft.worlds.deepracer.logs import read

    found = read(runs)
    for damage in found.damaged[:10]:
        say(str(damage), quiet_stdout=True)
    ticks = found.require_ticks()
    circuit = _circuit(found, ticks, track)
    laps = _laps_that_count(ticks, circuit, which)
    timing = time_laps(laps, sectors)
    row = _row_of(timing, lap)
    reference = _reference(against, timing, found, car)
    compared = compare_lap(timing, row, reference)
    facts = facts_of(compared) | _written(compared, csv, film, json)
    if page is not None:
        from racecraft.worlds.deepracer.analysis.telemetry_page import write_telemetry_page

        title = ", ".join(path.resolve().name for path in runs)
        write_telemetry_page(page, compared, title, ticks)
        facts["page"] = str(page)
    if json:
        print_json(facts)
    else:
        _print(compared, facts)


def _circuit(found: Logs, ticks: pl.DataFrame, track: str | None) -> Track:
    """Return the track of a log, as it was driven; all its rounds must be of it."""
    from racecraft.contract.errors import SettingError
    from racecraft.worlds.deepracer.analysis.logs import find_track
    from racecraft.worlds.deepracer.analysis.logs.circuit import SAME_LENGTH_M

    lengths = ticks.group_by("round").agg(length=_median_length())
    if lengths.height > 1 and lengths["length"].max() - lengths["length"].min() > SAME_LENGTH_M:  # type: ignore[operator]
        told = ", ".join(f"{length:.2f} m" for length in lengths.sort("round")["length"])
        raise SettingError(
            "the runs were driven on several tracks ({told}); expected one. Name runs of one track.", told=told
        )
    return find_track(ticks, track if track is not None else found.about.get("world"))


def _median_length() -> pl.Expr:
    import polars as pl

    return pl.col("track_length_m").median()


def _laps_that_count(ticks: pl.DataFrame, circuit: Track, which: LapOptions) -> Laps:
    from racecraft.contract.errors import SettingError
    from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps

    laps = find_laps(ticks, circuit)
    rows = which.rows(laps)
    if not len(laps):
        raise SettingError(
            "none of the {episodes} episodes is a full lap of {name}; expected one at least. "
            "Let the training go on; `racecraft why` tells where its laps end.",
            episodes=laps.episodes,
            name=circuit.name,
        )
    if not len(rows):
        raise SettingError(
            "none of the {count} full laps is left by the options; expected one at least.", count=len(laps)
        )
    return laps.take(rows)


def _row_of(timing: LapTiming, lap: int) -> int:
    import numpy as np

    from racecraft.contract.errors import SettingError

    if lap > len(timing.laps):
        raise SettingError(
            "--lap is {lap}; expected 1 to {count}, the laps that count.", lap=lap, count=len(timing.laps)
        )
    return int(np.argsort(timing.laps.lap_seconds, kind="stable")[lap - 1])


def _reference(against: str | None, timing: LapTiming, found: Logs, car: str | None) -> Reference:
    """Return the lap that is compared with."""
    import numpy as np

    from racecraft.contract.errors import SettingError
    from racecraft.worlds.deepracer.driving.telemetry import reference as references
    from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
    from racecraft.worlds.deepracer.logs import read

    track = timing.laps.track
    if against is None:
        return references.of_best_zones(timing)
    if against == BEST:
        return _best_known(timing, found, car)
    if references.is_line_file(Path(against)):
        return references.of_line_file(Path(against), track)
    others = find_laps(_on(read(against).require_ticks(), track, against), track)
    if not len(others):
        raise SettingError("--against {against}: holds no full lap; expected one to compare with.", against=against)
    fastest = int(np.argmin(others.lap_seconds))
    name = f"the fastest lap of {Path(against).resolve().name}"
    return references.of_lap(others, fastest, name)


def _on(ticks: pl.DataFrame, track: Track, against: str) -> pl.DataFrame:
    """Return ticks that were driven on a track, the same way round."""
    from racecraft.contract.errors import SettingError
    from racecraft.worlds.deepracer.analysis.logs import find_track

    other = find_track(ticks)
    if abs(other.length - track.length) > 0.1 or other.is_ccw != track.is_ccw:
        raise SettingError(
            "--against {against}: was driven on {name} ({direction}); expected {name_2} ({direction_2}).",
            against=against,
            name=other.name,
            direction=other.direction,
            name_2=track.name,
            direction_2=track.direction,
        )
    return ticks


def _best_known(timing: LapTiming, found: Logs, car: str | None) -> Reference:
    """Return the best known lap of the car and its top speed, planned again."""
    from racecraft.contract.errors import SettingError, nearest
    from racecraft.worlds.deepracer.driving.telemetry.reference import of_known_lap
    from racecraft.worlds.deepracer.env.actions import action_space
    from racecraft.worlds.deepracer.env.vehicle import PROFILES
    from racecraft.worlds.deepracer.files.model_metadata import action_space_from_aws, car_for_version

    if car is not None and car not in PROFILES:
        raise SettingError(
            "--car is {car!r}; expected one of {profiles}. {hint}",
            car=car,
            profiles=", ".join(PROFILES),
            hint=nearest(car, PROFILES),
        )
    profile = car or found.about.get("car") or car_for_version(found.about.get("version"))
    told = found.about.get("action_space")
    actions = None if told is None else action_space(action_space_from_aws(told))
    fastest = float(timing.laps.throttle_mps.max()) if actions is None else actions.fastest
    reference = of_known_lap(timing.laps.track, profile, fastest, actions)
    if reference is None:
        raise SettingError(
            "--against best: no lap of {name} is known for {profile} up to {fastest:g} m/s, and "
            "none could be planned; expected another --car, or a run to compare with.",
            name=timing.laps.track.name,
            profile=profile,
            fastest=fastest,
        )
    return reference


def _written(compared: LapComparison, csv: Path | None, film: Path | None, json: bool) -> dict[str, str]:
    """Write what was asked for; return where it lies."""
    from racecraft.worlds.deepracer.driving.telemetry.export import write_lap_table

    written: dict[str, str] = {}
    if csv is not None:
        write_lap_table(csv, compared.timing)
        written["csv"] = str(csv)
    if film is not None:
        from racecraft.cli.output import counting
        from racecraft.worlds.deepracer.analysis.ghosts import film_ghosts

        with counting("pictures", quiet_stdout=json) as count:
            written |= {kind: str(path) for kind, path in film_ghosts(film, compared, count).items()}
    return written


def _print(compared: LapComparison, facts: dict[str, Any]) -> None:
    from racecraft.cli.output import print_table

    laps = compared.timing.laps
    title = laps.track.title or laps.track.name
    of = f"{len(laps)} full lap{'s' if len(laps) != 1 else ''}"
    print(f"{title}, {of}; lap {facts['lap']['name']} beside {compared.reference.name}")
    print(f"\n{facts['advice']}\n")
    print_table(_zone_table(facts))
    print()
    print_table(_lap_table(facts))
    print(f"Best sectors together: {facts['theoretical_best_seconds']:.2f} s.")
    for kind in ("page", "csv", "film", "strip"):
        if kind in facts:
            print(f"{kind}: {facts[kind]}")


def _zone_table(facts: dict[str, Any]) -> Any:
    table = _table("corner", "lap", "reference", "lost", "slowest", "there", "best", "spread", "with lap")
    for zone in facts["corners"]:
        table.add_row(
            zone["name"], _figure(zone["seconds"]), _figure(zone["reference_seconds"]),
            _figure(zone["lost_seconds"], "+.2f"), _figure(zone["slowest_mps"], ".1f"),
            _figure(zone["reference_slowest_mps"], ".1f"), _figure(zone["best_seconds"]),
            _figure(zone["spread_seconds"]), _figure(zone["correlation"], "+.2f"),
        )  # fmt: skip
    if facts["start_seconds"]:
        table.add_row("standing start", "", "", _figure(facts["start_seconds"], "+.2f"), "", "", "", "", "")
    return table


def _lap_table(facts: dict[str, Any]) -> Any:
    count = len(facts["best_sector_seconds"])
    table = _table("lap", *(f"sector {k + 1}" for k in range(count)), "time", "gap")
    for one in facts["laps"][:SHOWN_LAPS]:
        sectors = [
            f"{seconds:.2f}{'*' if seconds <= best + 1e-9 else ' '}"
            for seconds, best in zip(one["sector_seconds"], facts["best_sector_seconds"], strict=True)
        ]
        table.add_row(one["name"], *sectors, f"{one['seconds']:.2f}", _figure(one["gap_seconds"], "+.2f"))
    return table


def _table(*heads: str) -> Any:
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for head in heads:
        table.add_column(head, justify="left" if head in ("corner", "lap") and head == heads[0] else "right")
    return table


def _figure(value: float | None, form: str = ".2f") -> str:
    return "–" if value is None else f"{value:{form}}"
