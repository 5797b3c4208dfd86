"""What a search teaches a policy, by hand."""

import copy
import math

import numpy as np
import pytest
import torch

from racecraft.algorithms import alphazero as page
from racecraft.algorithms.alphazero import FIGURES, SEARCHED, AlphaZeroConfig, AlphaZeroLearner, alphazero_loss
from racecraft.algorithms.learner import DivergedError
from racecraft.algorithms.networks import Architecture
from racecraft.algorithms.returns import advantages, explained_variance
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec

SEEN = {"x": ArraySpec((3,), np.float32), SEARCHED: ArraySpec((3,), np.float32)}
SPEC = WorldSpec("toy", 2, 1, SEEN, DiscreteActions(3), has_action_mask=True)


def learner(seed=1, **settings):
    row = Architecture(trunk_units=(6,), activation="tanh")
    made = AlphaZeroLearner(SPEC, row, AlphaZeroConfig(**({"batch_size": 64, "epochs": 1} | settings)), seed)
    with torch.no_grad():
        for one in made.network.parameters():  # an opinion from the beginning
            torch.nn.init.normal_(one, generator=torch.Generator().manual_seed(seed + one.numel()))
    return made


def rollout():
    """Return 5 ticks of 2 rows: one tick not searched, one not active, an end, and a cut with what was seen last."""
    rng = np.random.default_rng(4)

    def seen(*rows):
        searched = rng.dirichlet(np.ones(3), rows).astype(np.float32)
        return {"x": rng.normal(size=(*rows, 3)).astype(np.float32), SEARCHED: searched}

    observations, mask = seen(5, 2), rng.random((5, 2, 3)) < 0.7
    mask[..., 0] = True
    observations[SEARCHED][1, 0] = 0.0
    active = np.ones((5, 2), bool)
    active[3, 1] = False
    terminated, truncated = np.zeros((5, 2), bool), np.zeros((5, 2), bool)
    terminated[2, 0], truncated[1, 1] = True, True
    return RolloutBatch(
        observations, rng.integers(0, 3, (5, 2)), rng.normal(size=(5, 2)).astype(np.float32), terminated, truncated,
        active, seen(2), np.array([True, True]), {}, mask, np.ones((2, 3), bool), np.array([1 * 2 + 1]), seen(1),
    )  # fmt: skip


def test_moves_that_are_surely_fatal_weigh_nothing_in_the_loss():
    """Of three moves one is forbidden, however much the network likes it; the other two are equally likely."""
    batch = {
        SEARCHED: torch.tensor([[0.25, 0.75, 0.0]]),
        "targets": torch.tensor([1.0]),
        "action_mask": torch.tensor([[True, True, False]]),
    }

    def network(seen):
        return torch.tensor([[0.0, 0.0, 9.0]]), torch.tensor([0.5])

    loss, (policy, value, entropy, agreement) = alphazero_loss(network, batch, value_weight=2.0)
    assert float(policy) == pytest.approx(math.log(2))
    assert (float(value), float(agreement)) == (0.25, 0.0)
    assert float(entropy) == pytest.approx(-(0.25 * math.log(0.25) + 0.75 * math.log(0.75)))
    assert float(loss) == pytest.approx(math.log(2) + 0.5)


def test_without_a_mask_all_moves_count_and_figures_are_means_over_rows():
    batch = {SEARCHED: torch.tensor([[1.0, 0.0], [0.5, 0.5]]), "targets": torch.tensor([1.0, -2.0])}

    def network(seen):
        return torch.tensor([[math.log(3.0), 0.0], [0.0, math.log(3.0)]]), torch.tensor([0.0, 0.0])

    loss, figures = alphazero_loss(network, batch, value_weight=3.0)
    policy = (-math.log(0.75) - 0.5 * (math.log(0.25) + math.log(0.75))) / 2
    assert figures.tolist() == pytest.approx([policy, 2.5, math.log(2) / 2, 0.5])
    assert loss.item() == pytest.approx(policy + 3 * 2.5)


def test_the_network_does_not_see_the_search_and_a_world_without_one_is_refused():
    made = learner()
    assert list(made.spec.observations) == list(made.policy_spec.observations) == ["x"]
    assert (made.policy_spec.algorithm, made.experience, made.columns) == ("alphazero", "rollout", {})
    with pytest.raises(SettingError, match="brings none along"):
        AlphaZeroLearner(made.spec, Architecture(), AlphaZeroConfig(), 1)


def many(shares, rows=6000):
    return {"x": np.zeros((rows, 3), np.float32), SEARCHED: np.tile(np.float32(shares), (rows, 1))}


@pytest.mark.parametrize(("temperature", "power"), [(1.0, 1.0), (0.5, 2.0)])
def test_choices_are_drawn_as_often_as_they_were_walked_sharpened_by_the_temperature(temperature, power):
    drawn = learner(temperature=temperature).act(many([0.6, 0.3, 0.1])).actions
    shares = np.array([0.6, 0.3, 0.1]) ** power
    np.testing.assert_allclose(np.bincount(drawn, minlength=3) / 6000, shares / shares.sum(), atol=0.02)


