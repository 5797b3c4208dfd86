"""Train on a Gymnasium environment with the same loop that trains the cars: a short taste of CartPole."""

import sys
import tempfile
from pathlib import Path

from racecraft.training.gymnasium.trainer import GymRequest
from racecraft.training.progress import LineWatcher
from racecraft.training.worlds import train

with tempfile.TemporaryDirectory() as folder:
    request = GymRequest(
        "CartPole-v1",
        stops=("steps=6000",),  # leave `stops` out to train until it is solved
        run=Path(folder) / "cartpole",
    )
    summary = train(request, LineWatcher(sys.stdout)).summary()

score = summary["evaluation"]["mean_return"]
print(f"mean return {score:.0f} after {summary['env_steps']} steps; a pole left to chance falls after about 22")
