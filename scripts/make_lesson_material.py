"""Train what the lessons show, again and with this version: `python scripts/make_lesson_material.py [FOLDER]`.

    curves.json     3 learning rates × 3 seeds: progress of each iteration (lesson 9)
    tracks.json     cars trained on one track or three, each judged on five tracks from five starts (lesson 11)
    drive.json      one of them with what was commanded and what was driven (lesson 7)
    sight.json      what a car's network decides at pictures of its lap, whole, partly covered and mirrored (lesson 8)
    shapes.json     centre lines of eight tracks, turned at random (lesson 11)
    real.json       a car's laps under each disturbance by itself (lesson 12)
    learning.json   a car's drives while it learned: the furthest of each iteration, 15 poses a second (lesson 1)
    basic.json      three learners of Unity's Basic with three seeds each, and the numbers of one network (U2, U5, U6)

and for the lessons about snakes:

    tournament.json four quick snakes, every pair six games, with intervals (lesson S3)
    runs.json       mean rewards of four ways of collecting, from benchmarks/four-runs.md (lesson S5)

and for the lessons of no world:

    target.json     DQN on CartPole with its target network copied seldom and at every update, by seed (lesson 10)

Runs are made in a folder of their own (by default a temporary one) and kept if it is named; a run that is there already
is not trained again. About 45 minutes of a core. Versions, machine and seeds are written into each file.

Made again with the same version on the same kind of machine, the files are the same to the byte: the car, its reward,
the threads and what a preset may change are pinned here (`CAR`, `PINNED`).
"""

from __future__ import annotations

import json
import math
import platform
import re
import subprocess
import sys
import tempfile
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import torch

import racecraft
from racecraft.algorithms.explainable import Explainable
from racecraft.analysis.attribution import SeeingPolicy, transparent
from racecraft.contract.world import Array
from racecraft.evaluation.rating import wilson
from racecraft.players.trained import load_policy
from racecraft.worlds.deepracer.analysis.drive import Drive
from racecraft.worlds.deepracer.analysis.saliency import SaliencySeries, look_at
from racecraft.worlds.deepracer.evaluation.drive import DriveKeeper
from racecraft.worlds.deepracer.evaluation.laps import judge_laps
from racecraft.worlds.deepracer.lessons.sight import patches
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.unity.env import basic_scene

ROOT = Path(__file__).resolve().parents[1]
WORLDS = ROOT / "src/racecraft/worlds"
RATES, SEEDS, ITERATIONS = ("3e-5", "3e-4", "3e-3"), (1, 2, 3), 20
REWARD = """
class Before:
    steps, progress, steering = float("inf"), 0.0, 0.0


def reward_function(params):
    steps, progress, steering = params["steps"], params["progress"], params["steering_angle"]
    if steps <= Before.steps:  # a new episode
        Before.progress, Before.steering = progress, steering
    metres = (progress - Before.progress) / 100.0 * params["track_length"]
    turned = abs(steering - Before.steering) / 30.0
    Before.steps, Before.progress, Before.steering = steps, progress, steering
    return 2.0 * metres - 0.1 * turned
"""
TRAINED = {
    "reinvent_base": ["--track", "reinvent_base"],
    "Oval_track": ["--track", "Oval_track"],
    "Bowtie_track": ["--track", "Bowtie_track"],
    "three tracks": ["--tracks", "reinvent_base,Oval_track,Bowtie_track"],
}
CAR = {
    "model_metadata.json": json.dumps({
        "action_space": [{"steering_angle": angle, "speed": speed} for angle in (-30, -20, -10, 0, 10, 20, 30)
                         for speed in (1.5, 2.5)],
        "sensor": ["FRONT_FACING_CAMERA"], "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
        "training_algorithm": "clipped_ppo", "action_space_type": "discrete", "version": "6",
    }),
    "hyperparameters.json": "{}",
    "reward_function.py": REWARD,
}  # fmt: skip
"""The racer's folder of every run."""
PINNED = (
    "runtime.threads=1", "rollout.horizon=64", "rollout.num_worlds=32", "ppo.epochs=4",
    "ppo.batch_size=256", "ppo.discount=0.97", "ppo.entropy_weight=0.003", "ppo.learning_rate_schedule=linear",
    "network.stack_size=3",
)  # fmt: skip
JUDGED = ("reinvent_base", "Oval_track", "Bowtie_track", "reInvent2019_track", "China_track")
MATRIX_ITERATIONS = {"three tracks": 60}
SMALL = "PPO, 8 units"
LEARNERS = {"PPO": [], SMALL: ["--set", "network.hidden_units=8"], "DQN": ["--algorithm", "dqn"]}
COPIED_EVERY = (128, 1)
"""Updates between two copies of DQN's target network; 1: none, in effect."""
SNAKES = ("area_control", "flood_fill", "hungry", "random_safe")
SHAPES = (
    "reInvent2019_track", "2024_reinvent_champ_cw", "Vegas_track", "China_track", "Oval_track", "Tokyo_Training_track",
    "2022_summit_speedway", "New_York_Track",
)  # fmt: skip
"""The second and the seventh are one road, driven the other way and narrower."""
SHAPE_POINTS = 48
STARTS = 5
TRIES = 20
PICTURES = 8
CELLS = (6, 8)
"""Rows and columns of squares into which a picture is cut; patches and heat are told in them."""


