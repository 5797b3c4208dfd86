"""How many positions `search` looks at in a second on one core: `python benchmarks/snake_search.py`.

Over 16 positions of games under way between `flood_fill`s on 11×11, duels and four players, no policy anywhere. Seconds
are those of the processor, not of the clock, so that other programs take less from the figures; a busy machine still
does, so that nothing else should run meanwhile.

    rules_a_second            turns played forward with random safe moves, choosing included, no search
    appraisals_a_second       positions appraised by area control, one by one
    sure_positions_a_second   turns that alpha-beta plays, `--turns` of them a position
    sure_leaves_a_second      of those, positions appraised
    sure_depth                turns ahead that were looked at in full
    tree_positions_a_second   turns that walks of the tree play, `--walks` walks a position
    tree_walks_a_second       walks, each with a position appraised at its end

Prints one JSON object, medians of five rounds with the smallest and the largest.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from statistics import median
from typing import Any

import numpy as np

from racecraft.kernels import kernel, set_threads
from racecraft.worlds.battlesnake.env.board import Board
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.alpha_beta_search import AlphaBetaSearch
from racecraft.worlds.battlesnake.players.flood_fill import FloodFill
from racecraft.worlds.battlesnake.players.kernels.position import play_on
from racecraft.worlds.battlesnake.players.kernels.worth import evaluate
from racecraft.worlds.battlesnake.players.mcts import Tree
from racecraft.worlds.battlesnake.players.safe_moves import safe_moves
from racecraft.worlds.battlesnake.players.search_position import fill_buffers, position_of

POSITIONS = 16
ROUNDS = 5
GAMES = 3000
APPRAISALS = 5000
NEVER = 1e9


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=int, default=20_000, help="Turns that alpha-beta plays for a position.")
    parser.add_argument("--walks", type=int, default=4000, help="Walks of each tree.")
    asked = parser.parse_args()
    set_threads(1)
    figures = {f"{snakes} snakes": measure(snakes, asked.turns, asked.walks) for snakes in (2, 4)}
    print(json.dumps(figures | {"load": round(os.getloadavg()[0], 1), "cores": os.cpu_count()}))


def measure(snakes: int, turns: int, walks: int) -> dict[str, Any]:
    """Return the figures of games of so many snakes."""
    settings = GameSettings(11, 11, snakes)
    boards = positions(settings)
    for look in (rules, appraisals, lambda *one: sure(*one, turns), lambda *one: tree(*one, walks)):
        look(boards[:1], settings)  # compiled, and warm
    found: dict[str, list[float]] = {}
    for _ in range(ROUNDS):
        told = rules(boards, settings) | appraisals(boards, settings)
        for name, value in (told | sure(boards, settings, turns) | tree(boards, settings, walks)).items():
            found.setdefault(name, []).append(value)
    return {name: spread(values) for name, values in found.items()}


def positions(settings: GameSettings) -> list[Board]:
    """Return positions of games under way in which the first snake has a choice and nobody has left."""
    found: list[Board] = []
    player, key = FloodFill(), 0
    while len(found) < POSITIONS:
        referee, key = Referee(settings, StreamDice(key)), key + 1
        while not referee.over and len(referee.board.alive()) == settings.players and len(found) < POSITIONS:
            board = referee.board
            if board.turn % 15 == 14 and len(safe_moves(board, settings, "s0")) > 1:
                found.append(board)
            referee.turn({snake.id: player.choose(board, settings, snake.id, 1.0) for snake in board.alive()})
    return found


@kernel
def play_again(times, chance, ways, ring, rows, bits, cells, rules, first_ring, first_rows, first_bits):
    """Play a position to its end over and over; return the turns it took."""
    turns = 0
    for _ in range(times):
        ring[:, : first_ring.shape[1]], rows[0], bits[0] = first_ring, first_rows, first_bits
        turns += play_on(1000, chance, ways, ring, rows, bits, cells, rules)
    return turns


@kernel
def appraise_again(times, ring, rows, bits, cells, edges, rules, pools, found, worths):
    """Appraise a position over and over."""
    for _ in range(times):
        evaluate(0, ring, rows, bits, cells, edges, rules, pools, found, worths)


def rules(boards: list[Board], settings: GameSettings) -> dict[str, float]:
    """Return turns a second without search."""
    turns, seconds, chance = 0, 0.0, np.array([7], np.uint64)
    for board in boards[:4]:
        position = position_of(board, settings)
        ring, rows, bits, cells, _, numbers = position
        first = ring[:, :128].copy(), rows[0].copy(), bits[0].copy()
        ways = np.zeros((1, settings.players), np.int64)
        began = time.process_time()
        turns += play_again(GAMES // len(boards), chance, ways, ring, rows, bits, cells, numbers, *first)
        seconds += time.process_time() - began
    return {"rules_a_second": turns / seconds}


def appraisals(boards: list[Board], settings: GameSettings) -> dict[str, float]:
    """Return positions appraised a second."""
    seconds = 0.0
    for board in boards:
        position = position_of(board, settings)
        room = (*fill_buffers(position), np.zeros(settings.players))
        began = time.process_time()
        appraise_again(APPRAISALS, *position, *room)
        seconds += time.process_time() - began
    return {"appraisals_a_second": APPRAISALS * len(boards) / seconds}


def sure(boards: list[Board], settings: GameSettings, turns: int) -> dict[str, float]:
    """Return what alpha-beta does in a second, and how deep it looks in so many turns."""
    seconds, played, leaves, depth = 0.0, 0, 0, 0
    for board in boards:
        certainty = AlphaBetaSearch(board, settings, "s0")
        began = time.process_time()
        found = certainty.deepen(NEVER, turns)
        seconds += time.process_time() - began
        played, leaves, depth = played + found.turns, leaves + found.leaves, depth + found.depth
    return {
        "sure_positions_a_second": played / seconds, "sure_leaves_a_second": leaves / seconds,
        "sure_depth": depth / len(boards),
    }  # fmt: skip


def tree(boards: list[Board], settings: GameSettings, walks: int) -> dict[str, float]:
    """Return what walks of the tree do in a second."""
    seconds, plies = 0.0, 0
    for board in boards:
        grown = Tree(board, settings, "s0")
        began = time.process_time()
        grown.simulate(walks)
        seconds += time.process_time() - began
        plies += grown.turns_walked()
    return {"tree_positions_a_second": plies / seconds, "tree_walks_a_second": walks * len(boards) / seconds}


def spread(values: list[float]) -> list[float]:
    """Return the median, the smallest and the largest."""
    return [round(value, 2) if value < 100 else round(value) for value in (median(values), min(values), max(values))]


if __name__ == "__main__":
    main()
