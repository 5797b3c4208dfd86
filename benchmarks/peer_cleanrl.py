"""CleanRL's files on one world until it is solved: `peer_cleanrl.py WORLD SEED --folder CLEANRL`; for `peers.py`.

CLEANRL is a folder with CleanRL's repository, whose `ppo.py` and `sac_continuous_action.py` run as they are, with the
settings that they begin with. They want an environment of its own (`pip install torch gymnasium==0.29.1 "numpy<2" tyro
tensorboard`): with later Gymnasium they hear of no episode's end. They know of no goal. So this listens to what they
write for TensorBoard, and judges the network that they hold then as all others are judged.
"""

from __future__ import annotations

import argparse
import json
import os
import runpy
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import torch
from torch.utils import tensorboard

from greedy_returns import CONFIRMED, JUDGED, mean_return


def argmax_action(script: dict[str, Any], seen: torch.Tensor) -> torch.Tensor:
    """Return the likeliest actions of `ppo.py`."""
    return script["agent"].actor(seen).argmax(dim=1)


def middle(script: dict[str, Any], seen: torch.Tensor) -> torch.Tensor:
    """Return the mean actions of `sac_continuous_action.py`."""
    return script["actor"].get_action(seen)[2]


PPO, SAC = ("ppo.py", argmax_action, 2048), ("sac_continuous_action.py", middle, 1024)
FILES: dict[str, tuple[str, Callable[[dict[str, Any], torch.Tensor], torch.Tensor], int]] = {
    "CartPole-v1": PPO,
    "Acrobot-v1": PPO,
    "Pendulum-v1": SAC,
}
"""By world: the file, how its network acts greedily, and after how many steps it is judged."""


class Judge:
    """Stands where a single file expects its writer, and ends the process once the goal is met."""

    def __init__(self, world: str, seed: int, goal: float, until: float) -> None:
        _, self.act, self.every = FILES[world]
        self.worlds: Any = gymnasium.make_vec(world, JUDGED, vectorization_mode="sync")
        self.seed, self.goal, self.until, self.judged_at = seed, goal, until, 0
        self.confirms = gymnasium.spec(world).reward_threshold is not None

    def __call__(self, *_: Any, **__: Any) -> Judge:
        """Be the writer that is asked for."""
        return self

    def add_text(self, *_: Any) -> None:
        """Do nothing with what is told once."""

    def close(self) -> None:
        """Say that the file came to its end unsolved."""
        self.end(False)

    def add_scalar(self, _: str, __: float, step: int) -> None:
        """Judge, where it is time to."""
        if step - self.judged_at < self.every:
            return
        self.judged_at = step
        script = sys._getframe(1).f_globals
        if self.mean(script, JUDGED) >= self.goal and (not self.confirms or self.mean(script, CONFIRMED) >= self.goal):
            self.end(True)
        if time.perf_counter() > self.until:
            self.end(False)

    def mean(self, script: dict[str, Any], episodes: int) -> float:
        """Return the mean return of that many episodes."""

        def act(seen: Any) -> Any:
            with torch.no_grad():
                return self.act(script, torch.from_numpy(seen)).numpy()

        return mean_return(self.worlds, act, episodes, self.seed)

    def end(self, solved: bool) -> None:
        """Print what came of it as one JSON object, and end."""
        print(json.dumps({"solved": solved, "steps": self.judged_at}), flush=True)
        os._exit(0)  # nothing of a single file is to be kept


def main() -> None:
    """Train once and print what came of it as one JSON object."""
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    options.add_argument("world", choices=FILES)
    options.add_argument("seed", type=int)
    options.add_argument("--goal", type=float, required=True)
    options.add_argument("--minutes", type=float, default=10.0)
    options.add_argument("--folder", type=Path, required=True, help="CleanRL's repository")
    asked = options.parse_args()
    torch.set_num_threads(1)
    until = time.perf_counter() + 60.0 * asked.minutes
    tensorboard.SummaryWriter = Judge(asked.world, asked.seed + 10_000, asked.goal, until)  # type: ignore[misc,assignment]
    sys.path.insert(0, str(asked.folder))
    file = asked.folder / "cleanrl" / FILES[asked.world][0]
    sys.argv = [str(file), "--env-id", asked.world, "--seed", str(asked.seed)]
    runpy.run_path(str(file), run_name="__main__")


if __name__ == "__main__":
    main()
