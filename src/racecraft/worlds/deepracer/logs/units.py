"""AWS's units to ours, for the columns of a trace that have others: degrees to radians, percent to a share."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import polars as pl


OURS = {"yaw": (math.pi / 180.0, 1.0), "steer": (math.pi / 180.0, 1.0), "progress": (1.0, 100.0)}
"""AWS's name of a column → what its values are multiplied with, then divided by, to make ours of them."""


def in_our_units(trace: pl.DataFrame) -> pl.DataFrame:
    """Return a trace, its columns under AWS's names, with all values in SI units, radians and shares.

    By NumPy here too: Polars multiplies by 0.01 where one divides by 100, and 8.1818 % would be 0.08181800000000002.
    """
    import polars as pl

    units = {name: numbers for name, numbers in OURS.items() if name in trace.columns}
    return trace.with_columns(
        pl.Series(name, trace[name].to_numpy() * factor / divisor) for name, (factor, divisor) in units.items()
    )
