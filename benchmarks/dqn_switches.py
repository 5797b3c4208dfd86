"""What each switch of DQN does on CartPole-v1: greedy return after so many steps, over seeds.

    python benchmarks/dqn_switches.py --seeds 1 2 3 --out curves.jsonl     one line a run; may be broken off
    python benchmarks/dqn_switches.py --draw curves.jsonl --figure docs/pictures/dqn.png

All runs share network, optimiser and exploration (`BASE`); a row changes one switch. Every 1,024 steps ten greedy
episodes are played. The figure of a run is the mean of those returns over its second half; 500 is the best there is.
"""

from __future__ import annotations

import argparse
import json
import statistics
from pathlib import Path
from typing import Any

STEPS, EVERY, EPISODES, WORLDS, HORIZON = 16_384, 4, 10, 8, 32
BASE: dict[str, Any] = {
    "learning_rate": 1e-3, "batch_size": 64, "train_every": 2, "target_every": 128, "epsilon_last": 0.04,
    "epsilon_steps": 8000, "optimiser": "adam", "max_grad_norm": 10.0,
}  # fmt: skip
ROWS: dict[str, dict[str, Any]] = {
    "plain": {},
    "double": {"double": True},
    "dueling": {"dueling": True},
    "n_step=3": {"n_step": 3},
    "prioritised": {"prioritised": True},
    "all four": {"double": True, "dueling": True, "n_step": 3, "prioritised": True},
}


def curve(seed: int, switches: dict[str, Any]) -> list[tuple[int, float]]:
    """Train once; return (steps, mean greedy return) of each evaluation."""
    import torch

    from racecraft.algorithms.dqn import DqnConfig, DqnLearner
    from racecraft.algorithms.networks import NetworkConfig
    from racecraft.players.trained import GreedyPolicy
    from racecraft.rollout.collector import Collector
    from racecraft.rollout.episodes import play_episodes
    from racecraft.rollout.replay import Replay
    from racecraft.rollout.replay_settings import ReplayConfig
    from racecraft.rollout.statistics import summarise
    from racecraft.worlds.gymnasium.env.from_gymnasium import GymnasiumWorld

    torch.set_num_threads(1)
    own = dict(switches)
    memory = ReplayConfig(prioritised=own.pop("prioritised", False), importance_steps=STEPS)
    world, judged = GymnasiumWorld("CartPole-v1", WORLDS), GymnasiumWorld("CartPole-v1", EPISODES)
    config = DqnConfig(**BASE, **own)
    learner = DqnLearner(world.spec, NetworkConfig(hidden_units=(128, 128)), config, seed)
    collector = Collector(world, learner, HORIZON, seed)
    replay, found = Replay(world.spec, memory, config.discount, config.n_step), []
    for iteration in range(1, STEPS // (WORLDS * HORIZON) + 1):
        if (fed := replay.add(collector.collect())) is not None:
            learner.update(fed)
        if iteration % EVERY == 0:
            played = play_episodes(GreedyPolicy(learner), judged, episodes_each=1, seed=seed + 50)
            found.append((collector.steps_taken, summarise(played).mean_reward))
    return found


def read(path: Path) -> dict[str, list[list[tuple[int, float]]]]:
    """Return the curves by row."""
    found: dict[str, list[list[tuple[int, float]]]] = {}
    for line in path.read_text().splitlines():
        told = json.loads(line)
        found.setdefault(told["row"], []).append(told["curve"])
    return {name: found[name] for name in ROWS if name in found}


def draw(path: Path, figure: str | None) -> None:
    """Print the table, and draw the curves."""
    found = read(path)
    for name, curves in found.items():
        late = [statistics.mean(score for steps, score in one if steps > STEPS // 2) for one in curves]
        told = ", ".join(f"{value:.0f}" for value in late)
        print(f"{name:12} {statistics.mean(late):5.0f}   of {len(late)} seeds: {told}")
    if figure is None:
        return
    import matplotlib.pyplot as plt

    picture, axes = plt.subplots(2, 3, figsize=(9, 4.6), sharex=True, sharey=True, layout="constrained")
    for place, (name, curves) in zip(axes.flat, found.items(), strict=False):
        steps = [point[0] / 1000 for point in curves[0]]
        for one in curves:
            place.plot(steps, [point[1] for point in one], color="#888888", linewidth=0.7)
        mean = [statistics.mean(values) for values in zip(*([p[1] for p in one] for one in curves), strict=True)]
        place.plot(steps, mean, color="#0b6e99", linewidth=2)
        place.set_title(f"{name}, {len(curves)} seeds", fontsize=10)
        place.set_ylim(0, 510)
        place.grid(alpha=0.25)
    for place in axes[1]:
        place.set_xlabel("thousand steps")
    for place in axes[:, 0]:
        place.set_ylabel("greedy return")
    for place in axes.flat[len(found) :]:
        place.set_visible(False)
    picture.savefig(figure, dpi=110)


def main() -> None:
    """Run or draw."""
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    options.add_argument("--out", type=Path, default=Path("curves.jsonl"))
    options.add_argument("--draw", type=Path)
    options.add_argument("--figure")
    asked = options.parse_args()
    if asked.draw is not None:
        draw(asked.draw, asked.figure)
        return
    for seed in asked.seeds:
        for name, switches in ROWS.items():
            line = json.dumps({"row": name, "seed": seed, "curve": curve(seed, switches)})
            with asked.out.open("a") as file:
                file.write(line + "\n")


if __name__ == "__main__":
    main()
