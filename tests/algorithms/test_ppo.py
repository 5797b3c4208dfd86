"""PPO by hand and by law: the clip, the mask, the rows left out, the exact continuation."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from racecraft.algorithms import ppo as ppo_page
from racecraft.algorithms.distributions import Categorical
from racecraft.algorithms.learner import DivergedError
from racecraft.algorithms.networks import ActorCritic, Architecture, NetworkConfig, architecture_of
from racecraft.algorithms.ppo import FIGURES, LOG_PROB, RAW_ACTION, VALUE, PpoConfig, PpoLearner
from racecraft.algorithms.ppo_batch import Minibatch
from racecraft.algorithms.ppo_loss import ppo_loss
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, WorldSpec

FRAME = ArraySpec((30, 40), np.uint8, 0, 255)
STATE = ArraySpec((5,), np.float32)
SECRET = ArraySpec((6,), np.float32, privileged=True)


def world_spec(observations, actions, **more):
    return WorldSpec("toy", 4, 1, observations, actions, **more)


def made_up(spec, ticks=6, rows=4, seed=0, learner=None):
    """RolloutBatch with arbitrary numbers but true log-probabilities."""
    rng = np.random.default_rng(seed)
    shape = (ticks, rows)
    seen = {}
    for name, part in spec.observations.items():
        whole = (
            rng.integers(0, 256, (*shape, *part.shape))
            if part.dtype == np.uint8
            else rng.normal(size=(*shape, *part.shape))
        )
        seen[name] = whole.astype(part.dtype)
    flat = {name: array.reshape(-1, *array.shape[2:]) for name, array in seen.items()}
    decided = learner.act(flat, generator=torch.Generator().manual_seed(seed))
    terminated, truncated = rng.random((2, *shape)) < 0.1
    cut = np.flatnonzero(truncated & ~terminated)
    return RolloutBatch(
        observations=seen,
        actions=decided.actions.reshape(*shape, *decided.actions.shape[1:]),
        reward=rng.normal(size=shape).astype(np.float32),
        terminated=terminated,
        truncated=truncated,
        active=np.ones(shape, bool),
        last_observations={name: array[0] for name, array in seen.items()},
        last_active=np.ones(rows, bool),
        columns={name: part.reshape(*shape, *part.shape[1:]) for name, part in decided.columns.items()},
        final_index=cut,
        final_observations={name: array.reshape(-1, *array.shape[2:])[cut[::-1]] for name, array in seen.items()},
    )


def a_learner(observations=None, actions=None, seed=3, network=None, kind=PpoLearner, **settings):
    spec = world_spec(observations or {"state": STATE}, actions or DiscreteActions(3))
    return kind(spec, network or NetworkConfig(hidden_units=(16,)), PpoConfig(**settings), seed)


class Fixed(torch.nn.Module):
    """A network whose answers are known."""

    log_std = None

    def __init__(self, logits, values):
        super().__init__()
        self.logits = torch.nn.Parameter(torch.tensor(logits))
        self.values = torch.nn.Parameter(torch.tensor(values))

    def forward(self, observations):
        return self.logits, self.values


def test_the_clipped_objective_by_hand():
    """Two choices, equally likely now (0.5 each)."""
    network = Fixed([[0.0, 0.0]] * 4, [1.0, 1.0, 1.0, 1.0])
    # old probability 0.5, 0.25, 0.25, 1.0 -> ratio 1, 2, 2, 0.5
    # advantage      2,   1,    -1,   -1
    # unclipped      2,   2,    -2,   -0.5
    # clipped 0.2    2,   1.2,  -1.2, -0.8      the lesser: 2, 1.2, -2, -0.8 -> mean 0.1 -> loss -0.1
    # value: targets 0, 1, 2, 4 -> errors 1, 0, 1, 9 -> mean 2.75; entropy log 2
    batch = Minibatch(
        observations={},
        raw_actions=torch.tensor([0, 1, 0, 1]),
        log_prob=torch.tensor([0.5, 0.25, 0.25, 1.0]).log(),
        advantages=torch.tensor([2.0, 1.0, -1.0, -1.0]),
        targets=torch.tensor([0.0, 1.0, 2.0, 4.0]),
    )
    config = PpoConfig(clip=0.2, standardise="none", value_weight=0.5, entropy_weight=0.1)
    loss, figures = ppo_loss(network, Categorical(DiscreteActions(2)), batch, config)
    assert figures[:3].tolist() == pytest.approx([-0.1, 2.75, math.log(2)])
    assert loss.item() == pytest.approx(-0.1 + 0.5 * 2.75 - 0.1 * math.log(2))
    # KL: mean of (ratio - 1 - log ratio) = (0 + 2 (1 - log 2) + (-0.5 + log 2)) / 4; three ratios left 1 +- 0.2
    assert figures[3].item() == pytest.approx((2 * (1 - math.log(2)) - 0.5 + math.log(2)) / 4)
    assert figures[4].item() == 0.75


def test_masked_actions_are_never_chosen():
    learner = a_learner(actions=DiscreteActions(5))
    rng = np.random.default_rng(0)
    mask = rng.random((4000, 5)) < 0.4
    mask[np.arange(4000), rng.integers(0, 5, 4000)] = True
    seen = {"state": rng.normal(size=(4000, 5)).astype(np.float32)}
    decided = learner.act(seen, mask)
    assert np.isfinite(decided.columns[LOG_PROB]).all()
    for actions in (decided.actions, learner.choose(seen, mask)):
        assert mask[np.arange(4000), actions].all()


def test_numbers_are_first_drawn_as_widely_as_is_set():
    learner = a_learner(actions=ContinuousActions((-2.0, 1.0), (2.0, 3.0)), initial_std=0.2)
    drawn = learner.act({"state": np.zeros((4000, 5), np.float32)}).actions
    np.testing.assert_allclose(drawn.std(axis=0), (0.4, 0.2), rtol=0.05)


@pytest.mark.parametrize("centred", [False, True])
def test_inactive_rows_teach_nothing(centred):
    """Two experiences that differ only in rows that are not active lead to the same weights, bit for bit."""
    weights = []
    for noise in (0, 50):
        learner = a_learner({"state": STATE, "frame": FRAME}, batch_size=7, centred_pixels=centred)
        kept = made_up(learner.spec, learner=learner)
        kept.active[2:5, :2] = False
        for array in kept.observations.values():
            array[~kept.active] += np.asarray(noise, array.dtype)
        kept.columns[LOG_PROB][~kept.active] += noise
        kept.columns[VALUE][~kept.active] += noise
        losses = learner.update(kept)
        assert losses["transitions"] == 24 - 6
        weights.append(learner.state_dict()["network"])
    assert all(torch.equal(weights[0][name], weights[1][name]) for name in weights[0])


@pytest.mark.parametrize(
    ("seen", "settings", "is_alike"),
    [
        ({"state": STATE}, {}, True),
        ({"frame": FRAME}, {}, False),
        ({"frame": FRAME}, {"precision": "bfloat16", "max_grad_norm": None}, False),
    ],
)
def test_pixels_are_centred_whichever_way_steps_are_taken(seen, settings, is_alike):
    learned = []
    for centred in (False, True):
        learner = a_learner(seen, centred_pixels=centred, **settings)
        learner.update(made_up(learner.spec, learner=learner))
        learned.append(learner.state_dict()["network"])
    assert all(torch.equal(learned[0][name], learned[1][name]) for name in learned[0]) is is_alike


def test_with_nobody_active_nothing_changes():
    learner = a_learner()
    before = learner.state_dict()["network"]
    kept = made_up(learner.spec, learner=learner)
    kept.active[:] = False
    assert learner.update(kept)["minibatches"] == 0
    assert all(torch.equal(before[name], after) for name, after in learner.state_dict()["network"].items())


@pytest.mark.parametrize(
    ("actions", "settings"),
    [
        (DiscreteActions(3), {}),
        (ContinuousActions((-1.0, 0.0), (1.0, 4.0)), {}),
        (DiscreteActions(3), {"observations": {"state": STATE, "frame": FRAME}, "centred_pixels": True}),
    ],
)
def test_a_restored_learner_goes_on_bit_by_bit(actions, settings):
    learner = a_learner(actions=actions, batch_size=8, **settings)
    kept = made_up(learner.spec, learner=learner)
    learner.update(kept)
    learner.optimiser.learning_rate = 1e-4
    twin = a_learner(actions=actions, batch_size=8, seed=99, **settings)
    twin.load_state_dict(learner.state_dict())
    assert learner.update(kept) == twin.update(kept)
    mine, its = learner.state_dict(), twin.state_dict()
    for group in mine:
        assert all(torch.equal(mine[group][name], its[group][name]) for name in mine[group])
    seen = {name: array[0] for name, array in kept.observations.items()}
    np.testing.assert_array_equal(learner.act(seen).columns[RAW_ACTION], twin.act(seen).columns[RAW_ACTION])


def test_a_new_learner_does_not_touch_the_global_dice():
    torch.manual_seed(5)
    before = torch.get_rng_state()
    learner = a_learner({"frame": FRAME, "secret": SECRET})
    learner.update(made_up(learner.spec, learner=learner))
    assert torch.equal(before, torch.get_rng_state())


def test_the_policy_never_reads_what_is_privileged():
    learner = a_learner({"frame": FRAME, "secret": SECRET})
    rng = np.random.default_rng(0)
    frame = rng.integers(0, 256, (3, 30, 40), dtype=np.uint8)
    seen = {"frame": frame, "secret": np.zeros((3, 6), np.float32)}
    other = {"frame": frame, "secret": np.ones((3, 6), np.float32)}
    first, second = (learner.act(part, generator=torch.Generator().manual_seed(1)) for part in (seen, other))
    np.testing.assert_array_equal(first.columns[LOG_PROB], second.columns[LOG_PROB])
    assert (learner.values(seen) != learner.values(other)).all()
    np.testing.assert_array_equal(learner.choose({"frame": frame}), learner.choose(other))


def test_without_a_privileged_critic_nobody_reads_it():
    learner = a_learner({"state": STATE, "secret": SECRET}, network=NetworkConfig(privileged_critic=False))
    assert learner.network.critic_body is None
    state = np.zeros((2, 5), np.float32)
    assert learner.act({"state": state}).columns[VALUE].shape == (2,)


def test_frames_with_and_without_channels_and_vectors_meet_in_one_network():
    seen = {"b_rgb": ArraySpec((30, 40, 3), np.uint8), "a_grey": FRAME, "c_state": STATE}
    learner = a_learner(seen, actions=ContinuousActions((-1.0, 0.0), (1.0, 4.0)))
    assert learner.network.policy_body.names == ("a_grey", "b_rgb", "c_state")
    losses = learner.update(made_up(learner.spec, learner=learner))
    assert np.isfinite(losses["policy_loss"])


def test_the_shallow_network_of_aws_has_its_known_size():
    """11 264 features after the convolutions, 5.8 million weights in each of two separate networks (facts 8.2)."""
    row = Architecture(
        convolutions=((32, 8, 4), (64, 4, 2), (64, 3, 1)), trunk_units=(512,), separate_networks=True,
        initialisation="glorot",
    )  # fmt: skip
    network = ActorCritic({"f": ArraySpec((120, 160), np.uint8)}, DiscreteActions(5), row, torch.Generator())
    assert network.policy_body.trunk[0].in_features == 11264
    body = sum(p.numel() for p in network.policy_body.parameters())
    assert body == 2080 + 32832 + 36928 + 5767680
    assert sum(p.numel() for p in network.critic_body.parameters()) == body


def test_a_frame_too_small_for_its_convolutions_is_refused_in_words():
    with pytest.raises(SettingError, match="finds no room"):
        a_learner({"frame": ArraySpec((8, 8), np.uint8)})
    with pytest.raises(SettingError, match="expected one of each"):
        architecture_of(NetworkConfig(conv_filters=(16,)))


def test_remainders_are_dropped_only_when_asked():
    for drop, count in ((False, 5 * 4), (True, 4 * 4)):  # 24 rows: 5 + 5 + 5 + 5 + 4
        learner = a_learner(batch_size=5, drop_remainder=drop)
        assert learner.update(made_up(learner.spec, learner=learner))["minibatches"] == count
    learner = a_learner(batch_size=64, drop_remainder=True)  # fewer than a batch: lowered to 16
    assert learner.update(made_up(learner.spec, learner=learner))["minibatches"] == 4


def test_losses_that_are_no_numbers_stop_the_training():
    learner = a_learner()
    kept = made_up(learner.spec, learner=learner)
    kept.reward[0, 0] = np.nan
    with pytest.raises(DivergedError, match="Lower ppo.learning_rate"):
        learner.update(kept)


@pytest.mark.parametrize("channels", [1, 3])
def test_kernels_lie_channels_last_whatever_their_number(channels):
    """Convolutions go by their weights' strides; a kernel of one channel in the usual order cost a fifth of speed."""
    frame = ArraySpec((30, 40, channels), np.uint8, 0, 255)
    row = architecture_of(NetworkConfig())
    network = ActorCritic({"eye": frame}, DiscreteActions(3), row, torch.Generator().manual_seed(1))
    kernels = [part.weight for part in network.modules() if isinstance(part, torch.nn.Conv2d)]
    assert len(kernels) == 2
    for kernel in kernels:
        _, channels_in, height, width = kernel.shape
        assert kernel.stride() == (height * width * channels_in, 1, width * channels_in, channels_in)


