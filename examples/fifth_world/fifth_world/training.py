"""How the corridor is trained in: what a request adds, and the worlds that it asks for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from fifth_world.world import Corridor
from racecraft.training.plain import PlainTraining
from racecraft.training.request import TrainRequest


@dataclass(frozen=True, kw_only=True)
class CorridorRequest(TrainRequest):
    """What is asked of a training; the field is an option of the command, and a keyword of `rc.train`."""

    kind: ClassVar[str] = "corridor"
    length: int = 9
    """Cells."""


TRAINING = PlainTraining(CorridorRequest, lambda request, worlds: Corridor(worlds, request.length), threshold=0.96)
