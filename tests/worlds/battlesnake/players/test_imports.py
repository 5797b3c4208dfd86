"""The room of the snake players has no circles: promises below, players above them, the finder on top."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import racecraft.worlds.battlesnake.players as room

FOLDER = Path(room.__file__).parent


def doors(path):
    """Names of the files of this room that a file imports anywhere, functions included."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(room.__name__ + "."):
            found.add(node.module.removeprefix(room.__name__ + "."))
    return found


def test_no_file_of_the_players_leads_back_to_itself():
    names = {path: ".".join(path.relative_to(FOLDER).with_suffix("").parts) for path in FOLDER.rglob("*.py")}
    graph = {name: doors(path) for path, name in names.items()}
    assert len(list(TopologicalSorter(graph).static_order())) > 15  # raises CycleError where there is a circle
    assert graph["protocol"] == set(), "promises lean on no player"
