"""The processor made ready for a training."""

import subprocess
import sys

import torch

from racecraft.training.processor import prepare_processor


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
