"""The toy worlds of `tests/contract/toy_world.py` are shared by several rooms' tests."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1] / "contract"))

import pytest
import torch


@pytest.fixture
def two_threads():
    """Two of PyTorch's threads, as whoever asks for them needs to be seen to share or to give back."""
    torch.set_num_threads(2)
