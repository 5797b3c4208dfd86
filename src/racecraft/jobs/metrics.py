"""Figures read out of a job's log, as series: what SageMaker's metric definitions are for. Begin with `read_metrics`.

The log is read when somebody asks, so a definition may be mended afterwards; `log_times.txt` says when a line was said.
"""

from __future__ import annotations

import bisect
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.errors import SettingError


@dataclass(frozen=True)
class MetricPoint:
    """One figure of one metric."""

    name: str
    time: float
    """When it was said, seconds since 1970; to within a second or so."""
    value: float


def check_definitions(definitions: Sequence[Mapping[str, str]]) -> tuple[dict[str, str], ...]:
    """Return metric definitions as they were given.

    Raises:
        SettingError: One is no {"Name", "Regex"}, or its expression is none, or takes no figure.

    >>> check_definitions([{"Name": "reward", "Regex": "reward=([0-9.]+)"}])
    ({'Name': 'reward', 'Regex': 'reward=([0-9.]+)'},)
    """
    checked = []
    for one in definitions:
        if not isinstance(one, Mapping) or set(one) != {"Name", "Regex"}:
            raise SettingError("metric_definitions: {one!r}; expected {{'Name': …, 'Regex': …}}.", one=one)
        try:
            groups = re.compile(one["Regex"]).groups
        except re.error as error:
            raise SettingError(
                "metric_definitions: the Regex of {one!r} is none ({error}); expected a regular expression.",
                one=one["Name"],
                error=error,
            ) from None
        if groups < 1:
            raise SettingError(
                "metric_definitions: the Regex of {one!r} has no group; expected the figure in brackets, such "
                "as 'reward=([0-9.]+)'.",
                one=one["Name"],
            )
        checked.append({"Name": str(one["Name"]), "Regex": str(one["Regex"])})
    return tuple(checked)


def read_metrics(log: Path, times: Path, definitions: Sequence[Mapping[str, str]]) -> list[MetricPoint]:
    """Return what a log says of each metric, in the order in which it was said.

    Args:
        log: What was said; it need not exist yet.
        times: Lines of "seconds bytes"; the same.
        definitions: {"Name", "Regex"}; the first group is the figure. What is no number is passed over.
    """
    if not log.exists():
        return []
    whens, sizes = _times(times)
    patterns = [(one["Name"], re.compile(one["Regex"])) for one in definitions]
    points, end = [], 0
    for line in log.read_bytes().splitlines(keepends=True):
        end += len(line)
        text = line.decode("utf-8", "replace")
        for name, pattern in patterns:
            for match in pattern.finditer(text):
                value = _number(match[1])
                if value is not None:
                    points.append(MetricPoint(name, _when(whens, sizes, end, log), value))
    return points


def _times(path: Path) -> tuple[list[float], list[int]]:
    if not path.exists():
        return [], []
    rows = [line.split() for line in path.read_text(encoding="ascii").splitlines()]
    return [float(row[0]) for row in rows if len(row) == 2], [int(row[1]) for row in rows if len(row) == 2]


def _when(whens: Sequence[float], sizes: Sequence[int], end: int, log: Path) -> float:
    at = bisect.bisect_left(sizes, end)
    return whens[at] if at < len(whens) else log.stat().st_mtime


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if math.isfinite(value) else None
