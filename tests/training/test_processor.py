"""The processor made ready for a training."""

import subprocess
import sys

import pytest
import torch

from racecraft.training.processor import keep_freed_memory, prepare_processor

PIECE = 48 << 20
"""Bytes of a layer; the GNU C library comes to keep smaller ones by itself after a while."""


@pytest.mark.skipif(sys.platform != "linux", reason="other systems' C libraries are left alone")
def test_what_a_layer_freed_is_not_asked_of_the_system_again():
    import resource

    def fill() -> None:
        torch.empty(PIECE, dtype=torch.uint8).fill_(1)

    keep_freed_memory()
    for _ in range(20):  # until the heap has grown as far as it will
        fill()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        fill()
    after = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    assert after - before < 4 * PIECE // 4096  # pages; without it 20 pieces' worth


def test_kernels_that_are_loaded_take_as_many_threads_as_were_asked_for():
    from racecraft.kernels import set_threads, threads

    set_threads(2)
    prepare_processor(1)
    assert (threads(), torch.get_num_threads()) == (1, 1)


def test_a_training_without_kernels_is_spared_their_compiler(tmp_path):
    words = ["gym", "train", "CartPole-v1", "--stop", "iterations=1", "--no-pictures", "--run", str(tmp_path / "run")]
    code = (
        f"import sys; sys.argv = ['racecraft', *{words}]\nfrom racecraft.cli.entry import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print('numba' in sys.modules, 'torch' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False True"
