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
program has it, players of ours keep their margin within it (`worlds/battlesnake/players/time_budget.py`), and one
thinks after the other, so that both have the machine to themselves. Answers that came late, and that failed
otherwise, are counted for each side; nothing else should run meanwhile. With `--think MS` both sides have so much of
the *processor* for a move, for a machine that does much else: players of ours look at their thread's seconds, servers
at what whoever started them lets them see; every answer is waited for, and those that took longer than the timeout
are counted as late. How long answers took by the clock stands in every game. With `--lost FOLDER` games that the
first did not win are written there, for `racecraft snakes study`.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from statistics import fmean
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.env.board import Board
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.evaluation.seats import Seat
    from racecraft.worlds.battlesnake.players.messages import GameCard
    from racecraft.worlds.battlesnake.players.protocol import Message, SnakePlayer

SEED_OF_MATCHES, MAX_TURNS = 3_000_017, 1000
PATIENCE = 3600.0
"""Seconds that an answer is waited for where the clock does not decide."""


def pair_of_games(first: str, second: str, size: int, snakes: int, milliseconds: float, pair: int) -> list[dict]:
    """Play two games on the same dice, seats swapped; return what each was worth to the first, and how long it was."""
    from racecraft.contract.random_streams import stream_keys
    from racecraft.worlds.battlesnake.env.dice import StreamDice
    from racecraft.worlds.battlesnake.env.reference import Referee
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.players.find import find_player, warm_up

    key = int(stream_keys(SEED_OF_MATCHES, "matches", pair + 1)[pair])
    told = []
    for order in ((first, second), (second, first)):
        seated = {f"s{number}": order[number % 2] for number in range(snakes)}
        players = {one: find_player(name) for one, name in seated.items()}
        for player in players.values():
            warm_up(player)
        settings = GameSettings(size, size, snakes)
        referee = Referee(settings, StreamDice(key))
        while len({seated[one.id] for one in referee.board.alive()}) > 1 and referee.board.turn < MAX_TURNS:
            board = referee.board
            referee.turn(
                {one.id: players[one.id].choose(board, settings, one.id, milliseconds / 1000) for one in board.alive()}
            )
        left = {seated[one.id] for one in referee.board.alive()}
        told.append({"worth": float(left == {first}) if len(left) == 1 else 0.5, "turns": referee.board.turn})
    return told


class Told:
    """A player that thinks for as long as it is told here, whatever it is told at the board."""

    def __init__(self, player: SnakePlayer, seconds: float) -> None:
        self._player, self._seconds = player, seconds

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the player's move."""
        return self._player.choose(board, settings, snake_id, self._seconds)


