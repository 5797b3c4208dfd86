"""Imitation by reward: by hand, by law, and by what is learned where the world itself pays nothing."""

import copy
import math

import numpy as np
import pytest
import torch
from toy_world import CopyTheNumber, Expert, Unpaid, Walk

from racecraft.algorithms.building import build_learner, signal_groups
from racecraft.algorithms.gail import GailConfig, GailModel
from racecraft.algorithms.networks import Architecture, NetworkConfig
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.ppo import PpoConfig
from racecraft.algorithms.registry import find_algorithm
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.formats.demonstrations import Demonstrations, write_demonstrations
from racecraft.formats.tensor_file import CheckpointError
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.demonstrate import demonstrate
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise
from racecraft.settings.composition import Settings
from racecraft.training.settings import RuntimeConfig

SMALL = Architecture(trunk_units=(8,))


def model(config=None, shown=None, world=None):
    world = world or CopyTheNumber(4)
    config = config or GailConfig(strength=1.0, use_actions=True)
    return GailModel(world.spec, world.spec.actions, SMALL, config, shown or demonstrate(Expert(), world, 4), 1, "cpu")


def learner(path, world, **values):
    groups = signal_groups() | {"gail": GailConfig(demonstrations=path and str(path), **values)}
    ppo = PpoConfig(learning_rate=3e-3, batch_size=64, entropy_weight=0.01)
    network = NetworkConfig(hidden_units=(32,), activation="tanh")
    return build_learner(
        find_algorithm("ppo"), world.spec, Settings(network=network, ppo=ppo, runtime=RuntimeConfig(), **groups), 1
    )


def test_the_reward_is_minus_the_log_of_being_found_out():
    judge = model()
    with torch.no_grad():
        for part in judge.networks["judge"].parameters():
            part.zero_()
        for bias, expected in (
            (0.0, math.log(2.0)),
            (3.0, math.log(1.0 + math.exp(3.0))),
            (100.0, -math.log(1.192093e-07)),
        ):
            judge.networks["judge"][-1].bias.fill_(bias)
            rows = judge.bonus({"number": np.eye(4, dtype=np.float32)}, np.arange(4), {})
            assert rows == pytest.approx([expected] * 4, rel=1e-5)


def test_it_learns_to_tell_and_says_what_it_knows():
    judge = model(GailConfig(strength=1.0, use_actions=True, learning_rate=1e-2, gradient_penalty=0.1))
    seen, wrong = {"number": np.tile(np.eye(4, dtype=np.float32), (32, 1))}, np.tile([1, 2, 3, 0], 32)
    first = judge.learn(seen, wrong, {})
    for _ in range(150):
        last = judge.learn(seen, wrong, {})
    assert last["gail_loss"] < 0.5 < first["gail_loss"]
    assert last["gail_shown"] > 0.8 > 0.2 > last["gail_own"]
    right, not_right = judge.bonus(seen, np.tile(np.arange(4), 32), {}), judge.bonus(seen, wrong, {})
    assert right.min() > 3 * not_right.max() > 0


def test_without_actions_only_what_is_seen_counts():
    judge = model(GailConfig(strength=1.0))
    seen = {"number": np.eye(4, dtype=np.float32)}
    assert (judge.bonus(seen, np.arange(4), {}) == judge.bonus(seen, np.array([1, 2, 3, 0]), {})).all()


def test_what_nobody_pays_for_is_learned_from_what_was_shown(tmp_path):
    path = tmp_path / "shown.safetensors"
    write_demonstrations(path, demonstrate(Expert(), CopyTheNumber(4), 40, seed=1))
    found = {}
    for strength in (1.0, 0.0):
        world = Unpaid(8)
        pupil = learner(
            path, world, strength=strength, use_actions=True, learning_rate=1e-2, batch_size=32, gradient_penalty=0.1
        )
        collector = Collector(world, pupil, 32, seed=1)
        for _ in range(28):
            told = pupil.update(collector.collect())
        greedy = play_episodes(GreedyPolicy(pupil), CopyTheNumber(4), episodes_each=4, seed=2)
        found[strength] = summarise(greedy).mean_reward
        assert ("gail_reward" in told) == bool(strength)
    assert found[1.0] > 7.5 > 5.0 > found[0.0], found


def test_what_is_restored_goes_on_bit_for_bit(tmp_path):
    path = tmp_path / "shown.safetensors"
    write_demonstrations(path, demonstrate(Expert(), CopyTheNumber(4), 8, seed=1))
    batch = Collector(CopyTheNumber(4), learner(path, CopyTheNumber(4), strength=1.0), 16, seed=1).collect()
    one, two = (learner(path, CopyTheNumber(4), strength=1.0) for _ in range(2))
    one.update(batch)
    two.load_state_dict(one.state_dict())
    assert one.update(batch) == two.update(batch)


