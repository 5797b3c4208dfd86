"""Adam for weights that are learned by copies of half the precision. Begin with `step_weights`.

A network of millions of weights is stepped as fast as the memory gives them. PyTorch's way is four passes: the copies'
gradients to float32, the moments, the weights, the weights to bfloat16. Here all of a block happens while it is near.
"""

import math

import numpy as np

from racecraft.kernels.compile import kernel, parallel_kernel, prange

BLOCK = 4096
"""So many weights with their moments, gradients and copies stay in a core's nearest memory."""


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
        carry_on(gradients[part], means[part], squares[part], beta_1, beta_2)
        move(weights[part], means[part], squares[part], root_scale, epsilon, step_size)
        round_off(weights[part], halves[part])


@kernel
def carry_on(gradients, means, squares, beta_1, beta_2):
    """Take a gradient into the running means."""
    for at in range(len(gradients)):
        gradient = np.uint32(np.uint32(gradients[at]) << np.uint32(16)).view(np.float32)
        means[at] += (gradient - means[at]) * (np.float32(1.0) - beta_1)
        squares[at] = squares[at] * beta_2 + gradient * gradient * (np.float32(1.0) - beta_2)


@kernel
def move(weights, means, squares, root_scale, epsilon, step_size):
    """Step along the means."""
    for at in range(len(weights)):
        weights[at] -= step_size * means[at] / (math.sqrt(squares[at]) * root_scale + epsilon)


@kernel
def round_off(weights, halves):
    """Write the nearest bfloat16 of each weight, of two as near the even one."""
    for at in range(len(weights)):
        bits = np.float32(weights[at]).view(np.uint32)
        halves[at] = (bits + np.uint32(0x7FFF) + ((bits >> np.uint32(16)) & np.uint32(1))) >> np.uint32(16)
