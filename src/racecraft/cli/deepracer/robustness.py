"""The half of `racecraft evaluate` that disturbs: what of the lap survives a level of variation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from racecraft.players.deepracer.trained_car import TrainedCar
    from racecraft.tracks.track import Track


def evaluate_under(
    car: TrainedCar,
    circuit: Track,
    level: str,
    *,
    each: bool,
    named: list[str],
    tries: int,
    picture: Path | None,
    json: bool,
) -> None:
    """Judge a car under disturbances, print the table, draw the bars and keep the figures beside them.

    Raises:
        SettingError: There is no such level, or no such disturbance.
    """
    from json import dumps as as_json

    from racecraft.analysis.deepracer.robustness import draw_robustness
    from racecraft.cli.output import print_json, say
    from racecraft.evaluation.deepracer.robustness import RobustnessReport, judge_under, names_asked
    from racecraft.formats.whole import make_folder, write_whole

    names = names_asked(car, level, each, named)
    bars = []
    for bar in judge_under(car, circuit, level, names, tries):
        say(f"{bar.name}: {bar.report.full_laps} of {tries} laps", quiet_stdout=True)
        bars.append(bar)
    report = RobustnessReport(level, tuple(bars)).as_dictionary()
    stem = f"{circuit.name}-{car.checkpoint.iteration}-under-{level}"
    picture = picture or car.run.evaluations / f"{stem}.png"
    figures = car.run.evaluations / f"{stem}.json"
    make_folder(car.run.evaluations)
    title = f"What survives of the lap: variation {level}"
    note = f"{car.run.path.name}, checkpoint {car.checkpoint.iteration}, on {circuit.title or circuit.name}"
    draw_robustness(report["bars"], title, picture, f"{note}, {tries} starts a bar")
    facts: dict[str, Any] = {
        "run": str(car.run.path),
        "checkpoint": car.checkpoint.iteration,
        "track": circuit.name,
        **report,
        "picture": str(picture),
        "figures": str(figures),
    }
    write_whole(figures, as_json(facts, indent=2) + "\n")
    if json:
        print_json(facts)
        return
    print(f"{car.run.path}, checkpoint {car.checkpoint.iteration}, on {circuit.title or circuit.name}, under {level}:")
    _print_bars(report["bars"])
    print(f"picture: {picture}")
    print(f"figures: {figures}")


def _print_bars(bars: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("disturbance", "laps", "mean progress", "95 % interval", "mostly ended"):
        table.add_column(title, justify="left" if title in ("disturbance", "mostly ended") else "right")
    for bar in bars:
        ended = max(bar["ended"], key=bar["ended"].get).replace("_", " ")
        interval = f"{bar['mean_progress_low']:.1f} to {bar['mean_progress_high']:.1f}"
        laps, progress = f"{bar['full_laps']}/{bar['tries']}", f"{bar['mean_progress_percent']:.1f} %"
        table.add_row(bar["disturbance"], laps, progress, interval, ended)
    Console().print(table)