def test_what_follows_a_cut_is_the_final_observation_and_not_the_next_start():
    learner = a_learner()
    kept = made_up(learner.spec, learner=learner, seed=4)
    assert len(kept.final_index) > 0
    value = kept.columns[VALUE]
    found = learner._next_values(kept, value)
    expected = np.concatenate([value[1:], learner.values(kept.last_observations)[None]])
    for place, at in enumerate(kept.final_index):
        final = {name: array[[place]] for name, array in kept.final_observations.items()}
        expected[divmod(at, 4)] = learner.values(final)[0]
    np.testing.assert_allclose(found, expected, atol=1e-6)
    # and it matters: the same rollout with other final observations teaches something else
    other = a_learner()
    changed = {name: array + 1.0 for name, array in kept.final_observations.items()}
    first, second = learner.update(kept), other.update(replace(kept, final_observations=changed))
    assert first["value_loss"] != second["value_loss"]


def test_schedules_fall_in_a_straight_line_to_where_ml_agents_ends_them():
    learner = a_learner(
        learning_rate=1e-3, learning_rate_schedule="linear", clip=0.2, clip_schedule="linear",
        entropy_weight=0.02, entropy_schedule="linear",
    )  # fmt: skip
    learner.anneal(0.25)
    assert learner.learning_rate == pytest.approx(7.5e-4 + 0.25e-10, rel=1e-12)
    assert learner.now.clip == pytest.approx(0.175)
    assert learner.now.entropy_weight == pytest.approx(0.015 + 0.25e-5)
    learner.anneal(1.0)
    ends = learner.learning_rate, learner.now.clip, learner.now.entropy_weight
    assert ends == pytest.approx((1e-10, 0.1, 1e-5))
    before = learner.state_dict()["network"]
    learner.update(made_up(learner.spec, learner=learner))
    after = learner.state_dict()["network"]
    for name, weight in before.items():
        torch.testing.assert_close(weight, after[name], atol=1e-7, rtol=0.0)


