"""The toy worlds of `tests/contract/toy_world.py` are shared by several rooms' tests."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "contract"))

import pytest
import torch


@pytest.fixture(autouse=True)
def _one_thread():
    """Keep small networks on one thread: on a busy machine two wait for each other longer than they work."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture
def two_threads(_one_thread):
    """Two of PyTorch's threads, as whoever asks for them needs to be seen to share or to give back."""
    torch.set_num_threads(2)
