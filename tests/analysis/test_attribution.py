"""What a policy looks at: held to networks whose answer is known by hand, and to the completeness axiom."""

import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from racecraft.algorithms.actor_policy import ActorPolicy, actor_critic_class
from racecraft.algorithms.distributions import SQUASHED, SquashedGaussian, distribution_for
from racecraft.algorithms.explainable import MEMORY, Scores
from racecraft.algorithms.networks import Architecture
from racecraft.algorithms.q_network import QNetwork, QPolicy
from racecraft.algorithms.recurrent_policy import RecurrentPolicy
from racecraft.algorithms.sac_policy import SacPolicy
from racecraft.algorithms.stacking import StackedPolicy, stacked_specs
from racecraft.algorithms.twin_critics import SoftActorCritic
from racecraft.analysis.attribution import AttentionError, ExplainTarget, attribute, confidence
from racecraft.contract.world import (
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
)

H, W = 20, 24
CAMERA = ArraySpec((H, W), np.uint8, 0, 255)
STEREO = ArraySpec((H, W, 2), np.uint8, 0, 255)
LIDAR = ArraySpec((16,), np.float32)
ROW = Architecture(convolutions=((6, 4, 2), (8, 3, 1)), trunk_units=(16,))
NUMBERS = ContinuousActions((-0.5, 0.5), (0.5, 4.0))


def seen(specs, rows=3, seed=0):
    """Return rows of whatever is observed."""
    rng = np.random.default_rng(seed)
    made = {}
    for name, spec in specs.items():
        bytes_ = spec.dtype == np.uint8
        whole = rng.integers(0, 256, (rows, *spec.shape)) if bytes_ else rng.normal(size=(rows, *spec.shape))
        made[name] = whole.astype(spec.dtype)
    return made


def woken(network):
    """Give a network's heads weights that decide something; they are born almost indifferent."""
    with torch.no_grad():
        for name, weights in network.named_parameters():
            if weights.dim() == 2 and weights.std() < 0.05:
                weights.mul_(100.0)
            if name.endswith("bias"):
                weights.uniform_(-0.3, 0.3, generator=torch.Generator().manual_seed(5))
    return network


def actor(specs, actions, row=ROW, numbers="gaussian"):
    network = woken(actor_critic_class(row)(specs, actions, row, torch.Generator().manual_seed(3)))
    kind = ActorPolicy if row.memory == "none" else RecurrentPolicy
    return kind(network, distribution_for(actions, numbers=numbers))


def stacked():
    inner = actor(stacked_specs({"camera": CAMERA}, 3), DiscreteActions(4))
    return StackedPolicy({"camera": CAMERA}, 3, inner)


def soft():
    network = SoftActorCritic({"camera": CAMERA}, NUMBERS, ROW, torch.Generator().manual_seed(3))
    return SacPolicy(woken(network), SquashedGaussian(NUMBERS))


def q_policy():
    network = QNetwork({"camera": CAMERA}, DiscreteActions(4), ROW, True, torch.Generator().manual_seed(3))
    return QPolicy(woken(network))


ONE = {"camera": CAMERA}
POLICIES = {
    "choices": (lambda: actor(ONE, DiscreteActions(5)), ONE),
    "numbers": (lambda: actor(ONE, NUMBERS), ONE),
    "squashed": (lambda: actor(ONE, NUMBERS, numbers=SQUASHED), ONE),
    "several choices": (lambda: actor(ONE, MultiDiscreteActions((3, 2))), ONE),
    "both": (lambda: actor(ONE, HybridActions(NUMBERS, MultiDiscreteActions((3,)))), ONE),
    "stereo and lidar": (
        lambda: actor({"stereo": STEREO, "lidar": LIDAR}, DiscreteActions(5)),
        {"stereo": STEREO, "lidar": LIDAR},
    ),
    "gru": (lambda: actor(ONE, DiscreteActions(5), Architecture(ROW.convolutions, memory="gru", memory_units=8)), ONE),
    "lstm": (lambda: actor(ONE, NUMBERS, Architecture(ROW.convolutions, memory="lstm", memory_units=8)), ONE),
    "stack": (stacked, ONE),
    "sac": (soft, ONE),
    "worths": (q_policy, ONE),
}


