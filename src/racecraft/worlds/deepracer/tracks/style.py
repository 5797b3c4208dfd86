"""What a circuit looks like: plain colours and the measures of its painted lines.

Colours are the mean of the original's *textures* (RGB, 0 to 255); a renderer lights them (about 1.31 times, the sun's
blue damped; facts: simapp textures, camera images). The common theme below is that of most circuits.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

RGB = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class TrackStyle:
    """Colours and painted lines of a circuit. Colours are RGB 0-255 as textures, lengths metres."""

    road: RGB = (64, 63, 61)
    line: RGB = (223, 223, 222)
    """The two white border lines."""
    dash: RGB = (225, 143, 0)
    """The dashes along the centre line."""
    field: RGB = (126, 133, 65)
    """The ground around the road."""
    wall: RGB = (36, 70, 81)
    """The box around the field, and what is seen above the field where there is none."""
    start: RGB = (142, 142, 141)
    """The chequered start strip, as a mean."""
    line_width: float = 0.0762
    line_side: str = "inside"
    """Side of the border on which its line is painted: "inside" (on the road), "outside", or "none"."""
    dash_length: float = 0.0508
    """Length of a dash; 0 where the circuit has none."""
    dash_gap: float = 0.0508
    dash_width: float = 0.0254
    field_bounds: tuple[float, float, float, float] | None = None
    """The field's rectangle (x0, y0, x1, y1); None: the borders' bounds and a metre more."""
    wall_height: float = 0.0
    """Height of the wall at the field's edge; 0 where there is none."""
    start_strip: float = 0.0
    """Length of the chequered strip across the road near the start line; 0 where there is none."""
    start_strip_at: float = 0.0
    """Arc of the strip's middle, from the start line in the direction in which the circuit was laid out."""

    def to_record(self) -> dict[str, Any]:
        """Return what differs from the common theme, for a catalogue file."""
        plain = TrackStyle()
        return {
            field.name: getattr(self, field.name)
            for field in fields(self)
            if getattr(self, field.name) != getattr(plain, field.name)
        }

    @classmethod
    def from_record(cls, record: dict[str, Any]) -> TrackStyle:
        """Read what `to_record` wrote.

        >>> TrackStyle.from_record({"road": [36, 49, 64]}).road
        (36, 49, 64)
        """
        values: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in record.items()}
        return cls(**values)
