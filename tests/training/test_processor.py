"""The processor made ready for a training."""

import sys

import pytest
import torch

from racecraft.training.processor import keep_freed_memory

PIECE = 4 << 20
"""Bytes of a layer of the default car's minibatch."""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems' C libraries are left alone")
def test_what_a_layer_freed_is_not_asked_of_the_system_again():
    import resource

    def fill() -> None:
        torch.empty(PIECE, dtype=torch.uint8).fill_(1)

    keep_freed_memory()
    fill()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        fill()
    after = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    assert after - before < 4 * PIECE // 4096  # pages; without it 9,000