@pytest.mark.parametrize("kind", POLICIES)
def test_the_parts_of_a_decision_add_up_to_it(kind):
    """Completeness, the axiom of integrated gradients, in the middle of an episode."""
    make, specs = POLICIES[kind]
    policy = make()
    policy.act(seen(specs, seed=8))  # so that whoever remembers has something to remember
    told = attribute(policy, seen(specs), steps=400)
    added = sum(part.reshape(3, -1).sum(axis=1) for part in told.parts.values())
    assert np.abs(told.score - told.baseline).max() > 0.01
    assert_allclose(added, told.score - told.baseline, atol=0.02 * np.abs(told.score - told.baseline).max() + 1e-4)
    assert (MEMORY in told.parts) == (kind in ("gru", "lstm"))


@pytest.mark.parametrize("kind", ["choices", "both", "stereo and lidar", "lstm", "stack", "sac", "worths"])
def test_looking_changes_nothing_and_tells_what_the_policy_would_do(kind):
    make, specs = POLICIES[kind]
    looked, plain = make(), make()
    for seed in range(3):
        rows = seen(specs, seed=seed)
        told = attribute(looked, rows)
        acted = plain.act(rows)
        assert_allclose(looked.act(rows), acted)
        if acted.ndim == 1:
            assert told.confidence.best.tolist() == acted.tolist()
        for name, spec in specs.items():
            if len(spec.shape) > 1:
                assert told.heat(name).shape == told.maps[name].shape == (3, *spec.shape[:2])
                assert told.maps[name].min() >= 0.0


def test_confidence_is_the_policys_own_probability():
    policy = actor(ONE, DiscreteActions(5))
    rows = seen(ONE, 6)
    told, likely = confidence(policy, rows), np.sort(policy.probabilities(rows), axis=1)
    assert_allclose(told.share, likely[:, -1], rtol=1e-5)
    assert_allclose(told.gap, likely[:, -1] - likely[:, -2], rtol=1e-4, atol=1e-6)
    assert_allclose(np.exp(-told.margin), likely[:, -2] / likely[:, -1], rtol=1e-4)


def test_worths_have_a_margin_and_no_probability():
    policy = q_policy()
    told, worth = confidence(policy, seen(ONE)), np.sort(policy.values(seen(ONE)), axis=1)
    assert_allclose(told.margin, worth[:, -1] - worth[:, -2], rtol=1e-4)
    assert np.isnan(told.gap).all()


def test_a_forbidden_option_is_neither_best_nor_asked():
    policy, rows = actor(ONE, DiscreteActions(5)), seen(ONE)
    argmax_action = confidence(policy, rows).best
    allowed = np.ones((3, 5), bool)
    allowed[np.arange(3), argmax_action] = False
    assert attribute(policy, rows, action_mask=allowed).confidence.best.tolist() == policy.act(rows, allowed).tolist()


class Linear(torch.nn.Module):
    """A policy of two options whose logits are written by hand."""

    def __init__(self, weights):
        super().__init__()
        self.weights, self.names = torch.tensor(weights), ("numbers",)

    encoder = property(lambda self: self)

    def inputs(self, observations):
        return {"numbers": torch.from_numpy(observations["numbers"])}

    def scores(self, fed):
        none = fed["numbers"][:, :0]
        return Scores(none, none, (fed["numbers"] @ self.weights,))


def test_integrated_gradients_of_a_linear_policy_by_hand():
    """Logits x0 + 2 x1 and 3 x0 - x1 at x = (2, 5): 12 and 1. The first above the mean of both: -x0 + 1.5 x1."""
    told = attribute(Linear([[1.0, 3.0], [2.0, -1.0]]), {"numbers": np.array([[2.0, 5.0]], np.float32)})
    assert told.confidence.best.tolist() == [0]
    assert told.confidence.margin.tolist() == [11.0]
    assert_allclose(told.parts["numbers"], [[-2.0, 7.5]], rtol=1e-6)
    assert_allclose((told.score, told.baseline), ([5.5], [0.0]), rtol=1e-6)


