"""One look of a small plain network: a frame in, the likeliest choice out. Begin with `argmax_action`.

A dense layer is a convolution over a map of one place, so that one loop serves both. Sums are taken in one order, so
that a look has the same bits whoever else looks, on any number of threads.
"""

import math

import numpy as np

from racecraft.kernels.compile import inner_kernel, lean_kernel

FIRST, HEIGHT, WIDTH, CHANNELS, KERNEL, STRIDE, FILTERS, BEND = range(8)
"""What a layer's row says: where its numbers begin, the map it reads, its kernel, what it writes, what is behind it."""
NO_BEND, RELU, TANH = range(3)


@lean_kernel
def argmax_action(layers, weights, scale, frame, room):
    """Return the number of the likeliest choice.

    Args:
        layers: int64 (L, 8), the columns above.
        weights: float32, each layer's biases (filters) and then its kernel (rows, columns * channels, filters).
        scale: What a grey level counts.
        frame: uint8 (H, W).
        room: float32 (3, W): two maps in turn, and the patch of one that a kernel covers.
    """
    height, width = frame.shape
    for y in range(height):
        line = room[0, y * width : (y + 1) * width]
        for x in range(width):
            line[x] = np.float32(frame[y, x]) * scale
    now = 0
    for number in range(layers.shape[0]):
        convolve(layers[number], weights, room[now], room[1 - now], room[2])
        now = 1 - now
    best = 0
    for choice in range(1, layers[-1, FILTERS]):
        if room[now, choice] > room[now, best]:
            best = choice
    return best


@inner_kernel
def convolve(layer, weights, seen, found, patch):
    """Read a map (height, width, channels), write one (height', width', filters)."""
    channels, filters, stride = layer[CHANNELS], layer[FILTERS], layer[STRIDE]
    line, span = layer[WIDTH] * channels, layer[KERNEL] * channels
    high, wide = (layer[HEIGHT] - layer[KERNEL]) // stride + 1, (layer[WIDTH] - layer[KERNEL]) // stride + 1
    bias = weights[layer[FIRST] : layer[FIRST] + filters]
    count, first = layer[KERNEL] * span, layer[FIRST] + filters
    for place in range(high * wide):
        corner = place // wide * stride * line + place % wide * stride * channels
        for row in range(layer[KERNEL]):
            for s in range(span):
                patch[row * span + s] = seen[corner + row * line + s]
        sums = found[place * filters : (place + 1) * filters]
        for f in range(filters):
            sums[f] = bias[f]
        add_up(patch[:count], weights[first : first + count * filters], sums)
        bend(sums, layer[BEND])


@inner_kernel
def add_up(seen, kernel, sums):
    """Add what S numbers give each of F filters, with kernel (S * F,); eight at once, so that sums are fetched less."""
    filters, whole = len(sums), len(seen) - len(seen) % 8
    for s in range(0, whole, 8):
        a, b, c, d = seen[s], seen[s + 1], seen[s + 2], seen[s + 3]
        e, g, h, i = seen[s + 4], seen[s + 5], seen[s + 6], seen[s + 7]
        k = kernel[s * filters : (s + 8) * filters]
        for f in range(filters):
            first = (a * k[f] + b * k[filters + f]) + (c * k[2 * filters + f] + d * k[3 * filters + f])
            last = (e * k[4 * filters + f] + g * k[5 * filters + f]) + (h * k[6 * filters + f] + i * k[7 * filters + f])
            sums[f] += first + last
    for s in range(whole, len(seen)):
        one = kernel[s * filters : (s + 1) * filters]
        for f in range(filters):
            sums[f] += seen[s] * one[f]


@inner_kernel
def bend(sums, kind):
    """Lay what is not linear behind a layer."""
    for f in range(len(sums)):
        if kind == RELU and sums[f] < np.float32(0.0):
            sums[f] = np.float32(0.0)
        elif kind == TANH:
            sums[f] = np.float32(math.tanh(sums[f]))
