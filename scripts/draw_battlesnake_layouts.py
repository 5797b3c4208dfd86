"""Draw `layouts.toml` of the Battlesnake room from recorded output of the official maps.

For builders: `python scripts/draw_battlesnake_layouts.py RECORDED_MAPS.jsonl.gz`. The record is a list of facts (which
squares were hazards, start squares and food squares in hundreds of set-ups); the file it makes is our own drawing.
"""

from __future__ import annotations

import gzip
import json
import sys
from collections import Counter
from pathlib import Path

DRAWN = (
    "arcade_maze", "hz_castle_wall", "hz_castle_wall_lg", "hz_castle_wall_xl", "hz_hazard_pits",
    "hz_islands_bridges", "hz_islands_bridges_lg", "hz_rivers_bridges", "hz_rivers_bridges_lg", "hz_rivers_bridges_xl",
)  # fmt: skip
LISTED_FOOD = {"arcade_maze", "hz_castle_wall", "hz_castle_wall_lg", "hz_castle_wall_xl"}
TARGET = Path(__file__).parents[1] / "src/racecraft/worlds/battlesnake/env/layouts.toml"


def main(path: str) -> None:
    """Read the record at `path` and write `layouts.toml`."""
    with gzip.open(path, "rt") as file:
        lines = [json.loads(line) for line in file]
    text = [
        "# Layouts of the official maps that have drawn ones. Source: recorded output of the official engine",
        "# (rules 87e094e); made by scripts/draw_battlesnake_layouts.py.",
        "# board: top row first, a digit = stacked hazards. starts: [most players, squares]: the first that holds",
        "# all players is shuffled. quadrants: visited in turn. food: the only squares where food falls.",
    ]
    for name in DRAWN:
        text += ["", *table(name, [line for line in lines if line.get("map") == name])]
    TARGET.write_text("\n".join(text) + "\n")


def table(name, lines):
    """Yield one map's table, line by line."""
    runs = [line for line in lines if line["t"] == "run" and "heads" in line]
    width, height = runs[0]["w"], runs[0]["h"]
    hazards = next((line["data"] for line in lines if line["t"] == "hazset"), [])
    yield f"[{name}]"
    yield 'board = """'
    yield from drawing(width, height, hazards)
    yield '"""'
    if "bridges" in name:
        yield f"quadrants = {json.dumps(quadrants(runs, width, height))}"
    else:
        first, *later = tiers(runs) if name != "arcade_maze" else tiers(runs)[:1]
        yield f"starts = {json.dumps([first, *later])}"
    if name == "arcade_maze":
        yield f"extra_starts = {json.dumps(extra_starts(runs))}"
    if name in LISTED_FOOD:
        fallen = [point[:2] for line in lines if line["t"] == "foodstats" for point in line.get("hist", [])]
        yield f"food = {json.dumps(sorted(map(list, set(map(tuple, fallen)))))}"


def drawing(width, height, hazards):
    """Return the board as rows of text, the top row first."""
    rows = [["."] * width for _ in range(height)]
    for x, y, *count in hazards:
        rows[y][x] = str(count[0] if count else 1)
    return ["".join(row) for row in reversed(rows)]


def tiers(runs):
    """Start squares seen with each number of players; neighbouring numbers with the same squares are one tier."""
    seen = {}
    for run in runs:
        seen.setdefault(run["players"], set()).update(map(tuple, run["heads"]))
    found = []
    for players in sorted(seen):
        squares = sorted(map(list, seen[players]))
        if found and all(square in squares for square in found[-1][1]) and len(squares) == len(found[-1][1]):
            found[-1][0] = players
        else:
            found.append([players, squares])
    return [tier for tier in found if len(tier[1]) >= 4]  # three squares: one player was seen too seldom


def extra_starts(runs):
    """Start squares of the fifth snake and the next, which are not shuffled."""
    return max((run["heads"] for run in runs), key=len)[4:]


def quadrants(runs, width, height):
    """Start squares by quadrant, in the order in which the record walks round them."""
    order, squares = Counter(), {}
    for run in runs:
        sides = [(x > width // 2) + 2 * (y > height // 2) for x, y in run["heads"]]
        for side, head in zip(sides, run["heads"], strict=True):
            squares.setdefault(side, set()).add(tuple(head))
        order.update(zip(sides, sides[1:], strict=False))
    walk = [0]
    while len(walk) < 4:
        walk.append(max(range(4), key=lambda side: order[walk[-1], side]))
    return [sorted(map(list, squares[side])) for side in walk]


if __name__ == "__main__":
    main(sys.argv[1])
