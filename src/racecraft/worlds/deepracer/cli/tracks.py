"""`racecraft tracks`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from racecraft.actions.figures import Figures
from racecraft.cli.from_request import command
from racecraft.worlds.deepracer.actions.make_track import MadeTrack, make_track, print_track
from racecraft.worlds.deepracer.actions.tracks import ImportedTracks, TrackList, import_tracks, list_tracks, show_track

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.tracks.catalogue import TrackSummary
    from racecraft.worlds.deepracer.tracks.floor_print import FloorPrint


COLUMNS_BY_DIRECTION = ("clockwise", "counter-clockwise")


TAGS_WIDTH = len("short, narrow")


def _print_table(summaries: list[TrackSummary]) -> None:
    """Print a line a track, however narrow the terminal; the title gives way first, in a pipe nothing does."""
    from rich.table import Table

    from racecraft.cli.output import console

    rows = [("track", "length", "width", "direction", "tags", "title")]
    for part in summaries:
        tags = ", ".join(tag for tag in part.tags if tag not in COLUMNS_BY_DIRECTION)
        figures = (f"{part.length:.2f} m", f"{part.width:.2f} m")
        rows.append((part.name, *figures, part.direction, tags, part.title.split(" (")[0]))
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, heading in enumerate(rows[0][:4]):
        side = "right" if heading in ("length", "width") else "left"
        table.add_column(heading, justify=side, min_width=max(len(row[k]) for row in rows))  # type: ignore[arg-type]
    screen = console()
    table.add_column("tags", no_wrap=True, width=TAGS_WIDTH if screen.is_terminal else None)
    table.add_column("title", no_wrap=True)
    for row in rows[1:]:
        table.add_row(*row)
    screen.print(table)


def _show_list(found: TrackList) -> None:
    _print_table(found.tracks)


def _show_imported(kept: ImportedTracks) -> None:
    for one in kept.tracks:
        print(f"{one.name}: {one.length:.2f} m long, {one.width:.2f} m wide, {one.direction}, {one.rows} rows")
    first = kept.tracks[0].name
    print(f"Kept in {kept.library}.\nWhat to try next:")
    print(f"  racecraft tracks show {first} --picture {first}.png")
    print(f"  racecraft train --track {first}")


def _show_track(facts: Figures) -> None:
    for key, value in facts.items():
        print(f"{key:14} {value}")


def _show_made(made: MadeTrack) -> None:
    one, tape = made.track, made.tape
    print(f"{one.name}: {one.length:.2f} m long, {one.width:.2f} m wide, {one.direction}; kept in {made.file}")
    print(f"tape: {tape.borders_m:.1f} m borders, {tape.centre_m:.1f} m dashes, {tape.total_m:.1f} m in all")
    for bend in made.bends:
        print(f"remark: bend at {bend.text}")
    print("What to try next:")
    print(f"  racecraft drive {one.name}")
    print(f"  racecraft tracks print {one.name} --out {one.name}.pdf")
    print(f"  racecraft train --track {one.name}")


def _show_printed(printed: FloorPrint) -> None:
    print(f"{printed.file}: a plan and {printed.pages} pages {printed.paper} at 1:1; print at 100 %")
    print(f"tape: {printed.tape.borders_m:.1f} m borders, {printed.tape.total_m:.1f} m in all")


app = typer.Typer(help="List the tracks, look at one, make or print your own.", no_args_is_help=True)
app.command("list")(command(list_tracks, _show_list, messages_aside=True))
app.command("import")(command(import_tracks, _show_imported))
app.command("show")(command(show_track, _show_track))
app.command("make")(command(make_track, _show_made))
app.command("print")(command(print_track, _show_printed))
