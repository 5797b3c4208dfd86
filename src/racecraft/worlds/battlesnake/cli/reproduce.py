"""`racecraft snakes reproduce`: the source's published comparison, made again on this machine."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.worlds.battlesnake.cli.options import JSON

if TYPE_CHECKING:
    from racecraft.jobs.reproduction.comparison import Asked, Result

CHART, PAGE = "chart.png", "page.html"
COMPARISONS = ("aws",)


def reproduce(
    which: Annotated[str, typer.Argument(metavar="WHICH", help="aws: the chart of its post on distributed training.")],
    minutes: Annotated[float, typer.Option(help="Each row trains so long.")] = 2.0,
    gym: Annotated[
        str, typer.Option(help="starter-pack: the source's own rules and observations; exact: the official rules.")
    ] = "starter-pack",
    row: Annotated[
        list[str] | None,
        typer.Option(
            help="Only these rows: old, dqn-1-core, dqn-all-cores, apex-homogeneous, apex-heterogeneous, ours."
        ),
    ] = None,
    games: Annotated[int, typer.Option(help="Whole games behind each mean.")] = 100,
    seed: Annotated[int, typer.Option(help="Of every row.")] = 1,
    run: Annotated[
        Path | None,
        typer.Option(help="Folder of the comparison; by default reproductions/aws-GYM-MINUTES-SEED."),
    ] = None,
    json: JSON = False,
) -> None:
    """Train the old snake, the four of the chart and ours, each as long, and draw AWS's chart of them.

    What is finished is kept; Ctrl-C ends it, and the same command goes on. Nothing else should run meanwhile.

    Examples:

        racecraft snakes reproduce aws

        racecraft snakes reproduce aws --gym exact --minutes 5

        racecraft snakes reproduce aws --minutes 10 --row old --row apex-heterogeneous
    """
    from racecraft.cli.output import print_json, say
    from racecraft.contract.errors import SettingError, nearest
    from racecraft.formats.reproduction import write_table
    from racecraft.jobs.reproduction.comparison import Asked, command_of, compare, usable_cores
    from racecraft.jobs.reproduction.rows import require_rows, rows_for
    from racecraft.training.versions import machine
    from racecraft.worlds.battlesnake.analysis.learning_chart import write_chart, write_page

    if which not in COMPARISONS:
        raise SettingError(f"'{which}': expected aws. {nearest(which, COMPARISONS)}")
    asked = Asked(gym, minutes, games, seed)
    cores = len(usable_cores())
    rows = require_rows(rows_for(gym, cores), row or [])
    folder = run or Path("reproductions") / f"{which}-{gym}-{minutes:g}-{seed}"
    commands = {one.name: shlex.join(("racecraft", *command_of(one, asked, folder / one.name))) for one in rows}
    results: list[Result] = []

    def tell(text: str) -> None:
        say(text, quiet_stdout=json)

    def finished(so_far: list[Result]) -> None:
        results[:] = so_far
        write_table(folder, vars(asked), machine(), so_far)
        write_chart(folder / CHART, so_far)
        write_page(folder / PAGE, so_far, _facts(asked, cores, len(rows), len(so_far) - 2), commands)

    tell(f"{folder}: {len(rows)} rows of {minutes:g} min on {cores} cores, and games after each")
    if cores == 1:
        tell("one core: no row with a core for the learner alone")
    try:
        compare(folder, asked, rows, tell, finished)
    except KeyboardInterrupt:
        tell(f"broken off; the same command goes on. What is finished: {folder / PAGE}")
        raise typer.Exit(130) from None
    if json:
        print_json(_told(folder, results, asked))
        return
    _print(results)
    print(f"chart: {folder / CHART}\npage: {folder / PAGE}\ntable: {folder / 'table.csv'}")


def _facts(asked: Asked, cores: int, rows: int, done: int) -> dict[str, Any]:
    from racecraft.jobs.reproduction.rows import GYMS
    from racecraft.training.versions import machine, versions

    return {
        "world": f"{asked.gym}: {GYMS[asked.gym]}; 11 x 11, 5 snakes",
        "minutes of each row": f"{asked.minutes:g}",
        "games behind each mean": asked.games,
        "seed": asked.seed,
        "rows finished": f"{done} of {rows}",
        "cores used": cores,
        "machine": ", ".join(f"{name} {value}" for name, value in machine().items()),
        "versions": ", ".join(f"{name} {value}" for name, value in versions().items()),
    }


def _told(folder: Path, results: list[Result], asked: Asked) -> dict[str, Any]:
    from dataclasses import asdict

    from racecraft.formats.reproduction import best_over_old

    return {
        "folder": str(folder),
        "asked": asdict(asked),
        "best_over_old": [asdict(one) for one in best_over_old([row for row, _ in results])],
        "rows": [asdict(one) for one, _ in results],
        "chart": str(folder / CHART),
        "page": str(folder / PAGE),
    }


def _print(results: list[Result]) -> None:
    from rich.table import Table

    from racecraft.cli.output import print_table
    from racecraft.worlds.battlesnake.analysis.learning_chart import sentences, table_lines

    heads, lines = table_lines(results)
    table = Table(box=None, pad_edge=False, header_style="bold")
    for number, head in enumerate(heads):
        table.add_column(head, justify="right" if number > 1 else "left")
    for line in lines:
        table.add_row(*line)
    print_table(table)
    for sentence in sentences(results):
        print(f"- {sentence}")
