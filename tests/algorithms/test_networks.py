"""Networks by hand: what counts as a picture, how pixels and numbers are read, and a user's own layers."""

import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from racecraft.algorithms.networks import (
    ActorCritic,
    Architecture,
    CustomEncoder,
    Encoder,
    Image,
    OwnActorCritic,
    Vector,
    encoder_for,
    is_image,
    zero_rows,
)
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions

SEEN = {"b": ArraySpec((3,), np.float32), "a": ArraySpec((2, 2), np.uint8)}
NUMBERS = ContinuousActions((-1.0, -1.0), (1.0, 1.0))


def chance(seed=1):
    return torch.Generator().manual_seed(seed)


@pytest.mark.parametrize(
    ("shape", "dtype", "is_seen"),
    [
        ((30, 40), np.uint8, True),
        ((30, 40, 3), np.uint8, True),
        ((30, 40, 3), np.float32, True),
        ((30, 40), np.float32, False),
        ((30,), np.uint8, False),
        ((), np.uint8, False),
        ((2, 3, 4, 5), np.uint8, False),
    ],
)
def test_pictures_are_told_from_vectors_by_shape_and_type(shape, dtype, is_seen):
    assert is_image(ArraySpec(shape, dtype)) == is_seen


def test_bytes_are_scaled_to_one_and_floats_are_not():
    eye = Image()
    grey = eye(torch.tensor([[[0, 51, 255], [102, 0, 0]]], dtype=torch.uint8))
    assert grey.shape == (1, 1, 2, 3)
    torch.testing.assert_close(grey[0, 0], torch.tensor([[0.0, 0.2, 1.0], [0.4, 0.0, 0.0]]))
    colour = eye(torch.tensor([[[[0.5, 2.0, 3.0]]]]))
    assert colour.shape == (1, 3, 1, 1)
    assert colour.flatten().tolist() == [0.5, 2.0, 3.0]


def test_scaled_numbers_are_cut_at_five_deviations():
    """A distance of 1 counts beside -1 and 1 around 0: the deviation is the root of (1 + 1 + 1) / (2 + 1), 1."""
    vector = Vector(1)
    vector.statistics.update(torch.tensor([[-1.0], [1.0]]))
    read = vector(torch.tensor([[0.0], [4.5], [5.5], [100.0], [-4.5], [-5.5]]))
    assert read.ravel().tolist() == pytest.approx([0.0, 4.5, 5.0, 5.0, -4.5, -5.0])
    assert Vector()(torch.tensor([[[1, 2], [3, 400]]])).tolist() == [[1.0, 2.0, 3.0, 400.0]]


def test_a_picture_just_as_large_as_its_kernel_finds_room():
    row = Architecture(convolutions=((2, 8, 3),), trunk_units=())
    body = Encoder({"eye": ArraySpec((8, 10), np.uint8)}, row, chance())
    assert body.width == 2  # (8 - 8) // 3 + 1 by (10 - 8) // 3 + 1 places of two filters
    assert body({"eye": torch.zeros(4, 8, 10, dtype=torch.uint8)}).shape == (4, 2)
    with pytest.raises(SettingError, match="at 7 x 10 px the convolution of kernel 8 finds no room"):
        Encoder({"eye": ArraySpec((7, 10), np.uint8)}, row, chance())


@pytest.mark.parametrize("units", [(), (5,), (6, 3)])
def test_layers_of_a_sensors_own_tell_how_much_they_give(units):
    seen = {"x": ArraySpec((4,), np.float32), "eye": ArraySpec((6, 7, 2), np.uint8)}
    row = Architecture(convolutions=((3, 4, 2),), image_units=units, vector_units=units, trunk_units=())
    body = Encoder(seen, row, chance())
    alone = units[-1] if units else None
    assert body.width == (alone or 2 * 2 * 3) + (alone or 4)
    shown = {"x": torch.ones(2, 4), "eye": torch.zeros(2, 6, 7, 2, dtype=torch.uint8)}
    for grad in (True, False):
        with torch.set_grad_enabled(grad):
            assert body(shown).shape == (2, body.width)


def test_glorot_begins_uniform_and_with_columns_of_one_length_where_aws_has_them():
    """Glorot and Bengio, 2010: uniform up to the root of 6 / (inputs + outputs); Coach's heads: columns normalised."""
    seen, row = {"x": ArraySpec((40,), np.float32)}, Architecture(trunk_units=(60,), initialisation="glorot")
    for actions, is_scaled in ((NUMBERS, True), (DiscreteActions(2), False)):
        network = ActorCritic(seen, actions, row, chance())
        (hidden,) = (one for one in network.policy_body.modules() if hasattr(one, "weight"))
        assert float(hidden.weight.detach().abs().max()) == pytest.approx(math.sqrt(6 / 100), rel=0.01)
        assert network.value_head.weight.detach().norm(dim=1).tolist() == pytest.approx([1.0])
        lengths = network.policy_head.weight.detach().norm(dim=1).tolist()
        if is_scaled:
            assert lengths == pytest.approx([0.01, 0.01])
        else:
            assert float(network.policy_head.weight.detach().abs().max()) == pytest.approx(math.sqrt(6 / 62), rel=0.1)
            assert min(lengths) > 0.5
        assert (network.log_std is None) == (not is_scaled)


