"""The presets figure by figure, by hand: networks of facts 8.2, the learner of 8.3, a racer's file over both."""

import dataclasses

import numpy as np
import pytest
import torch

from racecraft.algorithms.networks import ActorCritic, architecture_of, encoder_for
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, DiscreteActions
from racecraft.worlds.deepracer.env.sensors import car_sensors
from racecraft.worlds.deepracer.files.hyperparameters import Hyperparameters
from racecraft.worlds.deepracer.files.model_metadata import NETWORKS, ActionRanges, default_model_metadata
from racecraft.worlds.deepracer.training.presets import settings_for, stops_given

SHALLOW, NORMAL, DEEP = NETWORKS
MAPS = {
    SHALLOW: [(29, 39, 32), (13, 18, 64), (11, 16, 64)],
    NORMAL: [(58, 78, 32), (56, 76, 32), (27, 37, 64), (25, 35, 64), (25, 35, 64)],
    DEEP: [(29, 39, 32), (13, 18, 32), (5, 8, 64), (3, 6, 64), (3, 6, 512), (3, 6, 512)],
}
"""Height, width and filters after each convolution of a 120 x 160 frame (facts 8.2); a dense layer behind them works on
each place by itself, for Coach's `embedder.py` flattens last."""
WEIGHTS = {
    SHALLOW: [2_080, 32_832, 36_928, 5_767_680, 2_565],
    NORMAL: [832, 9_248, 18_496, 36_928, 64 * 64 + 64, 56_000 * 512 + 512, 2_565],
    DEEP: [
        2_080, 16_416, 32_832, 36_928, 64 * 512 + 512, 512 * 512 + 512, 9_216 * 256 + 256, 256 * 128 + 128,
        128 * 5 + 5,
    ],
}  # fmt: skip
"""Weights and biases of each layer of the policy, for five actions."""
FRAME = {"FRONT_FACING_CAMERA": ArraySpec((120, 160), np.uint8, 0, 255)}


def car(network):
    return dataclasses.replace(default_model_metadata(), neural_network=network)


NOTHING_GIVEN = Hyperparameters()


def aws(network=SHALLOW, given=NOTHING_GIVEN, overrides=(), fidelity=None):
    return settings_for("aws", given, overrides, fidelity, car(network))


def build(network):
    settings, _ = aws(network)
    chance = torch.Generator().manual_seed(1)
    return ActorCritic(FRAME, DiscreteActions(5), architecture_of(settings.network), chance)


@pytest.mark.parametrize("network", NETWORKS)
def test_each_aws_network_has_the_layers_of_the_original(network):
    brain = build(network)
    shapes, sizes = [], []
    for module in brain.modules():
        if isinstance(module, torch.nn.Conv2d):
            module.register_forward_hook(lambda _, __, out: shapes.append(tuple(out.shape[i] for i in (2, 3, 1))))
    brain.policy({"FRONT_FACING_CAMERA": torch.zeros((1, 120, 160), dtype=torch.uint8)})
    assert shapes == MAPS[network]
    for part in (brain.policy_body, brain.policy_head):
        layers = [layer for layer in part.modules() if isinstance(layer, torch.nn.Conv2d | torch.nn.Linear)]
        sizes += [sum(numbers.numel() for numbers in layer.parameters()) for layer in layers]
    assert sizes == WEIGHTS[network]


STEREO_MAPS = {
    SHALLOW: MAPS[SHALLOW],
    NORMAL: [(118, 158, 32), (58, 78, 64), (56, 76, 64), (27, 37, 128), (25, 35, 128)],
}
STEREO_MAPS[DEEP] = STEREO_MAPS[NORMAL]


