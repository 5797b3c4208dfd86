"""Your own network in thirty lines: an encoder that sees angles as waves.

On the command line: racecraft gym train CartPole-v1 --set network.encoder=your_own_network:Waves
"""

import sys
import tempfile
from pathlib import Path

import torch
from torch import nn

from racecraft.players.trained import load_policy
from racecraft.training.progress import LineWatcher
from racecraft.training.worlds import train
from racecraft.worlds.gymnasium.training.trainer import GymRequest


class Waves(nn.Module):
    """Made from the observations' specs by name; gives `width` features for each row."""

    def __init__(self, observations):
        super().__init__()
        numbers = sum(spec.shape[0] for spec in observations.values())
        self.mix, self.width = nn.Linear(numbers, 32), 64

    def forward(self, observations):  # noqa: D102
        mixed = self.mix(torch.cat([observations[name] for name in sorted(observations)], dim=1))
        return torch.cat([torch.sin(mixed), torch.cos(mixed)], dim=1)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        settings = ("network.encoder=__main__:Waves",)
        request = GymRequest("CartPole-v1", stops=("steps=6000",), run=Path(folder) / "run", overrides=settings)
        trained = train(request, LineWatcher(sys.stdout))
        print(load_policy(trained.run).spec.network["encoder"], "is remembered by the checkpoint")
