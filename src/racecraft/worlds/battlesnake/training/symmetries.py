"""The seven ways to turn and mirror a board under which snakes fare alike: every position learned is eight."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import torch
from torch import Tensor

from racecraft.algorithms.alphazero import SEARCHED, Symmetry

UP, DOWN, LEFT, RIGHT = range(4)
QUARTER = (LEFT, RIGHT, DOWN, UP)
"""Where each move points after a quarter turn to the left."""
MIRRORED = (UP, DOWN, RIGHT, LEFT)


def turned(rows: Mapping[str, Tensor], quarters: int, mirrored: bool) -> dict[str, Tensor]:
    """Return named rows of a snake's learning as they would be on a board mirrored left to right, then turned left.

    `planes` (B, 8, V, V) are turned; `outlook` (B, 4, 10), `action_mask` (B, 4) and what was searched (B, 4) belong to
    moves, which point elsewhere then; all else stays.
    """
    pointing = list(range(4))
    for _ in range(mirrored):
        pointing = [MIRRORED[way] for way in pointing]
    for _ in range(quarters):
        pointing = [QUARTER[way] for way in pointing]
    origin = torch.tensor([pointing.index(way) for way in range(4)])
    found = dict(rows)
    planes = rows["planes"].flip(3) if mirrored else rows["planes"]
    found["planes"] = torch.rot90(planes, quarters, (2, 3)).contiguous()
    for name in ("outlook", "action_mask", SEARCHED):
        if name in rows:
            found[name] = rows[name][:, origin.to(rows[name].device)]
    return found


SYMMETRIES: tuple[Symmetry, ...] = tuple(
    partial(turned, quarters=quarters, mirrored=mirrored)
    for quarters in range(4)
    for mirrored in (False, True)
    if quarters or mirrored
)
"""All of them, the board as it is left out."""