def main() -> None:
    """Train what is missing, and write the files."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp(prefix="lesson-material-"))
    folder.mkdir(parents=True, exist_ok=True)
    write("target.json", target_network(), "")
    write("tournament.json", tournament(), "battlesnake")
    write("runs.json", four_runs(), "battlesnake")
    write("curves.json", curves(folder))
    write("learning.json", learning(folder / f"rate-{RATES[1]}-1"))
    write("drive.json", driven(folder / f"rate-{RATES[1]}-1"))
    write("shapes.json", shapes())
    write("tracks.json", tracks(folder))
    write("real.json", real(folder / "on-reinvent_base"))
    write("sight.json", sight(folder / "on-reinvent_base"))
    write("basic.json", basic(folder), "unity")


def curves(folder: Path) -> dict[str, Any]:
    """Return progress of each iteration, while training and greedy, by learning rate and seed."""
    rows = []
    for rate in RATES:
        for seed in SEEDS:
            run = train(folder / f"rate-{rate}-{seed}", ITERATIONS, seed, "--set", f"ppo.learning_rate={rate}")
            lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
            rows.append({
                "rate": rate, "seed": seed,
                "training": [round(line["training_score"], 1) for line in lines],
                "evaluated": [[line["iteration"], round(line["evaluation_score"], 1)] for line in lines
                              if line.get("evaluation_score") is not None],
                "entropy": [round(line["entropy"], 3) for line in lines],
            })  # fmt: skip
    return {"track": "reinvent_base", "rows": rows}


def learning(run: Path) -> dict[str, Any]:
    """Return of each iteration the drive that ended in it and came furthest: x and y in cm."""
    table = episodes(run)
    furthest = table.filter(pl.col("done")).sort("iteration", "progress_share", "world", "episode")
    drives = []
    for last in furthest.group_by("iteration", maintain_order=True).last().iter_rows(named=True):
        one = table.filter((pl.col("world") == last["world"]) & (pl.col("episode") == last["episode"])).sort("tick")
        xy = (100 * one.select("x_m", "y_m").to_numpy()).round().astype(int)
        drives.append({
            "iteration": last["iteration"], "reward": round(float(one["reward"].sum()), 1),
            "progress": round(100 * float(last["progress_share"]), 1),
            "x": xy[:, 0].tolist(), "y": xy[:, 1].tolist(), "status": last["status"],
        })  # fmt: skip
    return {"track": "reinvent_base", "tick_seconds": 1 / 15, "drives": drives}


def episodes(run: Path) -> pl.DataFrame:
    """Return every tick of a training's drives."""
    return pl.concat([pl.read_parquet(path) for path in sorted((run / "episodes").glob("*.parquet"))])


