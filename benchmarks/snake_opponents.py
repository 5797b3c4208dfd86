"""Gather matches against public snakes into tables: `python benchmarks/snake_opponents.py FOLDER`.

FOLDER holds what `snake_matches.py --keep` wrote, a file a match, called after the other snake (`spaceheater.jsonl`;
`spaceheater-4.jsonl` for four at a board). Every game of it goes into `snake_opponents.json`, in the place of what the
same player of ours had played; the tables that come of them, one for each player of ours, stand between their marks in
`snake-opponents.md`. Without FOLDER the tables are made again from the figures. With `--back PLAYER` its games are laid
into FOLDER as the files that they came from, and `snake_matches.py --keep` goes on with them.
"""

from __future__ import annotations

import argparse
import datetime
import json
from pathlib import Path
from typing import Any

from racecraft.evaluation.rating import wilson
from racecraft.formats.atomic import write_atomic
from run_all import machine

HERE = Path(__file__).parent
FIGURES, PAGE = HERE / "snake_opponents.json", HERE / "snake-opponents.md"
BEGIN, END = "<!-- games of {} in snake_opponents.json -->\n", "<!-- end of the table -->\n"
HEAD = """\
| against | at a board | games | won | drawn | lost | share, 95 % interval | turns a game | late, ours and theirs | no move, likewise |
|---|---|---|---|---|---|---|---|---|---|
"""  # fmt: skip  # noqa: E501


def main() -> None:
    """Gather and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("folder", type=Path, nargs="?", help="of files that --keep wrote")
    parser.add_argument("--back", metavar="PLAYER", help="lay this one's games, such as search's, into the folder")
    asked = parser.parse_args()
    known = json.loads(FIGURES.read_text(encoding="utf-8"))["matches"]
    if asked.back is not None:
        if asked.folder is None:
            raise SystemExit("--back needs a FOLDER to lay the games into.")
        asked.folder.mkdir(parents=True, exist_ok=True)
        lay_back([match for match in known if match["first"] == asked.back], asked.folder)
        return
    if asked.folder is not None:
        known = in_the_place_of(known, gathered(asked.folder))
        write_atomic(FIGURES, told_by(known))
    write_atomic(PAGE, page(PAGE.read_text(encoding="utf-8"), known))


def gathered(folder: Path) -> list[dict[str, Any]]:
    """Return the matches of a folder: what each was, and a list for everything that its games tell."""
    matches = []
    for path in sorted(folder.glob("*.jsonl"), key=lambda path: (path.stem.endswith("-4"), path.stem)):
        match, *games = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
        told = {what: [game[what] for game in games] for what in (games[0] if games else ())}
        matches.append({"against": path.stem.removesuffix("-4")} | match | told)
    return matches


def in_the_place_of(known: list[dict[str, Any]], new: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return all matches, those of the players of the new ones being the new ones."""
    played = {match["first"] for match in new}
    return [match for match in known if match["first"] not in played] + new


def lay_back(matches: list[dict[str, Any]], folder: Path) -> None:
    """Write the files that `gathered` would read these matches from."""
    for match in matches:
        whole = {what: value for what, value in match.items() if not isinstance(value, list) and what != "against"}
        lists = {what: value for what, value in match.items() if isinstance(value, list)}
        games = [dict(zip(lists, told, strict=True)) for told in zip(*lists.values(), strict=True)]
        name = match["against"] + "-4" * (match["snakes"] == 4)
        text = "".join(json.dumps(line) + "\n" for line in (whole, *games))
        write_atomic(folder / f"{name}.jsonl", text)


def told_by(matches: list[dict[str, Any]]) -> str:
    """Return the file of figures: one line a list."""
    head = {"machine": machine(), "date": datetime.date.today().isoformat()}
    lines = [json.dumps(head)[:-1] + ', "matches": [']
    for number, match in enumerate(matches, 1):
        parts = ",\n  ".join(f"{json.dumps(what)}: {json.dumps(match[what])}" for what in match)
        lines.append(" {" + parts + "}" + "," * (number < len(matches)))
    return "\n".join([*lines, "]}"]) + "\n"


def page(text: str, matches: list[dict[str, Any]]) -> str:
    """Return the page with the tables of these matches between their marks."""
    for player in sorted({match["first"] for match in matches}):
        begin = BEGIN.format(player)
        before, rest = text.split(begin)
        rows = "".join(row(match) for match in matches if match["first"] == player)
        text = before + begin + HEAD + rows + END + rest.split(END, 1)[1]
    return text


def row(match: dict[str, Any]) -> str:
    """Return a match's line of the table."""
    worths, count = match["worth"], len(match["worth"])
    low, high = wilson(sum(worths), count)
    fates = " | ".join(str(worths.count(worth)) for worth in (1.0, 0.5, 0.0))
    share = f"{sum(worths) / count:.0%} ({low * 100:.0f} – {high:.0%})".replace("%", " %")
    turns = sum(match["turns"]) / count
    misses = " | ".join(
        ", ".join(str(sum(game[side] for game in match[what])) for side in (0, 1)) for what in ("late", "failed")
    )
    return f"| {match['against']} | {match['snakes']} | {count} | {fates} | {share} | {turns:.0f} | {misses} |\n"


if __name__ == "__main__":
    main()