def test_missing_and_foreign_demonstrations_are_refused(tmp_path):
    with pytest.raises(SettingError, match=r"gail\.demonstrations=FILE"):
        learner(None, CopyTheNumber(4), strength=1.0)
    with pytest.raises(CheckpointError, match="nowhere"):
        learner(tmp_path / "nowhere.safetensors", CopyTheNumber(4), strength=1.0)
    with pytest.raises(SettingError, match=r"gail\.demonstrations: the recorded actions"):
        model(shown=demonstrate(Expert(), CopyTheNumber(4), 4), world=Walk(4))


def of_one_tick(number=2, action=1, rows=5):
    """Return what was shown and what was done: the same tick again and again, so that chance picks nothing."""
    seen = np.eye(4, dtype=np.float32)[[number] * rows]
    spec = CopyTheNumber(4).spec
    told = PolicySpec("bc", spec.observations, spec.actions).as_dictionary()
    ends = np.zeros(rows, np.int32)
    return Demonstrations({"number": seen}, np.full(rows, action), np.zeros(rows, np.float32), ends, told)


@pytest.mark.parametrize("use_actions", [False, True])
def test_a_step_follows_the_cross_entropy_and_the_penalty_that_a_pencil_finds(use_actions):
    """What is done is what was shown, so every point between the two is that tick, wherever it lies."""
    config = GailConfig(1.0, use_actions=use_actions, learning_rate=1e-2, batch_size=5, gradient_penalty=3.0, units=8)
    judge = model(config, of_one_tick())
    twin = copy.deepcopy(judge.networks)
    optimiser = torch.optim.Adam(twin.parameters(), 1e-2)
    for _ in range(2):
        seen, done = torch.eye(4)[[2]].requires_grad_(), torch.eye(4)[[1]].requires_grad_()
        features = twin["features"]({"number": seen})
        logit = twin["judge"](torch.cat([features, done], dim=1) if use_actions else features).squeeze()
        slopes = torch.autograd.grad(logit, [seen, done] if use_actions else [seen], create_graph=True)
        norm = torch.cat(slopes, dim=1).norm()
        wrong = -torch.log(torch.sigmoid(logit)) - torch.log(1 - torch.sigmoid(logit))
        optimiser.zero_grad()
        (wrong + 3.0 * (norm - 1.0) ** 2).backward()
        optimiser.step()
        sure = torch.sigmoid(logit).item()
        told = judge.learn({"number": np.eye(4, dtype=np.float32)[[2] * 5]}, np.full(5, 1), {})
    assert list(told) == ["gail_loss", "gail_shown", "gail_own"] == list(judge.figures)
    assert list(told.values()) == pytest.approx([wrong.item(), sure, sure], rel=1e-5)
    for mine, its in zip(judge.networks.parameters(), twin.parameters(), strict=True):
        torch.testing.assert_close(mine, its, rtol=1e-3, atol=1e-5)


def test_a_point_between_is_as_far_from_the_shown_tick_as_from_its_own():
    judge, places = model(GailConfig(1.0, gradient_penalty=0.0), of_one_tick()), []

    def noted(inputs):
        places.append(inputs["number"].detach())
        return inputs["number"].sum(dim=1)

    judge._logits = noted
    judge._roughness({"number": torch.full((400, 4), 10.0)}, {"number": torch.zeros((400, 4))})
    (between,) = places
    assert (between.std(dim=1) == 0.0).all(), "one share for a whole tick"
    assert 0.0 <= between.min() < 0.5 < 9.5 < between.max() <= 10.0
    assert between.mean().item() == pytest.approx(5.0, abs=0.5)


def test_pixels_are_judged_from_0_to_1_and_nothing_privileged_is():
    seen = {"eye": ArraySpec((12, 16), np.uint8), "true": ArraySpec((1,), np.float32, privileged=True)}
    spec = WorldSpec("looking", 1, 1, seen, DiscreteActions(3))
    frames = np.random.default_rng(1).integers(0, 256, (3, 12, 16), dtype=np.uint8)
    told = PolicySpec("bc", {"eye": seen["eye"]}, spec.actions).as_dictionary()
    ticks = np.zeros(3, np.int64), np.zeros(3, np.float32), np.zeros(3, np.int32)
    row = Architecture(convolutions=((2, 6, 3),))
    judge = GailModel(spec, spec.actions, row, GailConfig(1.0), Demonstrations({"eye": frames}, *ticks, told), 1, "cpu")
    with torch.no_grad():
        logits = judge.networks["judge"](judge.networks["features"]({"eye": torch.from_numpy(frames / 255.0).float()}))
    sure = torch.sigmoid(logits).squeeze(1).numpy()
    np.testing.assert_allclose(judge.bonus({"eye": frames}, ticks[0], {}), -np.log(1 - sure), rtol=1e-4)
