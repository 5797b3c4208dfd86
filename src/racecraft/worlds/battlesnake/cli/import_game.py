"""`racecraft snakes import`: a game that was played elsewhere as a file of ours."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.worlds.battlesnake.cli.options import JSON, check_folder


def import_game(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="The game, or its pieces; may be gzipped.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="The file to write.")] = Path("game.jsonl"),
    game: Annotated[int | None, typer.Option("--game", min=1, help="Which, of a file that holds several.")] = None,
    json: JSON = False,
) -> None:
    """Bring a game home that was played elsewhere: to watch, to film, to study.

    It takes what an engine tells of a game: the arena's /api/games/ID/details; the answers for /games/ID together with
    the pages for /games/ID/frames; or the events that a board is sent. It also takes a snake's own log of a production
    game, and whatever else `snakes verify` takes. Every turn is replayed by our rules, and what differs is counted.

    Example: racecraft snakes import details.json --out game.jsonl

    Example: racecraft snakes import info.json frames.json --out game.jsonl

    Example: racecraft snakes import events.jsonl.gz --out game.jsonl && racecraft snakes study game.jsonl
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.battlesnake.evaluation.imported import import_game as read
    from racecraft.worlds.battlesnake.evaluation.record import write_record

    check_folder(out)
    found = read(files, game)
    played = found.played
    write_record(played, out)
    names = list(played.card.names.values())
    if json:
        told = {"file": str(out), "snakes": names, "turns": played.turns, "over": played.over}
        print_json(told | {"winner": played.card.names.get(played.winner, ""), "mismatches": found.mismatches})
        return
    end = f"won by {played.card.names[played.winner]}" if played.winner else "over" if played.over else "cut there"
    differ = f"; {found.mismatches} mismatches with our rules: `racecraft snakes verify` shows them"
    print(f"{out}: {', '.join(names)}; {played.turns} turns, {end}{differ * (found.mismatches > 0)}")
