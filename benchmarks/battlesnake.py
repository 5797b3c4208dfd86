"""How many Battlesnake turns a second: `python benchmarks/battlesnake.py`.

Prints a table, medians of five, and the figures of the default game as JSON. Nothing else should run meanwhile.

    rules only       11x11, 4 snakes, random safe moves (choosing them included), set-ups and ends included, one game
                     after the other
    with sight       `BattlesnakeWorld.step`: rules, masks, default observation; choosing moves not included
    referee          the readable one, for comparison
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from statistics import median

import numpy as np

from racecraft.contract.world import allocate
from racecraft.kernels import set_threads
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.kernels.steps import random_safe_play
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import default_move
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, WorldSettings

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
        world.pop_episodes()
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
    """Measure, print the table, and the figures as JSON on the last line."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    figures = main_figures()
    set_threads(1)
    print("| benchmark, one core | ruleset/map | board | snakes | game-steps / s |")
    print("|---|---|---|---|---|")
    for make in (rules_only, with_sight, referee):
        for settings in CASES:
            run = make(settings)
            speed = median(run() for _ in range(REPEATS))
            board = f"{settings.width}x{settings.height}"
            name = make.__name__.replace("_", " ")
            print(f"| {name} | {settings.ruleset}/{settings.map} | {board} | {settings.players} | {speed:,.0f} |")
    print(json.dumps(figures))


def main_figures() -> dict[str, int]:
    """Return 11x11 with 4 snakes: medians, lowest and highest of the rounds.

    Two cores are set against one with 2,048 games, where handing a share to a thread costs next to nothing.
    """
    rounds = interleaved({"rules_one_core": (1, rules_only(GameSettings()))})
    rounds |= interleaved({"sight_one_core": (1, with_sight(GameSettings()))})
    many = with_sight(GameSettings(), 2048, 30)
    rounds |= interleaved({"many_one_core": (1, many), "many_two_cores": (2, many)})
    told: dict[str, int] = {}
    for name, speeds in rounds.items():
        told |= {name: round(median(speeds)), f"{name}_low": round(min(speeds)), f"{name}_high": round(max(speeds))}
    return told


def interleaved(cases: dict[str, tuple[int, Callable[[], float]]]) -> dict[str, list[float]]:
    """Return the speeds of each case, (cores, run), measured in turn."""
    rounds: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(3 * REPEATS):
        for name, (cores, run) in cases.items():
            set_threads(cores)
            rounds[name].append(run())
    return rounds


if __name__ == "__main__":
    main()
