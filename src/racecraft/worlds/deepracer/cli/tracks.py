"""`racecraft tracks`: the catalogue of circuits, and the user's own beside it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.tracks.catalogue import TrackSummary

app = typer.Typer(help="List the tracks, look at one, bring your own.", no_args_is_help=True)


@app.command("list")
def list_tracks(
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line.")] = False,
) -> None:
    """List every track by name, your own first, with length, width, direction and tags.

    Example: racecraft tracks list
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.tracks.catalogue import names, summary

    summaries = [*_own_summaries(), *map(summary, names())]
    if json:
        print_json({"tracks": [part.as_dictionary() for part in summaries]})
    else:
        _print_table(summaries)


@app.command("import")
def import_tracks(
    files: Annotated[list[Path], typer.Argument(help="Waypoint files (.npy): centre, inner and outer x, y in metres.")],
    name: Annotated[str, typer.Option(help="What the track is called from now on; by default the file's name.")] = "",
    replace: Annotated[bool, typer.Option("--replace", help="Write over a track of your own of that name.")] = False,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line.")] = False,
) -> None:
    """Look at every row of a waypoint file and keep it in your own library.

    A file that makes no circuit is refused, and the row named where it shows; of several files all are kept or none.
    The library is a folder of your user account, or the one that the variable RACECRAFT_TRACKS names.

    Examples:

        racecraft tracks import garage.npy

        racecraft tracks import measured.npy --name garage --replace
    """
    from racecraft.cli.output import print_json
    from racecraft.contract.errors import SettingError
    from racecraft.worlds.deepracer.tracks.library import add_track, check_track, library_folder, own_summary

    if name and len(files) > 1:
        raise SettingError(
            "--name {name} would name {count} files; expected one file with it. Import it alone.",
            name=name,
            count=len(files),
        )
    if len({file.stem.casefold() for file in files}) < len(files):
        raise SettingError("Two of the files have one name; expected a name for each track. Import one of them --name.")
    for file in files:
        check_track(file, name, replace=replace)
    kept = [own_summary(add_track(file, name, replace=replace).name) for file in files]
    if json:
        print_json({"library": str(library_folder()), "tracks": [part.as_dictionary() for part in kept]})
        return
    for part in kept:
        print(f"{part.name}: {part.length:.2f} m long, {part.width:.2f} m wide, {part.direction}, {part.rows} rows")
    print(f"Kept in {library_folder()}.\nWhat to try next:")
    print(f"  racecraft tracks show {kept[0].name} --picture {kept[0].name}.png")
    print(f"  racecraft train --track {kept[0].name}")


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
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    found = load_track(track)
    x0, y0, x1, y1 = found.bounds
    facts = {
        "name": found.name,
        "title": found.title,
        "length_m": round(found.length, 4),
        "width_mean_m": round(found.width_mean, 4),
        "direction": found.direction,
        "waypoints": len(found.of_filed_rows()),
        "bounds_m": [round(value, 3) for value in (x0, y0, x1, y1)],
        "hash": found.hash(),
    }
    if found.repeated_rows:
        facts["repeated"] = list(found.repeated_rows)
    if picture is not None:
        from racecraft.worlds.deepracer.tracks.picture import draw_track

        draw_track(found, picture)
        facts["picture"] = str(picture)
    if json:
        print_json(facts)
        return
    for key, value in facts.items():
        print(f"{key:14} {value}")


def _own_summaries() -> list[TrackSummary]:
    """Return the user's own tracks; a file that has been damaged since is told of and passed over."""
    from racecraft.contract.errors import TrackError
    from racecraft.worlds.deepracer.tracks.library import own_names, own_summary

    found = []
    for name in own_names():
        try:
            found.append(own_summary(name))
        except TrackError as error:
            print(f"Left out: {error}", file=sys.stderr)
    return found


TOLD_BY_DIRECTION = ("clockwise", "counter-clockwise")
TAGS_WIDTH = len("short, narrow")


def _print_table(summaries: list[TrackSummary]) -> None:
    """Print a line a track, however narrow the terminal; the title gives way first, in a pipe nothing does."""
    from rich.table import Table

    from racecraft.cli.output import console

    rows = [("track", "length", "width", "direction", "tags", "title")]
    for part in summaries:
        tags = ", ".join(tag for tag in part.tags if tag not in TOLD_BY_DIRECTION)
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
