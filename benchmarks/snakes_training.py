"""A snake trained for ten minutes by `racecraft snakes train`: its duels on 11x11, greedy and with search on top.

    python benchmarks/snakes_training.py                     what the table shows; about half an hour on two cores
    python benchmarks/snakes_training.py --minutes 2 --search-games 0
    python benchmarks/snakes_training.py --from runs/snakes-1   judge a run that stands

Greedy: 400 duels of the best checkpoint against flood_fill, seats swapped from game to game, no search. The share is
games won out of all, so a draw (both gone on the same turn, or 1,000 turns) counts as not won; interval by Wilson.
With search: `search+RUN` against `search`, equal time for a move, seats swapped on the same dice, a draw counts half.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor

DUELS, SEED_OF_DUELS = 400, 2_000_003


def trained(minutes: float, seed: int, place: str) -> dict:
    """Train; return what the command tells."""
    command = [sys.executable, "-m", "racecraft", "snakes", "train", "--size", "11", "--snakes", "2", "--json"]
    command += ["--stop", f"minutes={minutes:g}", "--seed", str(seed), "--run", place]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout)


def greedy_duels(place: str, games: int) -> dict:
    """Play the policy alone against flood_fill, all games side by side."""
    from racecraft.evaluation.rating import wilson
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.env.world import WorldSettings
    from racecraft.worlds.battlesnake.evaluation.batch import play_batch
    from racecraft.worlds.battlesnake.players.trained import load_trained_snake
    from racecraft.worlds.battlesnake.training.evaluator import count

    snake = load_trained_snake(place)
    world = WorldSettings(GameSettings(11, 11, 2), view=snake.seen.view, outlook=snake.seen.outlook)
    tally = count(play_batch([snake.policy, "flood_fill"], world, games, SEED_OF_DUELS))
    low, high = wilson(tally.won, tally.games)
    told = {"games": tally.games, "won": tally.won, "drawn": tally.drawn, "lost": tally.lost}
    return {**told, "won_share": tally.won / tally.games, "low": round(low, 4), "high": round(high, 4)}


def search_duel(place: str, milliseconds: float, pair: int) -> list[float]:
    """Play two games on the same dice, seats swapped; return what each was worth to the policy's side."""
    from racecraft.contract.random_streams import stream_keys
    from racecraft.worlds.battlesnake.env.dice import StreamDice
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.evaluation.match import play
    from racecraft.worlds.battlesnake.evaluation.seats import THINKING_SHARE, take_seat

    key = int(stream_keys(SEED_OF_DUELS, "search duels", pair + 1)[pair])
    mine, other = take_seat(f"search+{place}", "mine"), take_seat("search", "other")
    timeout = round(milliseconds / THINKING_SHARE)
    worths = []
    for seats in ([mine, other], [other, mine]):
        places = play(GameSettings(11, 11, 2), seats, StreamDice(key), timeout_ms=timeout, most_turns=1000).places()
        own = places[seats.index(mine)]
        worths.append(0.5 if places[0] == places[1] else float(own == 0))
    return worths


def search_duels(place: str, games: int, milliseconds: float) -> dict:
    """Play policy plus search against search, one pair of games on each core."""
    from racecraft.evaluation.rating import wilson

    pairs = range(games // 2)
    with ProcessPoolExecutor(os.cpu_count(), initializer=_one_thread) as cores:
        asked = [cores.submit(search_duel, place, milliseconds, pair) for pair in pairs]
        worths = [worth for one in asked for worth in one.result()]
    score = sum(worths)
    low, high = wilson(score, len(worths))
    return {
        "games": len(worths), "won": worths.count(1.0), "drawn": worths.count(0.5), "lost": worths.count(0.0),
        "score_share": score / len(worths), "low": round(low, 4), "high": round(high, 4),
        "milliseconds_a_move": milliseconds,
    }  # fmt: skip


def _one_thread() -> None:
    import torch

    torch.set_num_threads(1)


def main() -> None:
    """Train, play, print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--duels", type=int, default=DUELS)
    parser.add_argument("--search-games", type=int, default=100)
    parser.add_argument("--milliseconds", type=float, default=25.0, help="for a move, with search")
    parser.add_argument("--from", dest="run", help="a run that stands, instead of training")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        place, told = asked.run or f"{folder}/run", {}
        if asked.run is None:
            figures = trained(asked.minutes, asked.seed, place)
            kept = ("seconds", "env_steps", "env_steps_per_second", "iterations", "seed")
            told = {"minutes": asked.minutes, **{name: figures[name] for name in kept}}
            told["rating"] = round(figures["evaluation"]["rating"]) if figures["evaluation"] else None
        told["greedy_against_flood_fill"] = greedy_duels(place, asked.duels)
        if asked.search_games >= 2:
            told["with_search_against_search"] = search_duels(place, asked.search_games, asked.milliseconds)
    print(json.dumps(told))


if __name__ == "__main__":
    main()