def driven(run: Path) -> dict[str, Any]:
    """Return the furthest drive of a run, tick by tick: what a reward function is told, and the speed really driven."""
    table = episodes(run)
    last = table.filter(pl.col("done")).sort("progress_share", "world", "episode").row(-1, named=True)
    one = table.filter((pl.col("world") == last["world"]) & (pl.col("episode") == last["episode"])).sort("tick")

    def column(name: str, factor: float = 1.0, digits: int = 2) -> list[float]:
        return [round(factor * float(value), digits) for value in one[name]]

    return {
        "track": "reinvent_base", "width": 0.76, "tick_seconds": 1 / 15,
        "centre": load_track("reinvent_base").centre.round(2).tolist(),
        "x": column("x_m"), "y": column("y_m"), "heading": column("yaw_rad", 180 / math.pi, 1),
        "steering": column("steering_rad", 180 / math.pi, 1), "commanded": column("speed_mps"),
        "driven": column("velocity_mps"), "progress": column("progress_share", 100, 1),
        "distance": column("distance_from_center_m", 1.0, 3),
        "on_track": [bool(on) for on in one["all_wheels_on_track"]],
        "waypoint": [int(at) for at in one["closest_waypoint"]],
    }  # fmt: skip


def tracks(folder: Path) -> dict[str, Any]:
    """Return the share of the lap that each car completes on each track, from five starts."""
    rows = []
    for name, words in TRAINED.items():
        run = train(folder / f"on-{name.replace(' ', '-')}", MATRIX_ITERATIONS.get(name, 30), 1, *words)
        found = racecraft_json("evaluate", str(run), "--tracks", ",".join(JUDGED), "--laps", str(STARTS), "--json")
        judged = {one["track"]: one for one in found["tracks"]}
        rows.append({
            "trained": name, "on": words[1].split(","), "full_laps": [judged[one]["full_laps"] for one in JUDGED],
            "progress": [round(judged[one]["mean_progress_percent"], 1) for one in JUDGED],
        })  # fmt: skip
    return {"columns": JUDGED, "starts": STARTS, "rows": rows}


