"""What is done in no time is done by one thread."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.networks import Architecture, Encoder, NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.algorithms.torch_threads import LIGHT, single_threaded
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec


@torch.no_grad()
def test_a_light_look_takes_one_thread_and_gives_the_others_back(two_threads):
    with single_threaded(2, LIGHT // 2):
        assert torch.get_num_threads() == 1
    assert torch.get_num_threads() == 2
    with pytest.raises(ZeroDivisionError), single_threaded(1, 1):
        1 / 0  # noqa: B018
    assert torch.get_num_threads() == 2


def test_a_heavy_look_and_a_gradient_take_all_threads(two_threads):
    with torch.no_grad(), single_threaded(2, LIGHT // 2 + 1):
        assert torch.get_num_threads() == 2
    with single_threaded(1, 1):
        assert torch.get_num_threads() == 2


def test_an_encoder_looks_lightly_at_few_rows(two_threads, monkeypatch):
    body = Encoder({"seen": ArraySpec((4,), np.float32)}, Architecture(), torch.Generator().manual_seed(1))
    seen = []
    monkeypatch.setattr(body.trunk, "forward", lambda rows: seen.append(torch.get_num_threads()) or rows)
    with torch.no_grad():
        body({"seen": torch.zeros(3, 4)})
        body({"seen": torch.zeros(3000, 4)})
    body({"seen": torch.zeros(3, 4)})
    assert seen == [1, 2, 2]


def test_who_decides_for_few_rows_decides_lightly(two_threads, monkeypatch):
    world = WorldSpec("toy", 4, 1, {"seen": ArraySpec((2,), np.float32)}, DiscreteActions(3))
    learner = PpoLearner(world, NetworkConfig(), PpoConfig(), seed=1)
    seen = []
    for one in (learner.distribution, learner.policy.distribution):
        monkeypatch.setattr(one, "to_actions", lambda raw: seen.append(torch.get_num_threads()) or raw)
    for rows in (3, 100_000):
        for act in (learner.act, learner.policy.act):
            act({"seen": np.zeros((rows, 2), np.float32)})
    assert seen == [1, 1, 2, 2]