@pytest.mark.parametrize(
    ("network", "lidar"),
    [
        (SHALLOW, None), (SHALLOW, "SECTOR_LIDAR"), (SHALLOW, "DISCRETIZED_SECTOR_LIDAR"),
        (NORMAL, None), (DEEP, "LIDAR"),
    ],
)  # fmt: skip
def test_every_sensor_has_the_layers_of_the_original(network, lidar):
    """Two eyes have convolutions and no dense layers of their own, a LiDAR two of 256; the trunk reads both."""
    names = ("STEREO_CAMERAS",) if lidar is None else ("STEREO_CAMERAS", lidar)
    metadata = dataclasses.replace(car(network), sensors=names)
    settings, _ = settings_for("aws", NOTHING_GIVEN, (), None, metadata)
    specs, architecture = car_sensors(names).specs(160, 120), architecture_of(settings.network)
    shapes, dense = [], []
    body = encoder_for(specs, architecture, torch.Generator().manual_seed(1))
    for module in body.modules():
        if isinstance(module, torch.nn.Conv2d):
            module.register_forward_hook(lambda _, __, out: shapes.append(tuple(out.shape[i] for i in (2, 3, 1))))
        if isinstance(module, torch.nn.Linear):
            dense.append((module.in_features, module.out_features))
    assert body.names == tuple(sorted(names)), "inputs are laid end to end in the order of their sorted names"
    body({name: torch.from_numpy(np.zeros((1, *part.shape), part.dtype)) for name, part in specs.items()})
    assert shapes == STEREO_MAPS[network]
    height, width, filters = shapes[-1]
    of_lidar = [] if lidar is None else [(specs[lidar].shape[0], 256), (256, 256)]
    trunk = [(height * width * filters + (256 if lidar else 0), 512)]
    if network == DEEP:
        trunk = [(trunk[0][0], 256), (256, 128)]
    assert dense == of_lidar + trunk


@pytest.mark.parametrize(
    ("sensors", "order"),
    [
        (("FRONT_FACING_CAMERA", "DISCRETIZED_SECTOR_LIDAR"), ("DISCRETIZED_SECTOR_LIDAR", "FRONT_FACING_CAMERA")),
        (("observation", "LIDAR"), ("LIDAR", "observation")),
    ],
)
def test_inputs_are_joined_in_the_order_of_aws(sensors, order):
    settings, _ = settings_for("fast", NOTHING_GIVEN, (), None, default_model_metadata())
    specs = car_sensors(sensors).specs(40, 30)
    body = encoder_for(specs, architecture_of(settings.network), torch.Generator().manual_seed(1))
    assert body.names == order


@pytest.mark.parametrize("network", NETWORKS)
def test_policy_and_critic_share_no_weight(network):
    brain = build(network)
    width = brain.policy_head.in_features
    policy = sum(WEIGHTS[network])
    assert sum(numbers.numel() for numbers in brain.parameters()) == 2 * policy - (5 * width + 5) + (width + 1)
    mine = {id(numbers) for numbers in brain.policy_body.parameters()}
    assert brain.critic_body is not None
    assert not mine & {id(numbers) for numbers in brain.critic_body.parameters()}


def test_the_first_weights_are_glorots_and_the_critics_columns_are_normalised():
    brain = build(SHALLOW)
    dense = brain.policy_body.trunk[0].weight.detach()
    limit = (6 / (11_264 + 512)) ** 0.5
    assert 0.999 * limit < dense.abs().max() <= limit
    assert dense.std().item() == pytest.approx(limit / 3**0.5, rel=0.01)
    assert brain.policy_head.weight.detach().abs().max() <= (6 / 517) ** 0.5
    assert brain.value_head.weight.detach().norm().item() == pytest.approx(1.0, abs=1e-6)
    biases = [numbers for name, numbers in brain.named_parameters() if name.endswith("bias")]
    assert all((numbers == 0).all() for numbers in biases)


def test_the_aws_learner_is_that_of_the_facts():
    settings, _ = aws()
    ppo, rollout = settings.ppo, settings.rollout
    assert (settings.camera.width, settings.camera.height) == (160, 120)
    assert (ppo.gae_lambda, ppo.clip, ppo.value_weight, ppo.max_grad_norm) == (0.95, 0.2, 1.0, None)
    assert (ppo.adam_epsilon, ppo.adam_form) == (1e-5, "tensorflow")
    assert (ppo.standardise, ppo.drop_remainder) == ("rollout", True)
    assert (ppo.probability_floor, ppo.exploration) == (1e-8, "categorical")
    assert not settings.network.privileged_critic
    assert rollout.episodes_per_iteration % rollout.num_worlds == 0
    # the template of DeepRacer for Cloud
    assert (ppo.learning_rate, ppo.discount, ppo.epochs, ppo.batch_size) == (3e-4, 0.99, 5, 64)
    assert (ppo.entropy_weight, ppo.value_loss, rollout.episodes_per_iteration) == (0.01, "huber", 20)


