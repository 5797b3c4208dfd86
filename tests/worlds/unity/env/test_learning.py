"""By learning: numbers and choices together, in a scene without ends, over the real wire."""

import sys
from pathlib import Path

import numpy as np
import pytest

import racecraft
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.contract.world import allocate
from racecraft.rollout.collector import Collector
from racecraft.worlds.unity.env.builds import Build
from racecraft.worlds.unity.env.world import UnityWorld

pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")

NETWORK = NetworkConfig(hidden_units=(32, 32), activation="tanh")
SCENES = Path(__file__).parent / "scenes.py"


def learn(world, config, horizon, iterations, seed=1):
    learner = PpoLearner(world.spec, NETWORK, config, seed)
    collector = Collector(world, learner, horizon, seed)
    for _ in range(iterations):
        learner.update(collector.collect())
    return learner


@pytest.mark.long
def test_numbers_and_choices_are_learnt_together():
    """Each agent tells a number and a bit that it sees: hybrid actions."""
    home = str(Path(racecraft.__file__).parent.parent)
    build = Build("copy", (sys.executable, "-P", str(SCENES), "--scene", "copy"), False, {"PYTHONPATH": home})
    world = UnityWorld(build, seed=1)
    config = PpoConfig(learning_rate=3e-3, discount=0.0, epochs=6, batch_size=256, entropy_weight=0.0)
    learner = learn(world, config, horizon=256, iterations=40)
    buffers = allocate(world.spec)
    world.reset(buffers, 2)
    earned = []
    for _ in range(50):
        world.step(learner.choose({"sight": buffers.observations["sight"][:, 0]})[:, None], buffers)
        earned.append(buffers.reward.mean())
    assert np.mean(earned) > 0.97
    world.close()