def test_what_is_below_the_end_of_its_schedule_stays():
    learner = a_learner(clip=0.05, clip_schedule="linear", entropy_weight=0.0, entropy_schedule="linear")
    learner.anneal(0.5)
    assert (learner.now.clip, learner.now.entropy_weight) == (0.05, 0.0)


def test_what_follows_a_cut_is_found_however_a_rollout_lies_in_memory():
    """Rows taken out of a rollout lie otherwise in memory than the rollout does."""
    learner = a_learner()
    batch = made_up(learner.spec, rows=6, learner=learner)
    assert len(batch.final_index)
    judged, again = learner.compute_advantages(batch), learner.compute_advantages(batch.of_rows(np.arange(6)))
    assert np.array_equal(judged.advantages, again.advantages)


def two_choices(advantages, log_prob=None, **more):
    """Return what a network of two even choices says of a minibatch: its ratios are 0.5 over what was likely."""
    count = len(advantages)
    kind, even = Categorical(DiscreteActions(2)), Fixed([[0.0, 0.0]] * count, [0.0] * count)
    known = kind.log_prob_and_entropy(even.logits, None, None, torch.zeros(count, dtype=torch.long))[0].detach()
    batch = Minibatch(
        {}, torch.zeros(count, dtype=torch.long), known if log_prob is None else torch.tensor(log_prob),
        torch.tensor(advantages), torch.zeros(count), weights=more.pop("weights", None),
    )  # fmt: skip
    return ppo_loss(even, kind, batch, PpoConfig(**{"standardise": "none", "entropy_weight": 0.0, **more}))


