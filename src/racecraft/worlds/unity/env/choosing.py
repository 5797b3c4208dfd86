"""Which of a scene's behaviors are acted for. Teams of one behavior go together where they see and do the same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from racecraft.worlds.unity.env.behaviors import Behavior
from racecraft.worlds.unity.env.errors import BuildError


def single(wish: str | Sequence[str] | None) -> str | None:
    """Return the first of several wishes.

    >>> single(["Striker", "Goalie"]), single(None)
    ('Striker', None)
    """
    return wish if wish is None or isinstance(wish, str) else wish[0]


def choose_several(wish: str | Sequence[str] | None, known: Mapping[str, Behavior]) -> list[list[str]]:
    """Return the names, team by team, of each behavior wished for; without a wish that the scene knows, of all."""
    wishes = [wish] if isinstance(wish, str) else list(wish or ())
    bases = list(dict.fromkeys(behavior.base_name for behavior in known.values()))
    wished = [known[name].base_name if name in known else name for name in wishes]
    return [choose(base, known) for base in bases if base in wished or not set(wished) & set(bases)]


def choose(wish: str | None, known: Mapping[str, Behavior]) -> list[str]:
    """Return the behaviors to act for: those of one base name that see and do the same.

    Raises:
        BuildError: The scene has no such behavior, or several and none is wished for.
    """
    groups: dict[str, list[str]] = {}
    for name, behavior in known.items():
        groups.setdefault(behavior.base_name, []).append(name)
    if wish in known:
        return [str(wish)]
    if wish is None and len(groups) == 1:
        wish = next(iter(groups))
    if wish not in groups:
        reason = "no behavior is chosen" if wish is None else f"no behavior is named '{wish}'"
        raise BuildError(
            "{told}; the scene has {known}. Choose one with behavior= (--behavior at the command line), or "
            "act for all of them through racecraft.worlds.unity.env.parallel.",
            told=reason,
            known=", ".join(known),
        )
    first, *others = groups[wish]
    for other in others:
        if (known[other].sensors, known[other].actions) != (known[first].sensors, known[first].actions):
            raise BuildError(
                "the teams {first} and {other} see or do different things; choose one with behavior=.",
                first=first,
                other=other,
            )
    return groups[wish]