def test_grad_cam_of_a_small_network_by_hand():
    """One convolution of 2 x 2 ones over a picture of one bright pixel; option 1 adds up the one map, option 0 takes
    it off. Bright 1.0 at row 1, column 1 of 3 x 3: all four windows hold it, the map is 1 everywhere. The score is
    (sum - -sum) / 2, its gradient 1 at each place, so Grad-CAM is 1 everywhere; at a corner only one window has it."""
    row = Architecture(convolutions=((1, 2, 1),), trunk_units=())
    policy = actor({"camera": ArraySpec((3, 3), np.uint8)}, DiscreteActions(2), row)
    with torch.no_grad():
        network = policy.network
        network.policy_body.embedders[0][1].weight[:] = 1.0
        network.policy_body.embedders[0][1].bias[:] = 0.0
        network.policy_head.weight[:] = torch.tensor([[-1.0] * 4, [1.0] * 4])
        network.policy_head.bias[:] = 0.0
    pictures = np.zeros((2, 3, 3), np.uint8)
    pictures[0, 1, 1] = pictures[1, 0, 0] = 255
    told = attribute(policy, {"camera": pictures})
    assert told.confidence.best.tolist() == [1, 1]
    assert_allclose(told.maps["camera"][0], np.ones((3, 3)), rtol=1e-6)
    # The map of the second is 1, 0 over 0, 0; at 3 x 3 the middle lies between all four.
    assert_allclose(told.maps["camera"][1][[0, 1, 2], [0, 1, 2]], [1.0, 0.25, 0.0], atol=1e-6)


@pytest.mark.parametrize(("rows", "columns"), [(slice(0, 8), slice(0, W)), (slice(0, H), slice(16, W))])
def test_a_policy_made_to_look_at_one_region_only_is_found_out(rows, columns):
    policy = actor(ONE, DiscreteActions(5))
    blind = np.zeros((H, W), bool)
    blind[rows, columns] = True
    scores = policy.scores
    policy.scores = lambda fed: scores({"camera": fed["camera"] * torch.from_numpy(blind)})
    heat = attribute(policy, seen(ONE), steps=64).heat("camera")
    assert heat[:, ~blind].max() == 0.0
    assert heat[:, blind].min(axis=0).max() > 0.0


def test_one_asks_for_a_number_or_an_option_of_a_policy_that_has_it():
    policy = actor(ONE, HybridActions(NUMBERS, MultiDiscreteActions((3,))))
    speed = attribute(policy, seen(ONE), ExplainTarget(1))
    assert_allclose(speed.score, np.abs(speed.confidence.numbers[:, 1]), rtol=1e-5)
    for option in range(3):
        attribute(policy, seen(ONE), ExplainTarget(2, option))
    with pytest.raises(AttentionError, match="expected 0 to 2: 2 numbers, then 1 choices"):
        attribute(policy, seen(ONE), ExplainTarget(3))
    with pytest.raises(AttentionError, match="expected 0 to 2"):
        attribute(policy, seen(ONE), ExplainTarget(2, 3))


def test_a_network_that_takes_bytes_for_something_else_is_refused():
    policy = actor(ONE, DiscreteActions(5))
    scores = policy.scores

    def by_type(fed):
        camera = fed["camera"]
        return scores({"camera": camera if camera.dtype == torch.uint8 else camera * 3.0})

    policy.scores = by_type
    with pytest.raises(AttentionError, match="scales by value, not by type"):
        attribute(policy, seen(ONE))


def test_a_policy_that_shows_nothing_is_refused():
    with pytest.raises(AttentionError, match="does not show what it decides by"):
        attribute(object(), seen(ONE))
