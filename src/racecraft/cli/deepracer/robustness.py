"""The half of `racecraft evaluate` that disturbs: what of the lap survives a level of variation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

TRIES = 20
CHECKPOINT = "best"
"""Where nobody says."""


@dataclass(frozen=True)
class DisturbedDrive:
    """How a car is judged under disturbances, as it was typed."""

    level: str | None
    """None: it is not."""
    each: bool
    only: tuple[str, ...]
    tries: int | None

    def given(self) -> dict[str, Any]:
        """Return the options by name; None: not typed."""
        return {"--under": self.level, "--each": self.each or None, "--only": self.only or None, "--tries": self.tries}

    def check(self, others: Mapping[str, Any]) -> None:
        """Refuse, before the drive, levels and disturbances that are none, and options that could do nothing.

        Args:
            others: Options that an undisturbed evaluation has besides; None: not typed.

        Raises:
            SettingError: One of them.
        """
        from racecraft.contract.errors import SettingError
        from racecraft.envs.deepracer.variation import LEVELS, checked_disturbance, checked_level

        if self.level is None:
            idle = [name for name, value in self.given().items() if value is not None]
            if idle:
                levels = " or ".join(name for name in LEVELS if name != "off")
                raise SettingError(f"{idle[0]} says how to judge under a level; expected --under too: {levels}.")
            return
        checked_level(self.level)
        for name in self.only:
            checked_disturbance(name)
        foreign = [name for name, value in others.items() if value is not None]
        if foreign:
            raise SettingError(
                f"--under drives one episode from every start and films nothing, so {', '.join(foreign)} has no say "
                "there; expected one or the other."
            )

    def judge(self, run: Path, checkpoint: str | None, track: str | None, picture: Path | None, json: bool) -> None:
        """Drive, print the table, draw the bars and keep the figures beside them."""
        from json import dumps

        from racecraft.analysis.deepracer.robustness import draw_robustness
        from racecraft.cli.output import print_json, say
        from racecraft.evaluation.deepracer.robustness import RobustnessReport, judge_under, names_asked
        from racecraft.formats.run_folder import RunFolder
        from racecraft.formats.whole import make_folder, write_whole
        from racecraft.players.deepracer.trained_car import load_trained_car
        from racecraft.tracks.catalogue import load_track

        assert self.level is not None
        asked = RunFolder.open(run).read_job().get("evaluate", {})
        car = load_trained_car(run, checkpoint or asked.get("checkpoint", CHECKPOINT))
        circuit = load_track(track) if track else car.trained_on
        tries = self.tries or TRIES
        bars = []
        for bar in judge_under(car, circuit, self.level, names_asked(car, self.level, self.each, self.only), tries):
            say(f"{bar.name}: {bar.report.full_laps} of {tries} laps", quiet_stdout=True)
            bars.append(bar)
        report = RobustnessReport(self.level, tuple(bars)).as_dictionary()
        make_folder(car.run.evaluations)
        stem = f"{circuit.name}-{car.checkpoint.iteration}-under-{self.level}"
        picture, figures = picture or car.run.evaluations / f"{stem}.png", car.run.evaluations / f"{stem}.json"
        place = f"checkpoint {car.checkpoint.iteration}, on {circuit.title or circuit.name}"
        note = f"{car.run.path.name}, {place}, {tries} starts a bar"
        draw_robustness(report["bars"], f"What survives of the lap: variation {self.level}", picture, note)
        facts = {"run": str(run), "checkpoint": car.checkpoint.iteration, "track": circuit.name, **report}
        write_whole(figures, dumps(facts, indent=2) + "\n")
        if json:
            print_json({**facts, "picture": str(picture), "figures": str(figures)})
            return
        print(f"{run}, {place}, under {self.level}:")
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
