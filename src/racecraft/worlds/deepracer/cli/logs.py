"""`racecraft logs PATH`: what a log tells, on the terminal, on a page, as a table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.contract.errors import SettingError

if TYPE_CHECKING:
    import polars as pl

    from racecraft.analysis.advice import Advice
    from racecraft.worlds.deepracer.logs import Logs
    from racecraft.worlds.deepracer.tracks.track import Track

MOST_DAMAGE = 10


def logs(
    paths: Annotated[
        list[Path],
        typer.Argument(
            help="Run folder, DeepRacer model or log folder, .tar.gz, log, trace or metrics; several: rounds."
        ),
    ],
    page: Annotated[Path | None, typer.Option(help="Write one interactive page (.html) that works offline.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write every step into this CSV file.")] = None,
    parquet: Annotated[Path | None, typer.Option(help="Write every step into this Parquet file.")] = None,
    track: Annotated[
        str | None, typer.Option(help="The track it was driven on, or its waypoint file; by default it is found.")
    ] = None,
    phase: Annotated[
        str | None, typer.Option(help="training, evaluation or leaderboard, where a loose file does not tell.")
    ] = None,
    reward: Annotated[
        Path | None, typer.Option(help="On the page: what this reward_function.py would have paid for the same laps.")
    ] = None,
    plots: Annotated[
        list[Path] | None, typer.Option(help="On the page: your own plots, a Python file or a folder of them.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Tell what a log holds, whoever wrote it, and what to change before the next training.

    Damaged rows are named with file and line and passed over.

    Examples:

        racecraft logs my-model --page my-model.html

        racecraft logs deepracer-downloads/model.tar.gz --json

        racecraft logs round-1 round-2 --parquet both.parquet

        racecraft logs my-model --page my-model.html --reward new_reward.py --plots my_plots.py
    """
    from racecraft.cli.output import print_json, say
    from racecraft.worlds.deepracer.logs import read

    found = read(paths, phase)
    ticks = found.ticks.collect()
    if not ticks.height and not found.metrics.collect().height:
        found.require_ticks()
    circuit = _circuit(found, ticks, track) if ticks.height else None
    told = _advice(found, ticks, circuit)
    facts = _facts(found, ticks, circuit) | {"advice": [{"found": one.found, "try": one.try_} for one in told]}
    for clause in [str(damage) for damage in found.damaged[:MOST_DAMAGE]]:
        say(clause, quiet_stdout=True)
    if len(found.damaged) > MOST_DAMAGE:
        say(f"and {len(found.damaged) - MOST_DAMAGE} more; --json names them all", quiet_stdout=True)
    if page is None and (reward is not None or plots):
        raise SettingError("--reward and --plots are of the page; expected --page with them, such as --page logs.html.")
    if page is not None:
        title = ", ".join(path.resolve().name for path in paths)
        facts["page"] = _page(found, circuit, page, title, told, reward, plots)
    facts |= _written(found, csv, parquet)
    if json:
        print_json(facts)
        return
    _print(facts)


def _circuit(found: Logs, ticks: pl.DataFrame, track: str | None) -> Track | None:
    from racecraft.worlds.deepracer.analysis.logs import find_track, track_or_none

    return find_track(ticks, track) if track is not None else track_or_none(ticks, found.about.get("world"))


def _facts(found: Logs, ticks: pl.DataFrame, circuit: Track | None) -> dict[str, Any]:
    """Return everything that is told, by name; shares from 0 to 1, times in seconds."""
    facts: dict[str, Any] = {
        "files": len(found.files),
        "ticks": ticks.height,
        "track": circuit.name if circuit is not None else None,
        "reversed": circuit.is_reversed if circuit is not None else None,
        "damaged": [{"file": one.file, "line": one.line, "what": one.what} for one in found.damaged],
        "phases": [],
    }
    if not ticks.height:
        return facts | {"metrics": _metrics(found)}
    facts["phases"] = _phases(ticks)
    return facts


def _advice(found: Logs, ticks: pl.DataFrame, circuit: Track | None) -> list[Advice]:
    """Return what to change before the next training; nothing where no training is told of."""
    import polars as pl

    from racecraft.analysis.learner import learner_of_log
    from racecraft.worlds.deepracer.analysis.logs.advice import advice
    from racecraft.worlds.deepracer.analysis.logs.judged import judged_in_log

    training = ticks.filter(pl.col("phase") == "training")
    if not training.height:
        return []
    judged = judged_in_log(ticks, found.metrics.collect())
    return advice(training, circuit, learner_of_log(found.about), judged)