@pytest.mark.parametrize("over", ["minibatch", "rollout"])
def test_a_lone_advantage_is_not_standardised_and_two_are(over):
    """Before the first step every ratio is 1, so the loss is minus the mean: of two standardised ones it is 0."""
    for count in (1, 2):
        learner = a_learner(standardise=over, epochs=1)
        kept = made_up(learner.spec, learner=learner)
        kept.active[:] = False
        kept.active.reshape(-1)[:count] = True
        told = learner.update(kept)
        assert abs(told["mean_advantage"]) > 0.1
        expected = -told["mean_advantage"] if count == 1 else 0.0
        assert told["policy_loss"] == pytest.approx(expected, rel=1e-4, abs=1e-5)


def test_older_decisions_count_by_their_weights():
    # ratios 1 and advantages 2 and 4: (1 * 2 + 0.25 * 4) / 2
    _, figures = two_choices([2.0, 4.0], weights=torch.tensor([1.0, 0.25]))
    assert figures[0].item() == pytest.approx(-1.5)


def test_with_nobody_active_every_figure_is_nothing():
    for network in (None, NetworkConfig(hidden_units=(16,), separate_networks=True, privileged_critic=False)):
        learner = a_learner(network=network)
        kept = made_up(learner.spec, learner=learner)
        kept.active[:] = False
        assert learner.update(kept) == dict.fromkeys(FIGURES, 0.0)


