"""`racecraft tracks`: the catalogue of circuits."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(help="List the tracks, look at one.", no_args_is_help=True)


@app.command("list")
def list_tracks(
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line.")] = False,
) -> None:
    """List every track by name, with length, width and direction."""
    from rich.console import Console
    from rich.table import Table

    from racecraft.cli.output import print_json
    from racecraft.tracks.catalogue import names, summary

    summaries = [summary(name) for name in names()]
    if json:
        print_json({"tracks": [part.as_dictionary() for part in summaries]})
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for title, side in (
        ("track", "left"),
        ("length", "right"),
        ("width", "right"),
        ("direction", "left"),
        ("title", "left"),
    ):
        table.add_column(title, justify=side, no_wrap=title != "title")  # type: ignore[arg-type]
    for part in summaries:
        table.add_row(part.name, f"{part.length:.2f} m", f"{part.width:.2f} m", part.direction, part.title)
    Console().print(table)


@app.command()
def show(
    track: Annotated[str, typer.Argument(help="A name from `racecraft tracks list`, or a waypoint file (.npy).")],
    picture: Annotated[Path | None, typer.Option(help="Draw it into this PNG file.")] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line.")] = False,
) -> None:
    """Show what is known of a track; draw it.

    Example: racecraft tracks show reinvent_base --picture reinvent.png
    """
    from racecraft.cli.output import print_json
    from racecraft.tracks.catalogue import load_track

    found = load_track(track)
    x0, y0, x1, y1 = found.bounds
    facts = {
        "name": found.name,
        "title": found.title,
        "length_m": round(found.length, 4),
        "width_mean_m": round(found.width_mean, 4),
        "direction": found.direction,
        "waypoints": len(found.centre),
        "bounds_m": [round(value, 3) for value in (x0, y0, x1, y1)],
        "hash": found.hash(),
    }
    if picture is not None:
        from racecraft.tracks.picture import draw_track

        draw_track(found, picture)
        facts["picture"] = str(picture)
    if json:
        print_json(facts)
        return
    for key, value in facts.items():
        print(f"{key:14} {value}")
