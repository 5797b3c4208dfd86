"""How fast a Unity player is driven, with the stand-in at the other end: `python benchmarks/unity.py`.

With `RACECRAFT_OFFICIAL_MLAGENTS_PYTHON` naming an interpreter that has `mlagents-envs` (0.28.0 with protobuf 3.20.3),
the unmodified official client drives the same stand-in in the same run. Best of a few rounds each.
"""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import racecraft
from racecraft.contract.world import allocate
from racecraft.worlds.unity.env.session import Choice, Session
from racecraft.worlds.unity.env.world import UnityWorld

NAME, STAY = "Basic?team=0", 0
ROUNDS = 3
SECONDS = 1.0

OFFICIAL = """
import json, sys, time
import numpy as np
from mlagents_envs.base_env import ActionTuple
from mlagents_envs.environment import UnityEnvironment
program, agents, rounds, seconds = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])
env = UnityEnvironment(program, worker_id=agents, no_graphics=True, additional_args=["--agents", str(agents)])
env.reset()
(name,) = env.behavior_specs
actions, best = ActionTuple(discrete=np.zeros((agents, 1), np.int32)), 0.0
for _ in range(rounds):
    begun = time.perf_counter()
    count = 0
    while time.perf_counter() - begun < seconds:
        env.set_actions(name, actions)
        env.step()
        env.get_steps(name)
        count += 1
    best = max(best, count / (time.perf_counter() - begun))
env.close()
print(json.dumps(best))
"""


def exchanges_per_second(agents: int) -> float:
    """Return exchanges a second of a session whose scene has so many agents."""
    choices = {NAME: Choice(discrete=np.zeros((agents, 1), np.int32))}
    with Session("builtin:Basic", args=["--agents", str(agents)]) as session:
        session.reset()
        return best(lambda: session.step(choices))


def world_steps_per_second(agents: int) -> float:
    """Return steps a second of a World over that scene."""
    world = UnityWorld("builtin:Basic", args=["--agents", str(agents)])
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    actions = np.full((agents, 1), STAY)
    rate = best(lambda: world.step(actions, buffers))
    world.close()
    return rate


def official_exchanges_per_second(python: str, agents: int) -> float:
    """Return what the official client comes to, in its own interpreter."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "Basic.x86_64"
        home = Path(racecraft.__file__).parent.parent
        program.write_text(
            f"#!{sys.executable}\nimport sys\nsys.path.insert(0, {str(home)!r})\n"
            "from racecraft.worlds.unity.env.basic_scene import main\nsys.exit(main())\n"
        )
        program.chmod(program.stat().st_mode | stat.S_IXUSR)
        command = [python, "-c", OFFICIAL, str(program), str(agents), str(ROUNDS), str(SECONDS)]
        told = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    rate: float = json.loads(told.stdout.splitlines()[-1])
    return rate


def open_and_close(times: int = 20) -> tuple[float, float]:
    """Return the median seconds to open a session (first moment included) and to close it."""
    opening, closing = [], []
    for _ in range(times):
        begun = time.perf_counter()
        session = Session("builtin:Basic")
        session.reset()
        opened = time.perf_counter()
        session.close()
        closing.append(time.perf_counter() - opened)
        opening.append(opened - begun)
    return float(np.median(opening)), float(np.median(closing))


def best(act) -> float:
    rates = []
    for _ in range(ROUNDS):
        begun, count = time.perf_counter(), 0
        while time.perf_counter() - begun < SECONDS:
            act()
            count += 1
        rates.append(count / (time.perf_counter() - begun))
    return max(rates)


def basic_seconds(seeds: range = range(1, 4)) -> list[float]:
    """Return how long `racecraft unity train builtin:Basic` takes to 0.92 over 20 greedy episodes, process start in."""
    spent = []
    for seed in seeds:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "racecraft", "unity", "train", "builtin:Basic", "--stop", "score=0.92"]
            begun = time.perf_counter()
            done = subprocess.run(
                [*command, "--seed", str(seed), "--run", f"{folder}/run", "--json"],
                capture_output=True, text=True, check=True, timeout=300,
            )  # fmt: skip
            spent.append(round(time.perf_counter() - begun, 1))
            told = json.loads(done.stdout)
            assert told["solved"], f"seed {seed} stopped by {told['stopped_by']}"
    return spent


def main() -> None:
    """Measure, print, and give the figures as JSON on the last line."""
    official = os.environ.get("RACECRAFT_OFFICIAL_MLAGENTS_PYTHON")
    figures: dict[str, Any] = {}
    for agents in (1, 64):
        session, world = exchanges_per_second(agents), world_steps_per_second(agents)
        print(f"{agents:3d} agents  session {session:6.0f} exchanges/s = {session * agents:7.0f} agent-steps/s")
        print(f"{agents:3d} agents  World   {world:6.0f} steps/s     = {world * agents:7.0f} agent-steps/s")
        figures |= {f"exchanges_{agents}": round(session), f"world_agent_steps_{agents}": round(world * agents)}
        if official:
            rate = official_exchanges_per_second(official, agents)
            print(f"{agents:3d} agents  official client {rate:6.0f} exchanges/s = {rate * agents:7.0f} agent-steps/s")
            figures[f"official_exchanges_{agents}"] = round(rate)
    if not official:
        print("official client: RACECRAFT_OFFICIAL_MLAGENTS_PYTHON names no interpreter with mlagents-envs")
    opening, closing = open_and_close()
    print(f"open {opening:.2f} s, close {closing:.2f} s (median of 20)")
    figures |= {"open_seconds": round(opening, 2), "close_seconds": round(closing, 2), "basic_seconds": basic_seconds()}
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