def test_a_racers_file_wins_over_the_preset_and_set_over_both():
    given = Hyperparameters(
        lr=1e-4, discount_factor=0.5, num_epochs=7, batch_size=32, beta_entropy=0.02, loss_type="mean squared error",
        num_episodes_between_training=18, exploration_type="e-greedy", e_greedy_value=0.1, epsilon_steps=500,
        stack_size=4,
    )  # fmt: skip
    settings, notes = aws(given=given, overrides=["ppo.epochs=3"])
    ppo = settings.ppo
    assert (ppo.learning_rate, ppo.discount, ppo.epochs, ppo.batch_size) == (1e-4, 0.5, 3, 32)
    assert (ppo.entropy_weight, ppo.value_loss) == (0.02, "mse")
    assert (ppo.exploration, ppo.epsilon_last, ppo.epsilon_steps) == ("e-greedy", 0.1, 500)
    assert (settings.rollout.episodes_per_iteration, settings.rollout.num_worlds) == (18, 18)
    assert settings.network.stack_size == 4
    assert any("4 frames are seen at once; AWS" in note for note in notes)
    assert not [note for note in notes if "changes nothing" in note]


def test_what_does_nothing_is_said_by_name():
    given = Hyperparameters(e_greedy_value=0.1, epsilon_steps=9, sac_alpha=0.2, term_cond_avg_score=5.0)
    _, notes = aws(given=given)
    said = [note.split()[0] for note in notes if "changes nothing" in note]
    assert said == ["e_greedy_value", "epsilon_steps", "sac_alpha", "term_cond_avg_score"]
    _, notes = aws(given=Hyperparameters(exploration_type="additive_noise"))
    assert any("additive_noise" in note for note in notes)


def test_a_continuous_car_explores_by_its_own_distribution():
    car = dataclasses.replace(default_model_metadata(), action_space=ActionRanges(-0.5, 0.5, 1.0, 2.0))
    given = Hyperparameters(exploration_type="e-greedy", e_greedy_value=0.1)
    settings, notes = settings_for("aws", given, (), metadata=car)
    assert settings.ppo.exploration == "categorical"
    assert any("e-greedy chooses from a list of actions" in note for note in notes)
    settings, notes = settings_for("aws", Hyperparameters(), (), metadata=car)
    assert not any("exploration" in note for note in notes)


def test_the_files_conditions_end_a_training_and_with_the_preset_aws_as_aws_did():
    given = Hyperparameters(term_cond_max_episodes=12, term_cond_avg_score=60.0)
    assert stops_given(given) == ("reward=60.0", "episodes=12")
    assert stops_given(given, "aws") == ("iterations=12",)
    assert stops_given(Hyperparameters()) == ()
    said = {preset: " ".join(settings_for(preset, given, ())[1]) for preset in ("fast", "aws")}
    assert ("never looked at" in said["aws"], "counts iterations" in said["aws"]) == (True, True)
    assert "term_cond" not in said["fast"]


@pytest.mark.parametrize("network", NETWORKS)
def test_memory_is_capped_only_where_the_world_has_the_originals_habits(network):
    assert aws(network)[0].rollout.memory_steps == (10_000 if network == SHALLOW else 3_000)
    assert aws(network, fidelity="sane")[0].rollout.memory_steps is None
    assert aws(network, overrides=["rollout.memory_steps=77"])[0].rollout.memory_steps == 77


def test_fidelity_follows_the_preset_unless_given():
    def fidelity(preset, asked=None):
        return settings_for(preset, Hyperparameters(), (), asked)[0].race.fidelity

    assert (fidelity("fast"), fidelity("aws")) == ("sane", "aws")
    assert (fidelity("fast", "aws"), fidelity("aws", "sane")) == ("aws", "sane")
    with pytest.raises(SettingError, match="'sane'"):
        fidelity("aws", "sain")
    with pytest.raises(SettingError, match="'aws'"):
        fidelity("awss")


def test_the_old_observation_is_always_seen_by_the_shallow_network():
    old = dataclasses.replace(car(DEEP), sensors=("observation",))
    settings, notes = settings_for("aws", Hyperparameters(), (), None, old)
    assert settings == aws(SHALLOW)[0]
    assert any(DEEP in note for note in notes)