def _phases(ticks: pl.DataFrame) -> list[dict[str, Any]]:
    import polars as pl

    from racecraft.worlds.deepracer.analysis.logs import simulation_agg

    full = pl.col("complete")
    table = simulation_agg(ticks).group_by("round", "phase", "stream", maintain_order=True).agg(
        pl.col("worker").n_unique().alias("workers"), pl.col("iteration").n_unique().alias("iterations"),
        pl.len().alias("episodes"), pl.col("steps").sum(), full.sum().alias("full_laps"),
        pl.col("seconds").filter(full).min().alias("best_lap_seconds"),
        pl.col("progress_share").mean().alias("mean_progress_share"), pl.col("reward").mean().alias("mean_reward"),
    )  # fmt: skip
    return table.with_columns(pl.col("phase").cast(pl.String)).to_dicts()


def _metrics(found: Logs) -> list[dict[str, Any]]:
    import polars as pl

    done = pl.col("status") == "lap_complete"
    table = found.metrics.group_by("round", "phase", "stream", maintain_order=True).agg(
        pl.len().alias("episodes"), pl.col("iteration").n_unique().alias("iterations"),
        (pl.col("progress_share") >= 1).sum().alias("full_laps"),
        pl.col("seconds").filter(done | (pl.col("progress_share") >= 1)).min().alias("best_lap_seconds"),
        pl.col("progress_share").mean().alias("mean_progress_share"),
    )  # fmt: skip
    return table.with_columns(pl.col("phase").cast(pl.String)).collect().to_dicts()


def _page(
    found: Logs,
    circuit: Track | None,
    page: Path,
    title: str,
    told: Sequence[Advice],
    reward: Path | None,
    plots: list[Path] | None,
) -> str:
    """Write the page; return where it lies."""
    from racecraft.worlds.deepracer.analysis.logs import own_plots
    from racecraft.worlds.deepracer.analysis.logs.page import Extras, write_logs_page
    from racecraft.worlds.deepracer.env.reward_process import open_reward

    metrics = found.metrics.collect()
    extras = Extras(
        damaged=tuple(str(damage) for damage in found.damaged),
        metrics=metrics if metrics.height else None,
        reward=None if reward is None else open_reward(reward, sys.stderr).call,
        own=own_plots(plots or ()),
        advice=told,
    )
    return str(write_logs_page(page, found.require_ticks(), circuit, title, extras))


def _written(found: Logs, csv: Path | None, parquet: Path | None) -> dict[str, Any]:
    """Write the tables that were asked for; return where they lie."""
    from racecraft.worlds.deepracer.logs.tick_export import write_csv, write_parquet

    written: dict[str, Any] = {}
    if csv is not None:
        written["csv"] = str(write_csv(csv, found.require_ticks()))
    if parquet is not None:
        written["parquet"] = str(write_parquet(parquet, found.require_ticks()))
    return written


def _print(facts: dict[str, Any]) -> None:
    where = (
        f"on {facts['track']}{', reversed' if facts['reversed'] else ''}" if facts["track"] else "on an unknown track"
    )
    print(f"{facts['ticks']:,} steps in {facts['files']} file(s), {where}." if facts["ticks"] else "Metrics only.")
    _print_table(facts["phases"] or facts.get("metrics", []))
    if facts["advice"]:
        print("\nBefore the next training:")
    for number, one in enumerate(facts["advice"], 1):
        print(f"{number}. {one['found']}\n   {one['try']}")
    if facts["damaged"]:
        print(f"{len(facts['damaged'])} thing(s) in the files could not be taken as they stand; see above.")
    for kind in ("page", "csv", "parquet"):
        if kind in facts:
            print(f"{kind}: {facts[kind]}")
    if "page" not in facts and facts["ticks"]:
        print("Every plot, to click through: add --page logs.html", file=sys.stderr)


def _print_table(rows: list[dict[str, Any]]) -> None:
    from rich.table import Table

    from racecraft.cli.output import print_table

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("what")
    for title in ("iterations", "episodes", "full laps", "best lap", "mean progress"):
        table.add_column(title, justify="right")
    several = len({row["round"] for row in rows}) > 1
    for row in rows:
        best = row["best_lap_seconds"]
        table.add_row(
            (f"round {row['round']}, " if several else "") + f"{row['phase']} {row['stream']}".strip(),
            f"{row['iterations']:,}", f"{row['episodes']:,}", f"{row['full_laps']:,}",
            "-" if best is None else f"{best:.2f} s", f"{100 * row['mean_progress_share']:.1f} %",
        )  # fmt: skip
    print_table(table)
