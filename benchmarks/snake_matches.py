"""Two ways to play against each other, at equal time for a move: which search serves where.

    python benchmarks/snake_matches.py search:runs/snakes-1 search                   duels on 11x11, 25 ms a move
    python benchmarks/snake_matches.py search search:runs/snakes-1 --snakes 4        two of each at a board

Every two games have the same dice, with the seats swapped. A duel that is drawn (both gone on the same turn, or 1,000
turns) counts half to each; among four the game is won by the side of the last snake alive, and drawn where there is
none. Interval by Wilson over games, draws as half wins. A move's time is that of the processor, not of the clock, so
that other programs on the machine do not decide games; nobody ponders, and nobody can be late. Prints one JSON object.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from types import SimpleNamespace

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
        while not referee.over and referee.board.turn < MOST_TURNS:
            board = referee.board
            referee.turn(
                {one.id: players[one.id].choose(board, settings, one.id, milliseconds / 1000) for one in board.alive()}
            )
        left = {seated[one.id] for one in referee.board.alive()}
        told.append({"worth": float(left == {first}) if len(left) == 1 else 0.5, "turns": referee.board.turn})
    return told


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
    asked = parser.parse_args()
    from racecraft.evaluation.rating import wilson

    setting = (asked.first, asked.second, asked.size, asked.snakes, asked.milliseconds)
    with ProcessPoolExecutor(asked.cores, initializer=_count_own_time) as cores:
        under_way = [cores.submit(pair_of_games, *setting, pair) for pair in range(asked.games // 2)]
        games = [game for one in under_way for game in one.result()]
    worths = [game["worth"] for game in games]
    low, high = wilson(sum(worths), len(worths))
    figures = {
        "first": asked.first, "second": asked.second, "board": f"{asked.size}x{asked.size}", "snakes": asked.snakes,
        "milliseconds_a_move": asked.milliseconds, "games": len(worths), "won": worths.count(1.0),
        "drawn": worths.count(0.5), "lost": worths.count(0.0), "score": round(sum(worths) / len(worths), 3),
        "low": round(low, 3), "high": round(high, 3), "mean_turns": round(sum(g["turns"] for g in games) / len(games)),
    }  # fmt: skip
    print(json.dumps(figures))


def _count_own_time() -> None:
    """Let search look at the processor's seconds; torch then has to stay on its thread."""
    import torch

    from racecraft.players.battlesnake import certainty, search

    torch.set_num_threads(1)
    certainty.time = search.time = SimpleNamespace(monotonic=time.thread_time)


if __name__ == "__main__":
    main()