@pytest.mark.parametrize("critic", ["shared", "separate", "privileged"])
def test_policy_and_value_asked_alone_are_those_of_both_together(critic):
    seen = {"x": ArraySpec((3,), np.float32), "secret": ArraySpec((2,), np.float32, privileged=True)}
    row = Architecture(
        trunk_units=(4,), separate_networks=critic == "separate", privileged_critic=critic == "privileged"
    )
    network = ActorCritic(seen, NUMBERS, row, chance())
    assert (network.critic_body is None) == (critic == "shared")
    shown = {"x": torch.randn(5, 3, generator=chance()), "secret": torch.randn(5, 2, generator=chance(2))}
    params, values = network(shown)
    assert (params.shape, values.shape) == ((5, 2), (5,))
    torch.testing.assert_close(network.policy(shown), params)
    torch.testing.assert_close(network.value(shown), values)


# A user's own


class Own(torch.nn.Module):
    """Three features of everything, laid end to end."""

    width, given = 3, 3

    def __init__(self, seen):
        super().__init__()
        self.names = tuple(seen)
        self.layer = torch.nn.Linear(sum(math.prod(part.shape) for part in seen.values()), self.given)

    def forward(self, observations):
        assert tuple(observations) == self.names
        return self.layer(torch.cat([part.flatten(1).float() for part in observations.values()], dim=1))


class TooWide(Own):
    """Says another width than it gives."""

    given = 4


class Fails(Own):
    """Cannot be asked."""

    def forward(self, observations):
        raise ValueError("no idea")


class Decides(torch.nn.Module):
    """Decides and values by itself."""

    more = 0

    def __init__(self, seen, actions, width):
        super().__init__()
        self.both = torch.nn.Linear(3, width + 1 + self.more)

    def forward(self, observations):
        both = self.both(observations["b"].float()).double()
        return both[:, 1:], both[:, 0]


class DecidesTooMuch(Decides):
    """Gives a number more than the actions have."""

    more = 1


@pytest.fixture(autouse=True)
def _module(monkeypatch):
    made = (Own, TooWide, Fails, Decides, DecidesTooMuch)
    monkeypatch.setitem(sys.modules, "own_layers", SimpleNamespace(**{one.__name__: one for one in made}))


def row_of(**own):
    return Architecture(**{name: f"own_layers:{one}" for name, one in own.items()})


def test_a_users_own_layers_begin_by_the_seed_they_are_given_and_touch_no_global_chance():
    bodies = []
    for globally in (5, 6):
        torch.manual_seed(globally)
        before = torch.get_rng_state()
        bodies.append(encoder_for(SEEN, row_of(encoder="Own"), chance()))
        assert torch.equal(torch.get_rng_state(), before)
    one, two = bodies
    assert isinstance(one, CustomEncoder)
    assert (one.names, one.width) == (("a", "b"), 3)
    assert torch.equal(one.own.layer.weight, two.own.layer.weight)
    assert not torch.equal(one.own.layer.weight, encoder_for(SEEN, row_of(encoder="Own"), chance(2)).own.layer.weight)
    assert isinstance(encoder_for(SEEN, Architecture(), chance()), Encoder)


def test_heads_stand_on_a_users_own_layers():
    network = ActorCritic(SEEN, NUMBERS, row_of(encoder="Own"), chance())
    shown = zero_rows(SEEN, ("a", "b"))
    params, values = network(shown)
    assert (params.shape, values.shape) == ((2, 2), (2,))
    assert network.prepare(shown).keys() == shown.keys()
    network.observe(shown)  # it keeps no statistics


@pytest.mark.parametrize(
    ("named", "said"),
    [
        ("TooWide", r"gives \(2, 4\) for two rows; expected \(2, 3\)"),
        ("Fails", r"failed \(ValueError: no idea\).*specs of a, b"),
    ],
)
def test_a_users_own_layers_of_another_shape_are_refused(named, said):
    with pytest.raises(SettingError, match=said):
        encoder_for(SEEN, row_of(encoder=named), chance())


@pytest.mark.parametrize("actions", [NUMBERS, DiscreteActions(4)])
def test_a_users_own_policy_decides_and_values_by_itself(actions):
    seen = {**SEEN, "secret": ArraySpec((2,), np.float32, privileged=True)}
    one, two = (OwnActorCritic(seen, actions, row_of(policy="Decides"), chance()) for _ in range(2))
    assert torch.equal(one.policy_body.own.both.weight, two.policy_body.own.both.weight)
    shown = {"b": torch.randn(5, 3, generator=chance()), "a": torch.zeros(5, 2, 2, dtype=torch.uint8)}
    params, values = one(shown)
    assert (params.shape, values.shape) == ((5, one.policy_body.width), (5,))
    assert (params.dtype, values.dtype) == (torch.float32, torch.float32)
    assert torch.equal(one.policy(shown), params)
    assert torch.equal(one.value(shown), values)
    assert one.policy_body.names == ("a", "b")  # nothing privileged
    if actions is NUMBERS:
        assert one.log_std.tolist() == [0.0, 0.0]
    else:
        assert one.log_std is None


def test_a_users_own_policy_of_another_shape_is_refused():
    with pytest.raises(SettingError, match=r"gives \(2, 3\) and \(2,\) for two rows; expected \(2, 2\)"):
        OwnActorCritic(SEEN, NUMBERS, row_of(policy="DecidesTooMuch"), chance())
