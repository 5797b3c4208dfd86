"""Your own algorithm, hill climbing: on the command line --algorithm your_own_algorithm:HillClimbing."""

import sys
import tempfile
from pathlib import Path

import torch

from racecraft.algorithms.registry import register_algorithm
from racecraft.algorithms.reinforce import ReinforceConfig, ReinforceLearner
from racecraft.training.progress import LineWatcher
from racecraft.training.worlds import train
from racecraft.worlds.gymnasium.training.trainer import GymRequest


class HillClimbing(ReinforceLearner):
    """Acts as REINFORCE does, and learns by trying."""

    experience, figures = "rollout", {"best": "The least share of ticks that ended an episode, negated."}
    best, kept = float("-inf"), []

    @classmethod
    def build(cls, spec, settings, seed):  # noqa: D102
        return cls(spec, settings.network, ReinforceConfig(), seed)

    def update(self, experience):  # noqa: D102
        if (earned := -float(experience.terminated.mean())) >= self.best:
            self.best, self.kept = earned, [part.detach().clone() for part in self.network.parameters()]
        for part, kept in zip(self.network.parameters(), self.kept, strict=True):
            part.data = kept + 0.1 * torch.randn(kept.shape, generator=self.generator)
        return {"best": self.best}


if __name__ == "__main__":
    register_algorithm("climbing", HillClimbing)
    with tempfile.TemporaryDirectory() as folder:
        request = GymRequest("CartPole-v1", algorithm="climbing", stops=("iterations=8",), run=Path(folder) / "run")
        train(request, LineWatcher(sys.stdout))
