"""How many Battlesnake turns a second: `python benchmarks/battlesnake.py [--threads 1]`.

Prints a table, medians of five. Run it on a machine that does nothing else, and write the machine beside the figures.

    rules only       11x11, 4 snakes, random safe moves (choosing them included), set-ups and ends included
    with sight       `BattlesnakeWorld.step`: rules, masks, default observation; choosing moves not included
    referee          the readable one, for comparison
"""

from __future__ import annotations

import argparse
import platform
import time
from collections.abc import Callable
from statistics import median

import numpy as np

from racecraft.contract.world import allocate
from racecraft.envs.battlesnake.dice import StreamDice
from racecraft.envs.battlesnake.kernels.steps import random_safe_play
from racecraft.envs.battlesnake.reference import Referee
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.envs.battlesnake.stages import default_move
from racecraft.envs.battlesnake.world import BattlesnakeWorld, WorldSettings
from racecraft.kernels import set_threads

REPEATS = 5
CASES = (GameSettings(), GameSettings(7, 7, 2), GameSettings(11, 11, 4, "royale", "royale"), GameSettings(19, 19, 8))


def rules_only(settings: GameSettings, num_games: int = 256, turns: int = 400) -> Callable[[], float]:
    """Return a run of the rules alone that gives game-steps a second."""
    world = BattlesnakeWorld(WorldSettings(settings, num_games))
    buffers = allocate(world.spec)
    world.reset(buffers, 1)
    games, moves = world.games, np.zeros((num_games, settings.players), np.int64)

    def run(turns: int = turns) -> float:
        began = time.perf_counter()
        random_safe_play(
            turns, games.bodies, games.snakes, games.games, games.cells, games.sides, games.events, games.chance,
            world.params, world.food_squares, world.start_hazards, moves, buffers.action_mask,
        )  # fmt: skip
        return turns * num_games / (time.perf_counter() - began)

    run(1)
    return run


def with_sight(settings: GameSettings, num_games: int = 256, turns: int = 150) -> Callable[[], float]:
    """Return a run of `BattlesnakeWorld.step` that gives game-steps a second."""
    world = BattlesnakeWorld(WorldSettings(settings, num_games))
    buffers, rng = allocate(world.spec), np.random.default_rng(0)
    world.reset(buffers, 1)

    def run() -> float:
        spent = 0.0
        for _ in range(turns):
            actions = (rng.random(buffers.action_mask.shape) * buffers.action_mask).argmax(axis=-1)
            began = time.perf_counter()
            world.step(actions, buffers)
            spent += time.perf_counter() - began
        world.take_episodes()
        return turns * num_games / spent

    run()
    return run


def referee(settings: GameSettings, turns: int = 1000) -> Callable[[], float]:
    """Return a run of the referee that gives game-steps a second."""

    def run() -> float:
        dice, began = StreamDice(1), time.perf_counter()
        game = Referee(settings, dice)
        for _ in range(turns):
            game = Referee(settings, dice) if game.over else game
            board = game.board
            game.turn({s.id: default_move(s.body, board.width, board.height) for s in board.alive()})
        return turns / (time.perf_counter() - began)

    return run


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--threads", type=int, default=1)
    threads = parser.parse_args().threads
    set_threads(threads)
    print(f"{platform.processor() or platform.machine()}, {threads} thread(s), medians of {REPEATS}")
    print("| benchmark | ruleset/map | board | snakes | game-steps / s |")
    print("|---|---|---|---|---|")
    for make in (rules_only, with_sight, referee):
        for settings in CASES:
            run = make(settings)
            speed = median(run() for _ in range(REPEATS))
            board = f"{settings.width}x{settings.height}"
            name = make.__name__.replace("_", " ")
            print(f"| {name} | {settings.ruleset}/{settings.map} | {board} | {settings.players} | {speed:,.0f} |")


if __name__ == "__main__":
    main()
