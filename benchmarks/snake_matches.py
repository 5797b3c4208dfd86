"""Two ways to play against each other, at equal time for a move: which search serves where.

    python benchmarks/snake_matches.py search:runs/snakes-1 search                   duels on 11x11, 25 ms a move
    python benchmarks/snake_matches.py search search:runs/snakes-1 --snakes 4        two of each at a board
    python benchmarks/snake_matches.py search http://localhost:8001 --milliseconds 500          a server of a stranger

Every two games have the same dice, with the seats swapped. A duel that is drawn (both gone on the same turn, or 1,000
turns) counts half to each. A game of four ends when one side has nobody left: the other has won it, and where that has
nobody left either it is drawn. Interval by Wilson over games, draws as half wins. A move's time is that of the
processor, not of the clock, so that other programs on the machine do not decide games; nobody ponders, and nobody can
be late. Prints one JSON object.

With `--keep FILE` every game is written there as soon as it is over, and the same command goes on after those that
stand there: a hundred games against a slow server need not be one sitting.

Where an address is among the two, time is that of the clock: `--milliseconds` is the game's timeout, as the official
program has it, players of ours keep their margin within it (`players/battlesnake/time_budget.py`), and one thinks after
the other, so that both have the machine to themselves. Answers that came late, and that failed otherwise, are counted
for each side; nothing else should run meanwhile.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from racecraft.envs.battlesnake.board import Board
    from racecraft.evaluation.battlesnake.seats import Seat

SEED_OF_MATCHES, MOST_TURNS = 3_000_017, 1000


def pair_of_games(first: str, second: str, size: int, snakes: int, milliseconds: float, pair: int) -> list[dict]:
    """Play two games on the same dice, seats swapped; return what each was worth to the first, and how long it was."""
    from racecraft.contract.random_streams import stream_keys
    from racecraft.envs.battlesnake.dice import StreamDice
    from racecraft.envs.battlesnake.reference import Referee
    from racecraft.envs.battlesnake.settings import GameSettings
    from racecraft.players.battlesnake.find import find_player, warm_up

    key = int(stream_keys(SEED_OF_MATCHES, "matches", pair + 1)[pair])
    told = []
    for order in ((first, second), (second, first)):
        seated = {f"s{number}": order[number % 2] for number in range(snakes)}
        players = {one: find_player(name) for one, name in seated.items()}
        for player in players.values():
            warm_up(player)
        settings = GameSettings(size, size, snakes)
        referee = Referee(settings, StreamDice(key))
        while len({seated[one.id] for one in referee.board.alive()}) > 1 and referee.board.turn < MOST_TURNS:
            board = referee.board
            referee.turn(
                {one.id: players[one.id].choose(board, settings, one.id, milliseconds / 1000) for one in board.alive()}
            )
        left = {seated[one.id] for one in referee.board.alive()}
        told.append({"worth": float(left == {first}) if len(left) == 1 else 0.5, "turns": referee.board.turn})
    return told


def games_by_the_clock(
    first: str, second: str, size: int, snakes: int, milliseconds: float, games: range
) -> Iterator[dict[str, Any]]:
    """Play games in which servers take part, one after another; each tells late and failed answers of either side."""
    from racecraft.contract.random_streams import stream_keys
    from racecraft.envs.battlesnake.dice import StreamDice
    from racecraft.envs.battlesnake.settings import GameSettings
    from racecraft.evaluation.battlesnake.match import play
    from racecraft.evaluation.battlesnake.seats import take_seat

    def left(board: Board, game: int) -> set[bool]:
        """Return which sides have somebody left; True is the first."""
        return {int(one.id[1:]) % 2 == game % 2 for one in board.alive()}

    keys = stream_keys(SEED_OF_MATCHES, "matches", games.stop // 2 + 1)
    sides = [[take_seat(name) for _ in range(snakes // 2)] for name in (first, second)]
    try:
        for game in games:
            order = sides if game % 2 == 0 else sides[::-1]
            seats = [order[number % 2][number // 2] for number in range(snakes)]
            before = [_failures(side) for side in sides]
            played = play(
                GameSettings(size, size, snakes), seats, StreamDice(int(keys[game // 2])), f"match-{game + 1}",
                round(milliseconds), sequential=True, most_turns=MOST_TURNS,
                until=lambda board, game=game: len(left(board, game)) < 2,
            )  # fmt: skip
            last = left(played.boards[-1], game)
            after = [_failures(side) for side in sides]
            late, failed = ([now[what] - was[what] for was, now in zip(before, after, strict=True)] for what in (0, 1))
            worth = float(last.pop()) if len(last) == 1 else 0.5
            yield {"worth": worth, "turns": played.turns, "late": late, "failed": failed}
    finally:
        for seat in (*sides[0], *sides[1]):
            seat.leave()


class Keeper:
    """The games of one match, in a file of one line each behind a line that says which match it is.

    Args:
        path: The file; None: they are not kept.
        match: What makes a game belong here.
    """

    def __init__(self, path: Path | None, match: dict[str, Any]) -> None:
        self._path, self.games = path, list[dict[str, Any]]()
        if path is None:
            return
        if not path.exists():
            path.write_text(json.dumps(match) + "\n", encoding="utf-8")
        try:
            kept, *games = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
        except ValueError as problem:
            raise SystemExit(f"{path} is no file of a match ({problem}); expected one that --keep wrote.") from problem
        if kept != match:
            raise SystemExit(f"{path} keeps another match: {kept}; expected {match}. Name another file.")
        self.games = games

    def add(self, *games: dict[str, Any]) -> None:
        """Take games that are over."""
        self.games += games
        if self._path is not None:
            with self._path.open("a", encoding="utf-8") as file:
                file.write("".join(json.dumps(game) + "\n" for game in games))


def _failures(side: list[Seat]) -> tuple[int, int]:
    return sum(seat.failures.timeouts for seat in side), sum(seat.failures.crashes for seat in side)


def main() -> None:
    """Play and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("first")
    parser.add_argument("second")
    parser.add_argument("--size", type=int, default=11)
    parser.add_argument("--snakes", type=int, choices=(2, 4), default=2)
    parser.add_argument("--games", type=int, default=100)
    parser.add_argument("--milliseconds", type=float, default=25.0, help="for a move")
    parser.add_argument("--cores", type=int, default=1)
    parser.add_argument("--keep", type=Path, metavar="FILE", help="of games that are over; the same command goes on")
    asked = parser.parse_args()
    from racecraft.evaluation.rating import wilson

    setting = (asked.first, asked.second, asked.size, asked.snakes, asked.milliseconds)
    by_the_clock = any("://" in name for name in (asked.first, asked.second))
    keeper = Keeper(asked.keep, dict(zip(("first", "second", "size", "snakes", "milliseconds"), setting, strict=True)))
    begun, asked_for = len(keeper.games), asked.games // 2 * 2
    if by_the_clock:
        for game in games_by_the_clock(*setting, range(begun, asked_for)):
            keeper.add(game)
    else:
        with ProcessPoolExecutor(asked.cores, initializer=_count_own_time) as cores:
            under_way = [cores.submit(pair_of_games, *setting, pair) for pair in range(begun // 2, asked_for // 2)]
            for one in under_way:
                keeper.add(*one.result())
    games = keeper.games
    worths = [game["worth"] for game in games]
    low, high = wilson(sum(worths), len(worths))
    figures = {
        "first": asked.first, "second": asked.second, "board": f"{asked.size}x{asked.size}", "snakes": asked.snakes,
        "milliseconds_a_move": asked.milliseconds, "games": len(worths), "won": worths.count(1.0),
        "drawn": worths.count(0.5), "lost": worths.count(0.0), "score": round(sum(worths) / len(worths), 3),
        "low": round(low, 3), "high": round(high, 3), "mean_turns": round(sum(g["turns"] for g in games) / len(games)),
    }  # fmt: skip
    for what in ("late", "failed") if by_the_clock else ():
        figures |= {
            f"{what}_{side}": sum(game[what][n] for game in games) for n, side in enumerate(("first", "second"))
        }
    print(json.dumps(figures))


def _count_own_time() -> None:
    """Let search look at the processor's seconds; torch then has to stay on its thread."""
    import torch

    from racecraft.players.battlesnake import certainty, search

    torch.set_num_threads(1)
    certainty.time = search.time = SimpleNamespace(monotonic=time.thread_time)


if __name__ == "__main__":
    main()
