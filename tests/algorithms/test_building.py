"""What a learner cannot follow is refused by name, not left aside in silence."""

import numpy as np
import pytest

from racecraft.algorithms.asynchronous_ppo import AsynchronousPpo
from racecraft.algorithms.building import build_learner, signal_groups
from racecraft.algorithms.gail import GailConfig
from racecraft.algorithms.imitation import ImitationConfig
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.algorithms.recurrent_ppo import RecurrentPpoLearner
from racecraft.algorithms.registry import Algorithm, algorithm_of, find_algorithm
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.settings.composition import Settings
from racecraft.training.settings import RuntimeConfig
from racecraft.worlds.deepracer.files.hyperparameters import Hyperparameters
from racecraft.worlds.deepracer.training.presets import default_settings, settings_for

SPEC = WorldSpec("toy", 4, 1, {"position": ArraySpec((2,), np.float32)}, DiscreteActions(3))
ASKED = {
    "normalise": NetworkConfig(normalise=True),
    "memory": NetworkConfig(memory="gru"),
    "separate_networks": NetworkConfig(separate_networks=True),
}


@pytest.mark.parametrize("asked", ASKED)
def test_a_learner_without_a_critic_or_a_memory_says_so(asked):
    algorithm = find_algorithm("dqn")
    settings = default_settings(algorithm).with_group("network", ASKED[asked])
    with pytest.raises(SettingError, match=f"network.{asked} is .* dqn"):
        build_learner(algorithm, SPEC, settings, 1)


def test_the_preset_of_aws_asks_no_critic_of_whoever_has_none():
    for name, separate in (("ppo", True), ("dqn", False)):
        settings, _ = settings_for("aws", Hyperparameters(), (), algorithm=find_algorithm(name))
        assert settings.network.separate_networks is separate


def built(network=None, **groups):
    """Return what ppo's settings describe, of a small network."""
    network = network or NetworkConfig(hidden_units=(4,))
    settings = Settings(network=network, ppo=PpoConfig(), runtime=RuntimeConfig(), **groups)
    return build_learner(find_algorithm("ppo"), SPEC, settings, 1)


OWN = "torch.nn:Identity"
TWO_FOR_ONE_PLACE = {
    ("encoder", "policy"): NetworkConfig(encoder=OWN, policy=OWN),
    ("encoder", "memory"): NetworkConfig(encoder=OWN, memory="lstm"),
    ("policy", "separate_networks"): NetworkConfig(policy=OWN, separate_networks=True),
}


@pytest.mark.parametrize(("first", "second"), TWO_FOR_ONE_PLACE)
def test_two_networks_for_one_place_are_refused_by_both_names(first, second):
    with pytest.raises(SettingError, match=rf"network\.{first} and network\.{second} are both given"):
        built(TWO_FOR_ONE_PLACE[first, second])


@pytest.mark.parametrize(
    ("network", "ppo", "learner"),
    [
        (NetworkConfig(hidden_units=(4,)), PpoConfig(), PpoLearner),
        (NetworkConfig(hidden_units=(4,), memory="gru"), PpoConfig(), RecurrentPpoLearner),
        (NetworkConfig(hidden_units=(4,)), PpoConfig(asynchronous=True), AsynchronousPpo),
    ],
)
def test_the_settings_choose_among_the_variants_of_ppo(network, ppo, learner):
    settings = Settings(network=network, ppo=ppo, runtime=RuntimeConfig())
    assert type(build_learner(find_algorithm("ppo"), SPEC, settings, 1)) is learner


def test_a_memory_beside_an_asynchronous_learner_is_refused():
    settings = Settings(network=NetworkConfig(memory="gru"), ppo=PpoConfig(asynchronous=True), runtime=RuntimeConfig())
    with pytest.raises(SettingError, match="ppo.asynchronous is True, and a memory"):
        build_learner(find_algorithm("ppo"), SPEC, settings, 1)


def test_a_learner_derived_from_ppo_has_no_memory_unless_it_says_so():
    class Mine(PpoLearner):
        Config = PpoConfig

    settings = Settings(network=NetworkConfig(memory="gru"), ppo=PpoConfig(), runtime=RuntimeConfig())
    with pytest.raises(SettingError, match="network.memory is gru, which mine does not follow"):
        build_learner(algorithm_of(Mine, "mine"), SPEC, settings, 1)


def test_what_shall_be_imitated_must_be_named():
    for name, config in (("imitation", ImitationConfig(strength=0.5)), ("gail", GailConfig(strength=0.5))):
        with pytest.raises(SettingError, match=rf"{name}.strength is 0.5 and .* --set {name}\.demonstrations=FILE"):
            built(**{**signal_groups(), name: config})


class Own:
    """A user's own learner, which says nothing of what it follows."""

    def __init__(self, spec, seed):
        self.spec, self.seed = spec, seed

    @classmethod
    def build(cls, spec, settings, seed):
        return cls(spec, seed)


def test_a_users_own_learner_may_have_no_network_and_follows_nothing_that_it_does_not_name():
    mine = Algorithm("mine", "", "Own", "", "Mine.", own=Own)
    learner = build_learner(mine, SPEC, Settings(runtime=RuntimeConfig()), 5)
    assert (type(learner), learner.spec, learner.seed) == (Own, SPEC, 5)
    assert type(build_learner(mine, SPEC, Settings(network=NetworkConfig()), 5)) is Own
    for name, asked in {**ASKED, "encoder": NetworkConfig(encoder=OWN), "policy": NetworkConfig(policy=OWN)}.items():
        if name != "separate_networks":
            with pytest.raises(SettingError, match=f"network.{name} is .*, which mine does not follow"):
                build_learner(mine, SPEC, Settings(network=asked), 5)
