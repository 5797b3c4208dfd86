"""Snakes play a heat: a game for each seat, on equal dice. Begin with `play_heat`.

Every move is recorded. The same moves on the same dice give the same game (`replay_heat`), whoever thinks how fast; so
a search, a server and a file can be audited as a run can.

    moves.json          a game each: seats' moves by turn, and how often each was late or failed
    game-1.jsonl        the official output file of the first game, which `racecraft snakes` watches, studies, verifies
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.contract.random_streams import stream_keys
from racecraft.formats.user_file import read_regular
from racecraft.league.race import Outcome
from racecraft.league.world_part import OnProgress
from racecraft.worlds.battlesnake.env.board import MOVES, Board
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.match import Played, play
from racecraft.worlds.battlesnake.evaluation.record import record_text
from racecraft.worlds.battlesnake.evaluation.seats import Seat
from racecraft.worlds.battlesnake.league.race_rules import SnakeRules
from racecraft.worlds.battlesnake.players.messages import GameCard

RECORDED = "moves.json"
VERSION = 1


@dataclass(frozen=True)
class HeatGame:
    """One game of a heat."""

    seated: tuple[int, ...]
    """Which player sat where."""
    played: Played
    faults: tuple[int, ...]
    """Moves that came late or were none, seat by seat."""


def play_heat(
    seats: Sequence[Seat], settings: GameSettings, rules: SnakeRules, seed: int, on_progress: OnProgress
) -> list[HeatGame]:
    """Let players meet: as many games as players, each of which sits once on every seat.

    Args:
        seats: Of the players.
        settings: Of a game.
        rules: Of the race.
        seed: Of all chance.
        on_progress: Is called before each game.
    """
    games: list[HeatGame] = []
    for seated in _rotations(len(seats)):
        on_progress(len(games) / len(seats), f"game {len(games) + 1} of {len(seats)}", ())
        games.append(_play(seats, seated, settings, rules, seed))
    return games


def replay_heat(folder: Path, settings: GameSettings, rules: SnakeRules, seed: int) -> list[HeatGame]:
    """Play a heat again by its recorded moves.

    Raises:
        InputFileError: They are missing or damaged.
        BoardError: They are of another game.
    """
    try:
        told = json.loads(read_regular(folder / RECORDED))
        pairs = list(zip(_rotations(settings.players), told["games"], strict=True))
        return [
            HeatGame(seated, _replay(settings, rules, seed, game["moves"]), tuple(map(int, game["faults"])))
            for seated, game in pairs
        ]
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        raise InputFileError(folder / RECORDED, f"damaged ({error})", "moves that a league recorded") from error


def outcomes_of(games: Sequence[HeatGame]) -> tuple[Outcome, ...]:
    """Return what each player did in a heat."""
    players = range(len(games[0].seated))
    seats = [[game.seated.index(player) for game in games] for player in players]
    places = [
        tuple(1 + game.played.places()[seat] for game, seat in zip(games, seats[player], strict=True))
        for player in players
    ]
    keys = [(-sum(place == 1 for place in own), sum(own)) for own in places]
    return tuple(
        Outcome(
            place=1 + sum(other < keys[player] for other in keys),
            places=places[player],
            faults=sum(game.faults[seat] for game, seat in zip(games, seats[player], strict=True)),
            ended=games[-1].played.boards[-1].snakes[seats[player][-1]].cause or "alive",
            digest=_digest(games),
        )
        for player in players
    )


def files_of(games: Sequence[HeatGame]) -> dict[str, bytes]:
    """Return the files of a heat by their paths."""
    told = {"version": VERSION, "games": [{"moves": _moves(one.played), "faults": one.faults} for one in games]}
    records = {f"game-{number}.jsonl": record_text(one.played) for number, one in enumerate(games, start=1)}
    texts = {RECORDED: json.dumps(told, separators=(",", ":")), **records}
    return {name: text.encode() for name, text in texts.items()}


def _rotations(players: int) -> list[tuple[int, ...]]:
    return [tuple((seat + first) % players for seat in range(players)) for first in range(players)]


def _play(
    seats: Sequence[Seat], seated: tuple[int, ...], settings: GameSettings, rules: SnakeRules, seed: int
) -> HeatGame:
    own = [seats[player] for player in seated]
    before = [_faults(seat) for seat in own]
    name = f"heat-{seed}-{seated[0] + 1}"
    played = play(settings, own, _dice(seed), name, rules.timeout_ms, most_turns=rules.most_turns)
    return HeatGame(seated, played, tuple(_faults(seat) - was for seat, was in zip(own, before, strict=True)))


def _replay(settings: GameSettings, rules: SnakeRules, seed: int, moves: Sequence[Mapping[str, str]]) -> Played:
    referee = Referee(settings, _dice(seed))
    played = Played(settings, GameCard("heat", rules.timeout_ms), [referee.board])
    for letters in moves:
        played.moves.append({f"s{seat}": MOVES[int(letter)] for seat, letter in enumerate(letters) if letter != "-"})
        played.boards.append(referee.turn(played.moves[-1]))
    played.over = referee.over
    return played


def _moves(played: Played) -> list[str]:
    """Return a text a turn: a digit for each seat, its index in MOVES, or "-"."""
    seats = [snake.id for snake in played.boards[0].snakes]
    return [
        "".join(str(MOVES.index(turn[seat])) if seat in turn else "-" for seat in seats) for turn in played.moves
    ]  # fmt: skip


def _faults(seat: Seat) -> int:
    return seat.failures.timeouts + seat.failures.crashes


def _dice(seed: int) -> StreamDice:
    return StreamDice(int(stream_keys(seed, "snake race", 1)[0]))


def _digest(games: Sequence[HeatGame]) -> str:
    """Return the SHA-256 of every position of every game."""
    found = hashlib.sha256()
    for game in games:
        for board in game.played.boards:
            found.update(json.dumps(_position(board), separators=(",", ":")).encode())
    return found.hexdigest()


def _position(board: Board) -> list[Any]:
    snakes = [[one.id, one.body, one.health, one.cause, one.by, one.on] for one in board.snakes]
    return [board.turn, snakes, board.food, sorted(Counter(board.hazards).items())]