class Patient:
    """A seat whose answers are waited for: an hour, whatever the game's timeout."""

    def __init__(self, seat: Seat) -> None:
        self._seat = seat

    def __getattr__(self, name: str) -> Any:
        return getattr(self._seat, name)

    def prefetch(self, message: Message, seconds: float) -> None:
        """Send a server its question."""
        self._seat.prefetch(message, PATIENCE)

    def answer(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return this turn's move."""
        return self._seat.answer(board, settings, snake_id, PATIENCE)


class Stopwatch:
    """How long the answers of two sides took, by the game's turns.

    Args:
        game: Its number; the sides swap seats from game to game.
    """

    def __init__(self, game: int) -> None:
        self._game, self._asked = game, list[str]()
        self.took: tuple[list[int], list[int]] = ([], [])
        """Milliseconds of every answer, of either side."""

    def set_position(self, board: Board, card: GameCard) -> None:
        """Note what the answers took that led to a position."""
        for one in self._asked:
            self.took[(int(one[1:]) + self._game) % 2].append(card.latencies_ms[one])
        self._asked = [snake.id for snake in board.alive()]


def games_by_the_clock(
    first: str, second: str, size: int, snakes: int, milliseconds: float, games: range,
    think: float | None = None, lost: Path | None = None,
) -> Iterator[dict[str, Any]]:  # fmt: skip
    """Play games in which servers take part, one after another; each tells late and failed answers of either side.

    Args:
        first: A player or an address.
        second: Likewise.
        size: Squares of the board's side.
        snakes: At the board; every other one is the first's.
        milliseconds: The game's timeout.
        games: Which ones.
        think: Milliseconds of the processor that players of ours think; None: of the clock, what the timeout leaves.
        lost: A folder for the games that the first did not win.
    """
    from racecraft.contract.random_streams import stream_keys
    from racecraft.worlds.battlesnake.env.dice import StreamDice
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.evaluation.match import play
    from racecraft.worlds.battlesnake.evaluation.record import write_record
    from racecraft.worlds.battlesnake.evaluation.seats import take_seat

    def left(board: Board, game: int) -> set[bool]:
        """Return which sides have somebody left; True is the first."""
        return {int(one.id[1:]) % 2 == game % 2 for one in board.alive()}

    keys = stream_keys(SEED_OF_MATCHES, "matches", games.stop // 2 + 1)
    sides = [[take_seat(name) for _ in range(snakes // 2)] for name in (first, second)]
    if think is not None:
        _count_own_time()
        sides = [[_by_the_processor(seat, think / 1000) for seat in side] for side in sides]
    try:
        for game in games:
            order = sides if game % 2 == 0 else sides[::-1]
            seats = [order[number % 2][number // 2] for number in range(snakes)]
            before, watch = [_failures(side) for side in sides], Stopwatch(game)
            played = play(
                GameSettings(size, size, snakes), seats, StreamDice(int(keys[game // 2])), f"match-{game + 1}",
                round(milliseconds), sequential=True, most_turns=MAX_TURNS, watch=watch.set_position,
                until=lambda board, game=game: len(left(board, game)) < 2,
            )  # fmt: skip
            last = left(played.boards[-1], game)
            after = [_failures(side) for side in sides]
            given_up, failed = (
                [now[what] - was[what] for was, now in zip(before, after, strict=True)] for what in (0, 1)
            )
            waited_for = [sum(ms > milliseconds for ms in took) for took in watch.took]
            worth = float(last.pop()) if len(last) == 1 else 0.5
            if lost is not None and worth < 1:
                write_record(played, lost / f"game-{game + 1}.jsonl")
            yield {
                "worth": worth,
                "turns": played.turns,
                "late": given_up if think is None else waited_for,
                "failed": failed,
                "mean_ms": [round(fmean(took), 1) for took in watch.took],
                "most_ms": [max(took) for took in watch.took],
            }
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


def _by_the_processor(seat: Seat, seconds: float) -> Any:
    """Let a player of ours think for so long, and wait for whoever sits there."""
    from racecraft.worlds.battlesnake.players.protocol import SnakePlayer

    if isinstance(seat.player, SnakePlayer):
        seat.player = Told(seat.player, seconds)
    return Patient(seat)


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
    parser.add_argument("--think", type=float, metavar="MS", help="of the processor, against a server")
    parser.add_argument("--lost", type=Path, metavar="FOLDER", help="for games with a server that were not won")
    asked = parser.parse_args()
    from racecraft.evaluation.rating import wilson

    setting = (asked.first, asked.second, asked.size, asked.snakes, asked.milliseconds)
    by_the_clock = any("://" in name for name in (asked.first, asked.second))
    match = dict(zip(("first", "second", "size", "snakes", "milliseconds"), setting, strict=True))
    keeper = Keeper(asked.keep, match | ({} if asked.think is None else {"think": asked.think}))
    if asked.lost is not None:
        asked.lost.mkdir(parents=True, exist_ok=True)
    begun, asked_for = len(keeper.games), asked.games // 2 * 2
    if by_the_clock:
        for game in games_by_the_clock(*setting, range(begun, asked_for), asked.think, asked.lost):
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

    from racecraft.worlds.battlesnake.players import alpha_beta_search, search

    torch.set_num_threads(1)
    alpha_beta_search.time = search.time = SimpleNamespace(monotonic=time.thread_time)


if __name__ == "__main__":
    main()
