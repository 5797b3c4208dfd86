"""Checks of lesson 8, what the network sees: they read what one decided at whole, covered and mirrored pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from racecraft.lessons.checking import Answer, AnswerError, Verdict, material, passed, predicted, tried

Patch = tuple[int, int, int, int]
"""Top, left, height, width, in squares of the picture."""
UNDECIDED, CLOSE = 1.0, 5.0
"""Points between the two likeliest actions below which a step counts as undecided, or as close."""
MOST, LEFT = 7, 90
"""Squares that a patch may cover, 15 % of a picture; from how many per cent on a picture counts as a left bend."""
HOT = (2, 2)
"""Height and width of the patch that is put over the hottest place."""


@cache
def patches(rows: int, columns: int) -> tuple[Patch, ...]:
    """Return every rectangle of squares; modules/sight.js has the same order.

    >>> patches(1, 2)
    ((0, 0, 1, 1), (0, 0, 1, 2), (0, 1, 1, 1))
    """
    return tuple(
        (top, left, height, width)
        for top in range(rows)
        for left in range(columns)
        for height in range(1, rows - top + 1)
        for width in range(1, columns - left + 1)
    )


@cache
def facts() -> Mapping[str, Any]:
    """Return which recorded pictures the texts speak of, by their number, and what is to be seen there."""
    seen = material(__package__, "sight.json")
    pictures = dict(enumerate(seen["pictures"], 1))
    left = [number for number, one in pictures.items() if _sides(seen["actions"], one["shares"])[0] >= LEFT]
    changing = {number: _smallest_change(seen, one) for number, one in pictures.items()}
    bend = max((number for number in left if _size(changing[number]) <= MOST), key=lambda one: _size(changing[one]))
    turned = {number: _sides(seen["actions"], one["mirrored"]) for number, one in pictures.items()}
    spot = next(number for number, one in pictures.items()
                if _size(changing[number]) == 1 and len(set(_hottest_covered(seen, one)[2:])) == 1)  # fmt: skip
    undecided = [step for step, (*_, one, other) in enumerate(seen["steps"], 1) if one - other < UNDECIDED]
    return {
        "bend": bend, "bend_patch": _written(changing[bend]), "bend_squares": _size(changing[bend]),
        "spot": spot, "spot_patch": _written(changing[spot]), "undecided_steps": ", ".join(map(str, undecided)),
        "mirror": max(left, key=lambda number: turned[number][0]),
        "turned": ", ".join(str(number) for number in left if turned[number][1] > turned[number][0]),
    }  # fmt: skip


def _smallest_change(seen: Mapping[str, Any], picture: Mapping[str, Any]) -> Patch:
    """Return the smallest patch behind which another action is chosen."""
    every = patches(seen["rows"], seen["columns"])
    return min((one for one in every if _behind(seen, picture, one) != _whole(picture)), key=_size)


def _size(patch: Patch) -> int:
    return patch[2] * patch[3]


def _written(patch: Patch) -> str:
    top, left, height, width = patch
    return f"row {top + 1}, column {left + 1}: {height} high, {width} wide"


def patch_changes(answer: Answer) -> Verdict:
    """A small patch on one picture after which the network chooses another action."""
    seen = material(__package__, "sight.json")
    number, patch = _covered(answer.taken("patch"), seen)
    asked = facts()["bend"]
    if number != asked:
        return tried("other_picture", picture=number, asked=asked)
    picture = seen["pictures"][number - 1]
    before, after = _whole(picture), _behind(seen, picture, patch)
    squares = _size(patch)
    told = {"before": seen["actions"][before], "after": seen["actions"][after], "squares": squares, "most": MOST}
    if before == after:
        return tried("same", **told, share=picture["share"][_place(seen, patch)])
    if squares > MOST:
        return tried("too_large", **told)
    return passed(**told, heat=_heat(seen, picture, patch))


def undecided(answer: Answer) -> Verdict:
    """A step of the lap at which the two likeliest actions are nearly as likely."""
    seen = material(__package__, "sight.json")
    step = round(answer.number("step"))
    best, second, share, other = seen["steps"][step - 1]
    gap = share - other
    told = {"step": step, "gap": gap, "share": share, "other": other,
            "best": seen["actions"][best], "second": seen["actions"][second]}  # fmt: skip
    if gap < UNDECIDED:
        return passed(**told)
    return tried("close" if gap < CLOSE else "sure", **told)


def hottest(answer: Answer) -> Verdict:
    """A prediction: at how many pictures does a patch over the hottest place change the choice?"""
    seen = material(__package__, "sight.json")
    rows = [_hottest_covered(seen, picture) for picture in seen["pictures"]]
    count = sum(row[2] != row[3] for row in rows)
    return predicted(answer, "reason", "still_enough", rows, count=count, all=len(rows))


def mirrored(answer: Answer) -> Verdict:
    """A prediction: where does the network steer if a picture is mirrored?"""
    seen = material(__package__, "sight.json")
    rows = [
        [
            picture["step"],
            *(side for shares in ("shares", "mirrored") for side in _sides(seen["actions"], picture[shares])),
        ]
        for picture in seen["pictures"]
    ]
    return predicted(answer, "reason", "never_driven", rows)


def _covered(told: Any, seen: Mapping[str, Any]) -> tuple[int, Patch]:
    """Return the number of a picture and the patch on it, as the figure gives them."""
    number: Any
    patch: Any
    number, patch = (told.get("picture"), told.get("patch")) if isinstance(told, dict) else (None, None)
    if (
        not isinstance(number, int)
        or number not in range(1, len(seen["pictures"]) + 1)
        or not isinstance(patch, list)
        or not all(isinstance(one, int) for one in patch)
        or tuple(patch) not in patches(seen["rows"], seen["columns"])
    ):
        raise AnswerError("The figure's patch cannot be read; load the page again.")
    top, left, height, width = patch
    return number, (top, left, height, width)


def _place(seen: Mapping[str, Any], patch: Patch) -> int:
    return patches(seen["rows"], seen["columns"]).index(patch)


def _whole(picture: Mapping[str, Any]) -> int:
    """Return the action that is chosen at the whole picture."""
    shares: list[float] = picture["shares"]
    return shares.index(max(shares))


def _behind(seen: Mapping[str, Any], picture: Mapping[str, Any], patch: Patch) -> int:
    """Return the action that is chosen with a patch on the picture."""
    return int(picture["covered"][_place(seen, patch)])


def _heat(seen: Mapping[str, Any], picture: Mapping[str, Any], patch: Patch) -> float:
    """Return the share of the picture's heat under a patch, per cent."""
    top, left, height, width = patch
    squares = [
        row * seen["columns"] + column for row in range(top, top + height) for column in range(left, left + width)
    ]
    return float(sum(picture["heat"][square] for square in squares))


def _hottest_covered(seen: Mapping[str, Any], picture: Mapping[str, Any]) -> list[Any]:
    """Return step, heat under the hottest patch, and what is chosen without and with it."""
    patch = max((one for one in patches(seen["rows"], seen["columns"]) if one[2:] == HOT),
                key=lambda one: _heat(seen, picture, one))  # fmt: skip
    chosen = [seen["actions"][one] for one in (_whole(picture), _behind(seen, picture, patch))]
    return [picture["step"], round(_heat(seen, picture, patch), 1), *chosen]


def _sides(actions: Sequence[str], shares: Sequence[float]) -> list[float]:
    """Return the probability of steering left and of steering right, per cent."""
    return [round(sum(share for action, share in zip(actions, shares, strict=True) if action.startswith(side)))
            for side in ("left", "right")]  # fmt: skip