@pytest.mark.parametrize("apart", [False, True])
def test_a_critic_of_its_own_values_every_active_row_however_many_it_is_asked_about_at_once(monkeypatch, apart):
    monkeypatch.setattr(ppo_page, "ROWS_AT_ONCE", 3)
    learner = a_learner(network=NetworkConfig(hidden_units=(16,), separate_networks=True, privileged_critic=False))
    learner.steps.learns_apart = apart
    kept = made_up(learner.spec, learner=learner)
    kept.active[1, :] = False
    values = learner.compute_advantages(kept).values
    asked = learner.values({"state": kept.observations["state"].reshape(-1, 5)}).reshape(6, 4)
    np.testing.assert_allclose(values[kept.active], asked[kept.active], rtol=1e-5)
    assert (values[1] == 0.0).all()


def test_weights_alone_are_gone_on_from_with_an_optimiser_and_chance_of_its_own():
    learner, other = a_learner(), a_learner(seed=9)
    learner.update(made_up(learner.spec, learner=learner))
    chance, moments = other.state_dict()["generator"]["state"], other.state_dict()["optimiser"]
    for state in ({"network": learner.state_dict()["network"]}, {**learner.state_dict(), "optimiser": {}}):
        other.load_state_dict(state)
        mine, its = learner.state_dict(), other.state_dict()
        assert all(torch.equal(mine["network"][name], its["network"][name]) for name in mine["network"])
        assert all(torch.equal(moments[name], its["optimiser"][name]) for name in moments)
        assert torch.equal(its["generator"]["state"], chance) == ("generator" not in state)


def test_what_is_written_down_is_a_copy():
    learner = a_learner()
    kept = learner.state_dict()["network"]
    before = {name: part.clone() for name, part in kept.items()}
    learner.update(made_up(learner.spec, learner=learner))
    assert all(torch.equal(kept[name], before[name]) for name in before)
