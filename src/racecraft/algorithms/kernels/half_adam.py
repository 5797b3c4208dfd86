"""Adam for weights that are learned by copies of half the precision. Begin with `step_weights`.

A network of millions of weights is stepped as fast as the memory gives them. PyTorch's way is four passes: the copies'
gradients to float32, the moments, the weights, the weights to bfloat16. Here all of it is one pass.
"""

import math

import numpy as np

from racecraft.kernels.compile import kernel, parallel_kernel, prange

BLOCK = 4096
"""So many weights a thread takes at a time."""


@parallel_kernel
def step_weights(weights, halves, gradients, means, squares, beta_1, beta_2, root_scale, epsilon, step_size):
    """Take a step of Adam with W weights.

    Args:
        weights: float32 (W,), stepped.
        halves: uint16 (W,), the bits of the same in bfloat16, written anew.
        gradients: uint16 (W,), the bits of bfloat16 numbers.
        means: float32 (W,), the running mean of the gradient, carried on.
        squares: float32 (W,), that of its square.
        beta_1: What stays of the one.
        beta_2: What stays of the other.
        root_scale: 1 / sqrt(1 - beta_2 ** t) at step t.
        epsilon: Added to the root.
        step_size: learning rate / (1 - beta_1 ** t).
    """
    for block in prange(-(-len(weights) // BLOCK)):
        part = slice(block * BLOCK, (block + 1) * BLOCK)
        step_block(
            weights[part], halves[part], gradients[part], means[part], squares[part],
            beta_1, beta_2, root_scale, epsilon, step_size,
        )  # fmt: skip


@kernel
def step_block(weights, halves, gradients, means, squares, beta_1, beta_2, root_scale, epsilon, step_size):
    """As `step_weights`, in the thread that calls: each weight is fetched once, stepped and laid back.

    Another thread may do the same meanwhile with weights of its own.
    """
    one = np.float32(1.0)
    for at in range(len(weights)):
        gradient = np.uint32(np.uint32(gradients[at]) << np.uint32(16)).view(np.float32)
        mean = means[at] + (gradient - means[at]) * (one - beta_1)
        square = squares[at] * beta_2 + gradient * gradient * (one - beta_2)
        weight = weights[at] - step_size * mean / (math.sqrt(square) * root_scale + epsilon)
        means[at], squares[at], weights[at] = mean, square, weight
        # The nearest bfloat16; of two as near, the even one.
        bits = np.float32(weight).view(np.uint32)
        halves[at] = (bits + np.uint32(0x7FFF) + ((bits >> np.uint32(16)) & np.uint32(1))) >> np.uint32(16)
