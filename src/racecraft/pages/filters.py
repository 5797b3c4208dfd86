"""Numbers and times as a page writes them; filters of the templates. What is not known is "–"."""

from __future__ import annotations

import base64
import json
import math

from racecraft.contract.message import figure

UNKNOWN = "–"


def number(value: float | None, digits: int = 0, unit: str = "") -> str:
    """Return a number with its unit.

    >>> number(12345.678, 1), number(10.2, 2, "s"), number(None), number(float("nan"))
    ('12,345.7', '10.20 s', '–', '–')
    """
    if value is None or not math.isfinite(value):
        return UNKNOWN
    return f"{value:,.{digits}f} {unit}".rstrip()


def duration(seconds: float | None) -> str:
    """Return a time as a person says it.

    >>> duration(7.2), duration(95), duration(3.5 * 3600), duration(None)
    ('7.2 s', '1 min 35 s', '3 h 30 min', '–')
    """
    if seconds is None or not math.isfinite(seconds):
        return UNKNOWN
    if seconds < 60:
        return f"{seconds:.1f} s"
    if seconds < 3600:
        return f"{int(seconds // 60)} min {int(seconds % 60)} s"
    return f"{int(seconds // 3600)} h {int(seconds % 3600 // 60)} min"


def anchor(text: str) -> str:
    """Return a heading as the address of its section.

    >>> anchor("How it learned"), anchor("Reward, here")
    ('how-it-learned', 'reward-here')
    """
    return "-".join("".join(letter if letter.isalnum() else " " for letter in text.lower()).split()) or "section"


def notebook(command: str, python: str = "") -> str:
    r"""Return commands, and Python where there is some, as the address of a Jupyter notebook that can be saved.

    >>> json.loads(base64.b64decode(notebook("cd a\nracecraft train").partition(",")[2]))["cells"][0]["source"]
    '%%bash\ncd a\nracecraft train'
    """
    cells: list[dict[str, object]] = [
        {"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": [], "source": source}
        for source in (f"%%bash\n{command}", python.strip())
        if source
    ]
    text = json.dumps({"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 4})
    return "data:application/x-ipynb+json;base64," + base64.b64encode(text.encode()).decode()


WORDS = {"number": number, "figure": figure, "duration": duration, "anchor": anchor, "notebook": notebook}
