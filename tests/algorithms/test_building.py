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
from racecraft.algorithms.registry import ALGORITHMS, Algorithm, algorithm_of, find_algorithm
from racecraft.algorithms.stacking import StackedLearner
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


def built(network=None, **groups):
    """Return what ppo's settings describe, of a small network."""
    network = network or NetworkConfig(hidden_units=(4,))
    settings = Settings(network=network, ppo=PpoConfig(), runtime=RuntimeConfig(), **groups)
    return build_learner(find_algorithm("ppo"), SPEC, settings, 1)


OWN = "torch.nn:Identity"
TWO_FOR_ONE_PLACE = {
    ("encoder", "policy"): NetworkConfig(encoder=OWN, policy=OWN),
    ("encoder", "normalise"): NetworkConfig(encoder=OWN, normalise=True),
    ("encoder", "memory"): NetworkConfig(encoder=OWN, memory="lstm"),
    ("policy", "normalise"): NetworkConfig(policy=OWN, normalise=True),
    ("policy", "memory"): NetworkConfig(policy=OWN, memory="gru"),
    ("policy", "separate_networks"): NetworkConfig(policy=OWN, separate_networks=True),
}


@pytest.mark.parametrize(("first", "second"), TWO_FOR_ONE_PLACE)
def test_two_networks_for_one_place_are_refused_by_both_names(first, second):
    with pytest.raises(SettingError, match=rf"network\.{first} and network\.{second} are both given"):
        built(TWO_FOR_ONE_PLACE[first, second])


@pytest.mark.parametrize(
    "network",
    [
        NetworkConfig(hidden_units=(4,), normalise=True, memory="gru", memory_units=3),
        NetworkConfig(hidden_units=(4,), separate_networks=True, normalise=True),
        NetworkConfig(hidden_units=(4,)),
    ],
)
def test_what_goes_together_is_built_and_nothing_is_laid_round_it(network):
    assert isinstance(built(network, **signal_groups()), PpoLearner)
    assert isinstance(built(network), PpoLearner), "settings may lack the groups of rewards"


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


def test_a_network_of_ones_own_is_asked_for_by_itself():
    """It is refused for what it is, no encoder, and not for what stands beside it."""
    for name in ("encoder", "policy"):
        with pytest.raises(SettingError, match=f"network.{name} {OWN} failed"):
            built(NetworkConfig(**{name: OWN}))


def test_several_sights_at_once_are_stacked_and_one_is_not():
    assert isinstance(built(NetworkConfig(hidden_units=(4,), stack_size=2)), StackedLearner)
    assert not isinstance(built(NetworkConfig(hidden_units=(4,), stack_size=1)), StackedLearner)


def test_what_shall_be_imitated_must_be_named():
    for name, config in (("imitation", ImitationConfig(strength=0.5)), ("gail", GailConfig(strength=0.5))):
        with pytest.raises(SettingError, match=rf"{name}.strength is 0.5 and .* --set {name}\.demonstrations=FILE"):
            built(**{**signal_groups(), name: config})


def test_rewards_and_imitation_have_their_settings_and_begin_without_strength():
    groups = signal_groups()
    assert list(groups) == ["curiosity", "rnd", "gail", "imitation"]
    assert [type(one).__name__ for one in groups.values()] == [
        "CuriosityConfig", "RndConfig", "GailConfig", "ImitationConfig",
    ]  # fmt: skip
    assert [one.strength for one in groups.values()] == [0.0] * 4


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