def target_network() -> dict[str, Any]:
    """Return DQN's mean greedy return over the second half of its steps, by how seldom the target network is copied."""
    sys.path.insert(0, str(ROOT / "benchmarks"))
    import dqn_switches

    rows = []
    for every in COPIED_EVERY:
        dqn_switches.BASE["target_every"] = every
        for seed in SEEDS[:2]:
            returns = [mean for _, mean in dqn_switches.curve(seed, {})]
            late = returns[len(returns) // 2 :]
            rows.append({"copied_every": every, "seed": seed, "mean": round(sum(late) / len(late), 1)})
    return {"rows": rows}


def tournament() -> dict[str, Any]:
    """Return of each pair of quick snakes how many games the first won, and the interval of that share, per cent."""
    words = ("snakes", "tournament", *SNAKES, "--rounds", "3", "--timeout", "1000", "--json")
    met, rows = racecraft_json(*words)["head_to_head"], []
    for one, other in combinations(SNAKES, 2):
        result = met[one][other]
        games = sum(result.values())
        low, high = wilson(result["won"] + result["drawn"] / 2, games)
        rows.append({"pair": f"{one} against {other}", "games": games, "won": result["won"],
                     "low": round(100 * low), "high": round(100 * high)})  # fmt: skip
    return {"rows": rows}


def four_runs() -> dict[str, Any]:
    """Return the rewards of three seeds of each row of the article's chart, as the benchmark's page has them."""
    rows = []
    for line in (ROOT / "benchmarks/four-runs.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        pairs = [re.fullmatch(r"(-?[\d.]+), \d+", cell) for cell in cells[1:4]]
        if len(cells) == 5 and all(pairs):
            rows.append({"training": cells[0], "rewards": [float(pair[1]) for pair in pairs if pair]})
    return {"source": "benchmarks/four-runs.md", "rows": rows}


def shapes() -> dict[str, Any]:
    """Return of each of SHAPES letter, length, width, and its centre line turned at random: points in cm."""
    rng, found = np.random.default_rng(11), []
    for letter, name in zip("abcdefgh", SHAPES, strict=True):
        track = load_track(name)
        steps = np.hypot(*np.diff(track.centre, axis=0).T)
        arc = np.concatenate([[0.0], np.cumsum(steps)])
        at = np.linspace(0, arc[-1], SHAPE_POINTS, endpoint=False)
        line = np.interp(at, arc, track.centre[:, 0]) + 1j * np.interp(at, arc, track.centre[:, 1])
        turned = 100 * (line - line.mean()) * np.exp(1j * rng.uniform(0, 2 * math.pi))
        points = np.column_stack([turned.real, turned.imag]).round().astype(int)
        found.append({"letter": letter, "name": name, "length": round(float(arc[-1]), 2),
                      "width": round(track.width_mean, 2), "points": points.tolist()})  # fmt: skip
    return {"tracks": found}


def real(run: Path) -> dict[str, Any]:
    """Return a car's full laps under each disturbance by itself, with the interval of their share in per cent."""
    found = racecraft_json("evaluate", str(run), "--under", "strong", "--each", "--tries", str(TRIES), "--json")
    rows = [
        {"disturbance": bar["disturbance"], "laps": bar["full_laps"],
         "low": round(100 * bar["full_laps_share_low"]), "high": round(100 * bar["full_laps_share_high"])}
        for bar in found["bars"]
    ]  # fmt: skip
    return {"track": "reinvent_base", "tries": TRIES, "rows": rows}


def sight(run: Path) -> dict[str, Any]:
    """Return what the network of a run decides along one lap, and at some of its pictures in detail."""
    car, keeper = load_trained_car(run), DriveKeeper()
    eyes = SeeingPolicy(car.policy)
    judge_laps(eyes, car.world(car.trained_on, num_cars=1, start_shares=[0.0], laps=1), 1, [keeper])
    look = look_at(car.policy, eyes.seen, car.policy.spec.actions)
    network, fed = transparent(car.policy), eyes.seen.inputs[look.name]
    sure, lap = look.confidence, Drive.from_reports(keeper.drive)
    chosen = np.linspace(0, len(look) - 1, PICTURES).round().astype(int)
    return {
        "track": car.trained_on.name, "lap": round(float(lap.progress_percent[-1]), 1), "rows": CELLS[0],
        "columns": CELLS[1], "height": look.frames.shape[1], "width": look.frames.shape[2], "actions": look.labels,
        "steps": [[int(best), int(second), *percents([one, other])] for best, second, one, other
                  in zip(sure.best, sure.second, sure.share, sure.second_share, strict=True)],
        "pictures": [seen_at(network, look, fed, int(at)) for at in chosen],
    }  # fmt: skip


def seen_at(network: Explainable, look: SaliencySeries, fed: torch.Tensor, at: int) -> dict[str, Any]:
    """Return a picture, its heat by square, and what is decided at it, whole, covered and mirrored."""
    whole = fed[at : at + 1]
    covered = whole.repeat(len(patches(*CELLS)), 1, 1, 1)
    high, wide = whole.shape[1] // CELLS[0], whole.shape[2] // CELLS[1]
    for row, (top, left, height, width) in enumerate(patches(*CELLS)):
        hole = covered[row, top * high : (top + height) * high, left * wide : (left + width) * wide]
        hole[:] = whole.mean(dim=(0, 1, 2))
    heat = look.cam[at].reshape(CELLS[0], high, CELLS[1], wide).sum(axis=(1, 3))
    shares = decided(network, look.name, torch.cat([whole, whole.flip(2), covered]))
    return {
        "step": at + 1, "grey": look.frames[at].ravel().tolist(), "heat": percents(heat.ravel() / heat.sum()),
        "shares": percents(shares[0]), "mirrored": percents(shares[1]),
        "covered": shares[2:].argmax(axis=1).tolist(), "share": percents(shares[2:].max(axis=1)),
    }  # fmt: skip


def decided(network: Explainable, name: str, fed: torch.Tensor) -> Array:
    """Return the probability of each action (R, A)."""
    with torch.no_grad():
        return torch.softmax(network.scores({name: fed}).branches[0], dim=1).numpy()


def percents(shares: Any) -> list[float]:
    """Return shares in per cent, to a tenth."""
    return [round(100 * float(one), 1) for one in shares]


def basic(folder: Path) -> dict[str, Any]:
    """Return trainings in Unity's Basic, by evaluation, and the layers of the first small network."""
    runs = [
        (name, seed, train_basic(folder / f"basic-{name.replace(' ', '-')}-{seed}", seed, *words))
        for name, words in LEARNERS.items() for seed in SEEDS
    ]  # fmt: skip
    network = load_policy(next(run for name, _, run in runs if name == SMALL)).policy.network
    layers = [
        {
            "weights": layer.weight.detach().double().numpy().round(4).tolist(),
            "bias": layer.bias.detach().double().numpy().round(4).tolist(),
        }
        for layer in (network.policy_body.trunk[0], network.policy_head)
    ]
    return {"scene": "Basic", "network": layers, "runs": [
        {"learner": name, "seed": seed, **basic_moments(run)} for name, seed, run in runs
    ]}  # fmt: skip


def basic_moments(run: Path) -> dict[str, Any]:
    """Return of each evaluation the steps before it, its mean return, and the greedy act at each place."""
    judged = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    places = np.eye(basic_scene.PLACES, dtype=np.float32)[basic_scene.SMALL_GOAL + 1 : basic_scene.LARGE_GOAL]
    acts = [load_policy(f"{run}:{line['iteration']}").act({"Basic": places}) for line in judged]
    return {
        "steps": [line["steps"] for line in judged], "means": [round(line["evaluation_score"], 2) for line in judged],
        "acts": [one.ravel().tolist() for one in acts],
    }  # fmt: skip


def train_basic(run: Path, seed: int, *words: str) -> Path:
    """Train a run in Basic that is judged after each iteration, unless it is there; return it."""
    if not (run / "metrics.jsonl").is_file():
        racecraft_json(
            "unity", "train", "builtin:Basic", "--run", str(run), "--seed", str(seed), "--keep", "all", "--json",
            "--set", "evaluation.every=1", "--set", "evaluation.share=none", "--stop", "score=0.92",
            "--stop", "steps=60000", *words,
        )  # fmt: skip
    return run


def train(run: Path, iterations: int, seed: int, *words: str) -> Path:
    """Train a run unless it is there; return it."""
    car = run.parent / "car"
    car.mkdir(exist_ok=True)
    for name, text in CAR.items():
        (car / name).write_text(text, encoding="utf-8")
    if not (run / "metrics.jsonl").is_file():
        racecraft_json(
            "train", str(car), "--run", str(run), "--stop", f"iterations={iterations}", "--seed", str(seed),
            "--preset", "race", "--no-pictures", "--json", *words, *(word for one in PINNED for word in ("--set", one)),
        )  # fmt: skip
    return run


def racecraft_json(*words: str) -> Any:
    """Return what the last line of a command says."""
    done = subprocess.run([sys.executable, "-m", "racecraft", *words], capture_output=True, text=True, check=True)
    return json.loads(done.stdout.strip().splitlines()[-1])


def write(name: str, told: dict[str, Any], world: str = "deepracer") -> None:
    """Write a file with what it was made with."""
    target = (WORLDS / world if world else ROOT / "src/racecraft") / "lessons/material"
    made = {"racecraft": racecraft.__version__, "python": platform.python_version(), "machine": platform.machine()}
    text = json.dumps({"format": "racecraft lesson material", "version": 1, "made": made} | told, separators=(",", ":"))
    target.mkdir(parents=True, exist_ok=True)
    (target / name).write_text(text, encoding="utf-8")
    print(f"{name}: {len(text) / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
