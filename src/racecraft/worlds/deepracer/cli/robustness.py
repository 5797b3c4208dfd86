"""The half of `racecraft evaluate` that disturbs: what of the lap survives a level of variation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

import typer

from racecraft.cli.option_groups import flags

TRIES, MAX_TRIES = 20, 1000
CHECKPOINT = "best"
"""Where nobody says."""


@dataclass(frozen=True)
class DisturbedDrive:
    """How a car is judged under disturbances, as it was typed."""

    PANEL: ClassVar[str] = "Under disturbances"

    under: Annotated[
        str | None,
        typer.Option(help="Judge it under variation of a level: aws, light or strong; one episode from every start."),
    ] = None
    each: Annotated[bool, typer.Option("--each", help="Under each of the level's disturbances by itself as well.")] = (
        False
    )
    only: Annotated[
        list[str] | None,
        typer.Option(help="Under this disturbance by itself, such as glare; may be repeated."),
    ] = None
    tries: Annotated[
        int | None,
        typer.Option(min=2, max=MAX_TRIES, help=f"Starts for each of them, spread over the lap; {TRIES} by default."),
    ] = None

    def check(self, others: Mapping[str, Any]) -> None:
        """Refuse, before the drive, levels and disturbances that are none, and options that could do nothing.

        Args:
            others: Options that an undisturbed evaluation has besides; None: not typed.

        Raises:
            SettingError: One of them.
        """
        from racecraft.contract.errors import SettingError
        from racecraft.worlds.deepracer.env.variation import LEVELS, checked_disturbance, checked_level

        if self.under is None:
            idle = [name for name, value in flags(self).items() if value is not None]
            if idle:
                levels = " or ".join(name for name in LEVELS if name != "off")
                raise SettingError(
                    "{idle} says how to judge under a level; expected --under too: {levels}.",
                    idle=idle[0],
                    levels=levels,
                )
            return
        checked_level(self.under)
        for name in self.only or ():
            checked_disturbance(name)
        foreign = [name for name, value in others.items() if value is not None]
        if foreign:
            raise SettingError(
                "--under drives one episode from every start and films nothing, so {foreign} has no say "
                "there; expected one or the other.",
                foreign=", ".join(foreign),
            )

    def judge(self, run: Path, checkpoint: str | None, track: str | None, picture: Path | None, json: bool) -> None:
        """Drive, print the table, draw the bars and keep the figures beside them."""
        from json import dumps

        from racecraft.cli.output import counting, print_json, say
        from racecraft.formats.atomic import make_folder, write_atomic
        from racecraft.formats.run_folder import RunFolder
        from racecraft.worlds.deepracer.analysis.robustness import draw_robustness
        from racecraft.worlds.deepracer.evaluation.robustness import (
            ALL,
            Bar,
            RobustnessReport,
            judge_under,
            names_asked,
        )
        from racecraft.worlds.deepracer.players.trained_car import load_trained_car
        from racecraft.worlds.deepracer.tracks.catalogue import load_track

        assert self.under is not None
        asked = RunFolder.open(run).read_job().get("evaluate", {})
        car = load_trained_car(run, checkpoint or asked.get("checkpoint", CHECKPOINT))
        circuit = load_track(track) if track else car.trained_on
        tries = self.tries or TRIES
        names = names_asked(car, self.under, self.each, tuple(self.only or ()))
        bars: list[Bar] = []
        say(f"Driving {tries} starts undisturbed, then under {', '.join([*names, ALL])} …", quiet_stdout=True)
        with counting("episodes", quiet_stdout=True) as count:
            for bar in judge_under(car, circuit, self.under, names, tries, on_progress=count):
                bars.append(bar)
                say(
                    f"{bar.name}: {bar.report.full_laps} of {tries} laps ({len(bars)} of {len(names) + 2})",
                    quiet_stdout=True,
                )
        report = RobustnessReport(self.under, tuple(bars)).as_dictionary()
        make_folder(car.run.evaluations)
        stem = f"{circuit.name}-{car.checkpoint.iteration}-under-{self.under}"
        picture, figures = picture or car.run.evaluations / f"{stem}.png", car.run.evaluations / f"{stem}.json"
        place = f"checkpoint {car.checkpoint.iteration}, on {circuit.title or circuit.name}"
        note = f"{car.run.path.name}, {place}, {tries} starts a bar"
        draw_robustness(report["bars"], f"What survives of the lap: variation {self.under}", picture, note)
        facts = {"run": str(run), "checkpoint": car.checkpoint.iteration, "track": circuit.name, **report}
        write_atomic(figures, dumps(facts, indent=2) + "\n")
        if json:
            print_json({**facts, "picture": str(picture), "figures": str(figures)})
            return
        print(f"{run}, {place}, under {self.under}:")
        _print_bars(report["bars"])
        print(f"picture: {picture}")
        print(f"figures: {figures}")


def _print_bars(bars: list[dict[str, Any]]) -> None:
    from rich.table import Table

    from racecraft.cli.output import print_table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("disturbance", "laps", "95 % of laps", "mean progress", "mostly ended"):
        table.add_column(title, justify="left" if title in ("disturbance", "mostly ended") else "right")
    for bar in bars:
        ended = max(bar["ended"], key=bar["ended"].get).replace("_", " ")
        interval = f"{100 * bar['full_laps_share_low']:.0f} to {100 * bar['full_laps_share_high']:.0f} %"
        laps, progress = f"{bar['full_laps']}/{bar['tries']}", f"{bar['mean_progress_percent']:.1f} %"
        table.add_row(bar["disturbance"], laps, interval, progress, ended)
    print_table(table)
