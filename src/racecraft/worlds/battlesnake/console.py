"""Snakes in the console: the form in which a training is made, and the games that a trained snake plays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import BaseRoute, Route

from racecraft.algorithms.registry import CHOICES, choices
from racecraft.console.form import Field, Step, common_fields, common_words
from racecraft.console.pages.kept import ALONE
from racecraft.console.pages.model import model_of
from racecraft.console.paging import page_of
from racecraft.console.parts import RaceDrive, RaceMaking, WorldParts
from racecraft.console.section import Section
from racecraft.console.service import Console
from racecraft.contract.errors import InputFileError
from racecraft.formats.run_folder import RunFolder
from racecraft.web.errors import WebError

GAMES = "games"
FILE = "game-{}.jsonl"
"""A game in the folder of its run, numbered from 1."""
OPPONENT = "area_control"
"""Has the other seats; it answers at once."""
RULESETS = ("standard", "royale", "constrictor", "wrapped", "solo")


class SnakeParts(WorldParts):
    """Snakes in the console."""

    noun = "snake"

    def steps(self, values: Mapping[str, Any]) -> list[Step]:
        """Return the one step in which a training is made."""
        fields = (
            Field(
                name="size", label="Side of the board", default=11, kind="whole", low=5, high=25, unit="squares",
                matters=True, names=(("--size", "11"),),
            ),
            Field(
                name="snakes", label="Snakes at a board", default=2, kind="whole", low=1, high=8, matters=True,
                sentence="Two learn soonest; four is the arena's usual game.", names=(("--snakes", "2"),),
            ),
            Field(
                name="ruleset", label="Rules", default="standard", kind="choice",
                choices=tuple((one, one) for one in RULESETS), names=(("--ruleset", "standard"),),
            ),
        )  # fmt: skip
        return [
            Step(
                key="training",
                title="Training",
                fields=(*fields, *common_fields(choices(CHOICES, searches=True), 10.0)),
            )
        ]

    def words(self, values: Mapping[str, Any]) -> list[str]:
        """Return `snakes train` and its options."""
        full = self.defaults() | dict(values)
        board = [f"--size={full['size']}", f"--snakes={full['snakes']}", f"--ruleset={full['ruleset']}"]
        return ["snakes", "train", *board, *common_words(full)]

    def values_of(self, run: RunFolder) -> dict[str, Any]:
        """Return board, rules and algorithm of a run."""
        job = run.read_job()
        game: Mapping[str, Any] = (job.get("asked") or {}).get("game") or {}
        found = {"size": game.get("width"), "snakes": game.get("players"), "ruleset": game.get("ruleset")}
        found |= {"algorithm": job.get("algorithm")}
        return self.defaults() | {name: value for name, value in found.items() if value}

    def tabs(self, row: Mapping[str, Any]) -> list[tuple[str, str]]:
        """Return the page of games."""
        return [("Games", "/games")]

    def tab_page(
        self, row: Mapping[str, Any], tab: str, query: Mapping[str, str], drives: Callable[[], Sequence[RaceDrive]]
    ) -> tuple[str, dict[str, Any]]:
        """Return the games that the snake played here, the latest first."""
        if tab != GAMES:
            return super().tab_page(row, tab, query, drives)
        page = page_of(GAMES, query, list(_files(Path(row["run"]))), lambda one: (-float(one[0]), ""))
        return "racecraft.worlds.battlesnake.pages/games.html", {
            "games": [_told(number, file) for number, file in page.rows],
            "pages": page.links,
        }

    def tab_task(self, row: Mapping[str, Any], tab: str) -> tuple[str, list[str]] | None:
        """Return a game of the best checkpoint, on the board and by the rules of its training."""
        if tab != GAMES:
            return None
        run = RunFolder(Path(row["run"]))
        game = run.read_job()["asked"]["game"]
        number = max((number for number, _ in _files(run.path)), default=0) + 1
        board = [f"--width={game['width']}", f"--height={game['height']}", f"--gametype={game['ruleset']}"]
        words = ["snakes", "play", str(run.path), *[OPPONENT] * (game["players"] - 1), *board, f"--map={game['map']}"]
        return "Playing a game", [*words, f"--name={row['name']}", f"--output={run.path / FILE.format(number)}"]

    def sections(self) -> Sequence[Section]:
        """Return the boards of those games."""
        return (Section(routes=_routes),)

    def race_making(self) -> RaceMaking:
        """Return the action that makes a race of snakes, and the maps."""
        from racecraft.worlds.battlesnake.actions.create_race import create_snake_race

        return RaceMaking(
            action=create_snake_race,
            command="league create-snakes",
            first=("title", "map_name", "snakes", "format", "meetings", "closes", "season"),
            choices={},
        )


def _routes(console: Console) -> list[BaseRoute]:
    """Return the route of a game on its board, a page that can do nothing in the console's name."""

    def game(request: Request) -> Response:
        model, row = model_of(console, request)
        file = dict(_files(Path(row["run"]))).get(request.path_params["number"])
        if row["kind"] != "battlesnake" or file is None:
            raise WebError(404, "no_such_game", f"{model.name} played no such game here.")
        return HTMLResponse(_board(file), headers={"Content-Security-Policy": ALONE})

    return [Route("/models/{name}/games/{number:int}", game)]


def _files(run: Path) -> list[tuple[int, Path]]:
    """Return a run's games by number."""
    numbered = ((file.stem.partition("-")[2], file) for file in run.glob(FILE.format("*")))
    return [(int(number), file) for number, file in numbered if number.isdecimal()]


def _told(number: int, file: Path) -> dict[str, Any]:
    """Return what the list says of a game."""
    from racecraft.worlds.battlesnake.evaluation.imported import read_game

    try:
        played = read_game(file)
    except InputFileError as error:
        return {"number": number, "winner": str(error), "turns": None}
    winner = played.card.names.get(played.winner, "")
    return {"number": number, "winner": winner or "nobody", "turns": len(played.boards) - 1}


def _board(file: Path) -> str:
    """Return a game as a page that is one file."""
    from racecraft.worlds.battlesnake.analysis.board_page import board_page, read_board

    return board_page(*read_board(file))