@pytest.mark.parametrize("temperature", [0.0, 0.005])
def test_with_little_or_no_temperature_the_most_walked_is_taken(temperature):
    """0.36 to the power of 200 would be nothing in float32, so walks are measured by the most walked."""
    assert (learner(temperature=temperature).act(many([0.36, 0.32, 0.32], 50)).actions == 0).all()
    assert (learner(temperature=temperature).act(many([0.32, 0.32, 0.36], 50)).actions == 2).all()


def test_rows_that_nobody_searched_do_what_the_policy_would_within_the_mask():
    made, rng = learner(temperature=0.0), np.random.default_rng(1)
    seen = {"x": rng.normal(size=(40, 3)).astype(np.float32), SEARCHED: np.zeros((40, 3), np.float32)}
    mask = rng.random((40, 3)) < 0.6
    mask[:, 1] = True
    assert np.array_equal(made.act(seen, mask).actions, made.choose(seen, mask))
    assert mask[np.arange(40), made.choose(seen, mask)].all()
    alone = made.choose(seen)
    seen[SEARCHED][::2] = np.eye(3, dtype=np.float32)[(alone[::2] + 1) % 3]
    decided = made.act(seen)
    assert np.array_equal(decided.actions[::2], (alone[::2] + 1) % 3)
    assert np.array_equal(decided.actions[1::2], alone[1::2])
    assert (decided.actions.dtype, decided.columns) == (np.int64, {})


@pytest.mark.parametrize("limit", [None, 0.1])
@pytest.mark.parametrize("at_once", [1024, 3])
def test_an_update_is_the_steps_that_a_pencil_takes_from_what_was_searched(limit, at_once, monkeypatch):
    """The advantages' page tells the targets; inactive rows and those not searched teach nothing."""
    monkeypatch.setattr(page, "ROWS_AT_ONCE", at_once)
    made, batch = learner(max_grad_norm=limit, learning_rate=1e-2, value_weight=0.5, epochs=2), rollout()
    network = copy.deepcopy(made.network)

    def values(seen):
        rows = torch.from_numpy(seen["x"]).reshape(-1, 3)
        return network.value({"x": rows}).detach().numpy().reshape(seen["x"].shape[:-1])

    value = np.where(batch.active, values(batch.observations), 0.0).astype(np.float32)
    following = np.concatenate([value[1:], values(batch.last_observations)[None]])
    following[1, 1] = values(batch.final_observations)[0]
    targets = advantages(batch.reward, value, following, batch.terminated, batch.truncated, 0.995, 0.97, batch.active)[
        1
    ]
    learned = np.ones((5, 2), bool)
    learned[1, 0] = learned[3, 1] = False
    whole = {name: torch.from_numpy(array[learned]) for name, array in batch.observations.items()}
    whole |= {
        "targets": torch.from_numpy(targets[learned]),
        "action_mask": torch.from_numpy(batch.action_mask[learned]),
    }
    optimiser, steps = torch.optim.Adam(network.parameters(), 1e-2), []
    for _ in range(2):
        optimiser.zero_grad()
        loss, figures = alphazero_loss(network, whole, 0.5)
        loss.backward()
        norm = torch.nn.utils.clip_grad_norm_(network.parameters(), math.inf if limit is None else limit)
        optimiser.step()
        steps.append([*figures.tolist(), norm.item()])

    told = made.update(batch)
    foreseen = explained_variance(value[learned], targets[learned])
    assert list(told) == list(FIGURES)
    assert list(told.values()) == pytest.approx([*np.mean(steps, axis=0), foreseen, 8, 2], rel=1e-3)
    for mine, its in zip(made.network.parameters(), network.parameters(), strict=True):
        torch.testing.assert_close(mine, its, rtol=1e-3, atol=1e-5)


def test_every_searched_row_is_learned_from_in_each_pass_and_seen_through_every_symmetry():
    made, batch, seen = learner(batch_size=3, epochs=4), rollout(), ([], [])

    def through(place):
        def turn(rows):
            seen[place].append(len(rows["targets"]))
            return dict(rows)

        return turn

    made.symmetries = tuple(through(place) for place in range(2))
    told = [made.update(batch) for _ in range(6)]
    assert [(one["transitions"], one["minibatches"]) for one in told] == [(8, 12)] * 6
    taken = len(seen[0]) + len(seen[1])
    assert set(seen[0]) == set(seen[1]) == {2, 3}
    assert all(12 < len(some) < 36 for some in seen), "a third of 72 each"
    assert 36 < taken < 60, "and a third as it is"


def test_where_nothing_was_searched_nothing_is_learned():
    made, batch = learner(), rollout()
    batch.observations[SEARCHED][:] = 0.0
    before = copy.deepcopy(made.network.state_dict())
    assert list(made.update(batch).values()) == [0.0] * 8
    assert all(torch.equal(part, before[name]) for name, part in made.network.state_dict().items())


def test_a_loss_that_is_no_number_ends_the_training_with_a_letter():
    batch = rollout()
    batch.reward[0, 0] = np.nan
    with pytest.raises(DivergedError, match=r"After 1 minibatches .*Lower alphazero.learning_rate"):
        learner().update(batch)


def test_what_is_restored_goes_on_bit_for_bit():
    one, two = learner(batch_size=3), learner(seed=2, batch_size=3)
    one.update(rollout())
    two.load_state_dict(one.state_dict())
    assert one.update(rollout()) == two.update(rollout())
