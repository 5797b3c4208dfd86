"""How a snake looks to others: a colour as the official board reads it, `#rrggbb`."""

from __future__ import annotations

from racecraft.contract.errors import nearest
from racecraft.worlds.battlesnake.players.protocol import PlayerError

COLOURS = {
    "black": "#000000", "silver": "#c0c0c0", "gray": "#808080", "grey": "#808080", "white": "#ffffff",
    "maroon": "#800000", "red": "#ff0000", "purple": "#800080", "fuchsia": "#ff00ff", "magenta": "#ff00ff",
    "green": "#008000", "lime": "#00ff00", "olive": "#808000", "yellow": "#ffff00", "navy": "#000080",
    "blue": "#0000ff", "teal": "#008080", "aqua": "#00ffff", "cyan": "#00ffff", "orange": "#ffa500",
}  # fmt: skip
"""HTML's basic colour names; the official board knows only figures, so names are translated."""


def colour(text: str, where: str = "--color") -> str:
    """Return a colour as `#rrggbb`.

    Args:
        text: `#rrggbb`, `#rgb` or a name of `COLOURS`.
        where: What to call its source in the message.

    Raises:
        PlayerError: It is no colour.

    >>> colour("red"), colour("#F80")
    ('#ff0000', '#ff8800')
    """
    small = text.strip().lower()
    if small in COLOURS:
        return COLOURS[small]
    digits = small.removeprefix("#")
    if small.startswith("#") and len(digits) in (3, 6) and set(digits) <= set("0123456789abcdef"):
        return "#" + (digits if len(digits) == 6 else "".join(digit * 2 for digit in digits))
    hint = "" if small.startswith("#") else f" {nearest(small, COLOURS)}"
    raise PlayerError(
        "{where} is '{text}'; expected #rrggbb, such as #ff8800, or a basic colour's name.{hint}",
        where=where,
        text=text[:40],
        hint=hint,
    )
