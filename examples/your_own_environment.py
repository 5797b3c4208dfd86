"""Your own environment in thirty lines: a thermostat that shall keep a room at 20 degrees.

On the command line: racecraft gym train your_own_environment:Room
"""

import sys
import tempfile
from pathlib import Path

import gymnasium
import numpy as np

from racecraft.training.progress import LineWatcher
from racecraft.training.worlds import train
from racecraft.worlds.gymnasium.training.trainer import GymRequest


class Room(gymnasium.Env):
    """Sees how far the room is from 20 degrees; heats (1) or does not (0); earns 1 for each minute within 1 degree."""

    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (1,))
    action_space = gymnasium.spaces.Discrete(2)
    reward_threshold = 27.0

    def reset(self, *, seed=None, options=None):  # noqa: D102
        super().reset(seed=seed)
        self.away, self.minute = self.np_random.uniform(-3.0, 3.0), 0
        return np.array([self.away], np.float32), {}

    def step(self, action):  # noqa: D102
        self.away, self.minute = self.away + (1.0 if action else -1.0), self.minute + 1
        return np.array([self.away], np.float32), float(abs(self.away) <= 1.0), False, self.minute == 30, {}


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        request = GymRequest("__main__:Room", stops=("score=27", "steps=20000"), run=Path(folder) / "run")
        print(train(request, LineWatcher(sys.stdout)).summary()["evaluation"])
