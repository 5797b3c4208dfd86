"""What a learner cannot follow is refused by name, not left aside in silence."""

import numpy as np
import pytest

from racecraft.algorithms.building import build_learner
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.registry import ALGORITHMS, find_algorithm
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.formats.aws.hyperparameters import Hyperparameters
from racecraft.training.deepracer.presets import default_settings, settings_for

SPEC = WorldSpec("toy", 4, 1, {"position": ArraySpec((2,), np.float32)}, DiscreteActions(3))
ASKED = {
    "normalise": NetworkConfig(normalise=True),
    "memory": NetworkConfig(memory="gru"),
    "separate_networks": NetworkConfig(separate_networks=True),
}


@pytest.mark.parametrize("asked", ASKED)
@pytest.mark.parametrize("name", ["dqn", "apex"])
def test_a_learner_without_a_critic_or_a_memory_says_so(name, asked):
    algorithm = find_algorithm(name)
    settings = default_settings(algorithm).with_group("network", ASKED[asked])
    with pytest.raises(SettingError, match=f"network.{asked} is .* {name}"):
        build_learner(algorithm, SPEC, settings, 1)


def test_only_learners_of_worth_have_no_critic():
    assert [one.name for one in ALGORITHMS.values() if not one.critic] == ["dqn", "apex"]


def test_the_preset_of_aws_asks_no_critic_of_whoever_has_none():
    for name, separate in (("ppo", True), ("dqn", False)):
        settings, _ = settings_for("aws", Hyperparameters(), (), algorithm=find_algorithm(name))
        assert settings.network.separate_networks is separate
