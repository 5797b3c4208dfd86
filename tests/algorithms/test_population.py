"""Many policies at once answer as each of them alone does."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.networks import ActorCritic, Architecture
from racecraft.algorithms.population import PolicyAlone, Population, is_dense
from racecraft.contract.world import ArraySpec, ContinuousActions

SEEN = {
    "a": ArraySpec((3,), np.float32),
    "b": ArraySpec((2, 2), np.float32),
    "frame": ArraySpec((6, 6), np.uint8),
    "secret": ArraySpec((2,), np.float32, privileged=True),
}
NUMBERS = ContinuousActions((-1.0, -1.0), (1.0, 1.0))
ROWS = {
    "one vector": (("a",), Architecture(trunk_units=(4,), activation="tanh")),
    "layers of their own": (("a", "b", "secret"), Architecture(vector_units=(5, 4), trunk_units=(6, 3))),
    "a picture": (("a", "frame"), Architecture(convolutions=((2, 3, 2),), trunk_units=(4,))),
}


def network_of(row, seed=1):
    names, architecture = ROWS[row]
    chance = torch.Generator().manual_seed(seed)
    return ActorCritic({name: SEEN[name] for name in names}, NUMBERS, architecture, chance)


def drawn(network, seed):
    """Return all weights of a policy end to end, drawn from a seed, and the policy with these."""
    alone, chance = PolicyAlone(network), torch.Generator().manual_seed(seed)
    weights = torch.randn(sum(part.numel() for part in alone.parameters()), generator=chance)
    return weights, dict(zip(dict(alone.named_parameters()), split(weights, alone), strict=True))


def split(weights, alone):
    parts = weights.split([part.numel() for part in alone.parameters()])
    return [part.view(own.shape) for part, own in zip(parts, alone.parameters(), strict=True)]


def seen_by(rows, seed=5):
    chance = np.random.default_rng(seed)
    return {
        "a": torch.from_numpy(chance.normal(size=(rows, 3)).astype(np.float32)),
        "b": torch.from_numpy(chance.normal(size=(rows, 2, 2)).astype(np.float32)),
        "frame": torch.from_numpy(chance.integers(0, 256, (rows, 6, 6)).astype(np.uint8)),
    }


def alone(network, own, seen, row):
    with torch.no_grad():
        return torch.func.functional_call(
            PolicyAlone(network), own, ({name: part[row : row + 1] for name, part in seen.items()},)
        )[0]


@pytest.mark.parametrize("row", ROWS)
def test_every_row_is_answered_by_its_member(row):
    network, count = network_of(row), 3
    population, members = Population(network, count), []
    for number in range(count):
        weights, own = drawn(network, seed=number)
        population.put(number, weights)
        members.append(own)
    seen = seen_by(count)
    found = population.params(seen)
    assert found.shape == (count, 2)
    for number in range(count):
        torch.testing.assert_close(found[number], alone(network, members[number], seen, number), rtol=1e-4, atol=1e-5)
    chosen, more = np.array([2, 0, 0, 1]), seen_by(4, seed=6)
    for _ in range(2):  # the latest choice is kept from one tick to the next
        found = population.params(more, chosen)
        for place, member in enumerate(chosen):
            wanted = alone(network, members[member], more, place)
            torch.testing.assert_close(found[place], wanted, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("row", ["one vector", "a picture"])
def test_what_is_put_and_who_is_asked_counts_at_once(row):
    network = network_of(row)
    population, seen = Population(network, 2), seen_by(1)
    assert (population.params(seen, np.array([1])) == 0.0).all()  # nobody has weights yet
    weights, own = drawn(network, seed=3)
    population.put(1, weights)
    found = population.params(seen, np.array([1]))[0]
    torch.testing.assert_close(found, alone(network, own, seen, 0), rtol=1e-4, atol=1e-5)
    assert (population.params(seen, np.array([0])) == 0.0).all()


def test_the_networks_own_weights_stay_as_they_were():
    network = network_of("one vector")
    before = [part.clone() for part in network.parameters()]
    population = Population(network, 2)
    population.put(0, drawn(network, seed=3)[0])
    assert all(torch.equal(old, new) for old, new in zip(before, network.parameters(), strict=True))


def test_only_dense_layers_over_vectors_go_by_hand():
    assert is_dense(network_of("one vector").policy_body)
    assert is_dense(network_of("layers of their own").policy_body)
    assert not is_dense(network_of("a picture").policy_body)
    assert not is_dense(torch.nn.Sequential(torch.nn.Linear(2, 2)))
