"""Two learnings side by side: the same bits as one after the other, errors that go on, threads given back."""

import threading
from dataclasses import replace

import numpy as np
import pytest
import torch

from racecraft.algorithms import ppo as ppo_page
from racecraft.algorithms import ppo_steps
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.parallel_updates import run_in_parallel
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec

SPEC = WorldSpec("toy", 4, 1, {"camera": ArraySpec((12, 16), np.uint8)}, DiscreteActions(3))
NETWORK = NetworkConfig(
    conv_filters=(4, 8), conv_kernels=(4, 2), conv_strides=(2, 1), hidden_units=(16,), separate_networks=True,
    privileged_critic=False, initialisation="glorot",
)  # fmt: skip
APART = {"max_grad_norm": None, "standardise": "rollout", "batch_size": 16, "epochs": 2, "value_weight": 0.7}


def a_learner(monkeypatch, worth=0, **settings):
    monkeypatch.setattr(ppo_steps, "WORTH_A_THREAD", worth)
    monkeypatch.setattr(ppo_page, "ROWS_AT_ONCE", 8)
    return PpoLearner(SPEC, NETWORK, PpoConfig(**{**APART, **settings}), seed=3)


def experience_of(learner, ticks=13, rows=4):
    rng = np.random.default_rng(0)
    seen = rng.integers(0, 256, (ticks, rows, 12, 16), np.uint8)
    decided = learner.act({"camera": seen.reshape(-1, 12, 16)}, generator=torch.Generator().manual_seed(0))
    return RolloutBatch(
        observations={"camera": seen},
        actions=decided.actions.reshape(ticks, rows),
        reward=rng.normal(size=(ticks, rows)).astype(np.float32),
        terminated=rng.random((ticks, rows)) < 0.1,
        truncated=np.zeros((ticks, rows), bool),
        active=rng.random((ticks, rows)) < 0.9,
        last_observations={"camera": seen[0]},
        last_active=np.ones(rows, bool),
        columns={name: part.reshape(ticks, rows) for name, part in decided.columns.items()},
    )


@pytest.mark.parametrize("precision", ["float32", "bfloat16"])
def test_policy_and_critic_learn_apart_what_they_learn_together(monkeypatch, two_threads, precision):
    """By twin, bit for bit: the losses of two that share no weights pull at none in common."""
    torch.set_num_threads(1)
    together = a_learner(monkeypatch, worth=10**12, precision=precision)
    assert not together.steps.learns_apart
    kept = experience_of(together)
    wanted = [together.update(kept) for _ in range(2)]
    for threads in (1, 2):
        torch.set_num_threads(threads)
        apart = a_learner(monkeypatch, precision=precision)
        assert apart.steps.learns_apart
        for figures in wanted:
            assert apart.update(kept) == pytest.approx(figures, rel=1e-5, abs=1e-7)
        assert torch.get_num_threads() == threads
        for group, tensors in together.state_dict().items():
            for name, tensor in tensors.items():
                assert torch.equal(apart.state_dict()[group][name], tensor), (group, name, threads)


@pytest.mark.parametrize(
    ("settings", "network"),
    [
        ({"max_grad_norm": 0.5}, NETWORK),
        ({"centred_pixels": True}, NETWORK),
        ({}, NetworkConfig(hidden_units=(16,), conv_filters=(4,), conv_kernels=(4,), conv_strides=(2,))),
        ({}, replace(NETWORK, memory="gru", memory_units=4)),
    ],
)
def test_what_has_to_do_with_each_other_learns_together(monkeypatch, settings, network):
    """A norm over both weights, steps over centred pixels, layers or a memory that both stand on."""
    monkeypatch.setattr(ppo_steps, "WORTH_A_THREAD", 0)
    assert not PpoLearner(SPEC, network, PpoConfig(**{**APART, **settings}), seed=3).steps.learns_apart


def test_only_what_is_worth_a_thread_has_one(monkeypatch):
    """Rows of a minibatch times weights: 16 of them here, more than so many."""
    weights = sum(part.numel() for part in a_learner(monkeypatch).network.parameters())
    assert not a_learner(monkeypatch, worth=16 * weights).steps.learns_apart
    assert a_learner(monkeypatch, worth=16 * weights - 1).steps.learns_apart


def test_with_one_thread_both_go_on_in_the_one_that_calls(two_threads):
    def steps():
        yield threading.get_ident(), torch.get_num_threads()

    torch.set_num_threads(1)
    here = [(threading.get_ident(), 1)]
    assert run_in_parallel(steps(), steps()) == (here, here)
    torch.set_num_threads(2)
    mine, theirs = run_in_parallel(steps(), steps())
    assert mine == here
    assert theirs != here
    assert theirs[0][1] == 1


def test_both_go_on_at_the_same_time_each_with_its_share_of_the_threads(two_threads):
    meeting = threading.Barrier(2, timeout=60)

    def steps(name):
        for number in range(3):
            meeting.wait()
            yield name, number, torch.get_num_threads()

    torch.set_num_threads(3)
    mine, theirs = run_in_parallel(steps("mine"), steps("theirs"))
    assert mine == [("mine", number, 2) for number in range(3)]
    assert theirs == [("theirs", number, 1) for number in range(3)]
    assert torch.get_num_threads() == 3


@pytest.mark.parametrize("who", ["mine", "theirs"])
def test_where_one_fails_the_other_is_left_and_the_error_is_told(two_threads, who):
    failed, made = threading.Event(), []

    def failing():
        yield 1
        failed.set()
        raise ValueError("no number")

    def endless():
        failed.wait(60)
        while len(made) < 10**6:
            made.append(1)
            yield 1

    both = {"mine": (failing(), endless()), "theirs": (endless(), failing())}[who]
    with pytest.raises(ValueError, match="no number"):
        run_in_parallel(*both)
    assert len(made) < 10**6
    assert torch.get_num_threads() == 2
