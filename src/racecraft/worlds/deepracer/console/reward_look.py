"""What a reward function pays for, looked at as one types it: faults in their lines, tricks, pay over the road.

Begin with `look_at_reward`, which the console calls in its helper process.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from functools import lru_cache
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import RewardError, RewardFileError
from racecraft.formats.run_folder import REWARD_FUNCTION
from racecraft.worlds.deepracer.analysis.reward_page import map_data, reward_data
from racecraft.worlds.deepracer.driving.reward.check import RewardCheck, check_reward
from racecraft.worlds.deepracer.driving.reward.findings import FAULT
from racecraft.worlds.deepracer.driving.reward.pay_map import PayMap, pay_map
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.env.reward_process import open_reward
from racecraft.worlds.deepracer.files.reward_source import RewardSource, read_reward_source, source_of
from racecraft.worlds.deepracer.tracks.catalogue import known_name, load_track

SPEEDS_MPS = (1.0, 2.0, 3.0, 4.0)
HEADINGS_DEG = (-30, -15, 0, 15, 30)
"""Between the car and the road, left positive."""
PAY = "pay"
DEFAULT_TRACK = "reinvent_base"


def look_at_reward(text: str, folder: str, track: str, query: Mapping[str, str]) -> dict[str, Any]:
    """Return what `reward_look.html` shows.

    Args:
        text: The function; "": that of the folder.
        folder: Where the modules beside it are; "": there are none.
        track: Of the map.
        query: `speed` (m/s), `heading` (degrees) and `term` of the map, as an address has them.
    """
    speed = _one_of(query.get("speed", ""), SPEEDS_MPS, 2.0)
    heading = _one_of(query.get("heading", ""), HEADINGS_DEG, 0)
    chosen = {
        "speed": f"{speed:g}", "speeds": [(f"{one:g}", f"{one:g} m/s") for one in SPEEDS_MPS],
        "heading": f"{heading:g}",
        "headings": [(f"{one:g}", f"{one:+g}°" if one else "along the road") for one in HEADINGS_DEG],
        "term": PAY, "terms": [(PAY, PAY)],
    }  # fmt: skip
    try:
        source = (
            read_reward_source(Path(folder) / REWARD_FUNCTION) if not text else source_of(REWARD_FUNCTION, text, {})
        )
        found = _checked(source.text, source)
        mapped = _mapped(source, track, speed, heading, query.get("term", PAY)) if found.lowest is not None else None
    except (RewardFileError, RewardError) as error:
        line = getattr(error, "line", None)
        return {"told": None, "fault": str(error), "remarks": [_remark(line, True, str(error))], **chosen}
    if mapped is not None:
        chosen |= {"term": mapped.what, "terms": [(one, one) for one in (PAY, *_terms(source.text))]}
    return {
        "told": reward_data(found) | {"map": None if mapped is None else map_data(mapped)},
        "fault": "",
        "remarks": [_remark(one.line, one.level == FAULT, f"{one.text}. {one.hint}".strip()) for one in found.findings],
        **chosen,
    }


_LAST: dict[str, RewardCheck] = {}


def _checked(key: str, source: RewardSource) -> RewardCheck:
    """Return the check of a text; the last one is kept, so that another map of it costs a map alone."""
    if key not in _LAST:
        found = check_reward(source)
        _LAST.clear()
        _LAST[key] = found
    return _LAST[key]


def _mapped(source: RewardSource, track: str, speed: float, heading: float, term: str) -> PayMap:
    process = open_reward(source, output=StringIO())
    try:
        circuit = _track(track if known_name(track) else DEFAULT_TRACK)
        shown = term if term in _terms(source.text) else None
        return pay_map(Payer(process), circuit, speed, float(np.radians(heading)), term=shown)
    finally:
        process.close()


def _terms(text: str) -> list[str]:
    """Return the names that the function gives values to; not each of them holds a number."""
    found = {
        node.id
        for function in ast.walk(ast.parse(text.removeprefix("\ufeff")))
        if isinstance(function, ast.FunctionDef)
        for node in ast.walk(function)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    return sorted(found)


@lru_cache(maxsize=4)
def _track(name: str) -> Any:
    return load_track(name)


def _remark(line: int | None, bad: bool, text: str) -> dict[str, Any]:
    return {"line": line, "bad": bad, "text": text}


def _one_of(text: str, values: tuple[float, ...] | tuple[int, ...], default: float) -> float:
    """Return the value that an address names, or the default."""
    return next((one for one in values if f"{one:g}" == text), default)
