"""A game to look at: a position in the terminal, a whole game as a GIF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image, ImageColor, ImageDraw

from racecraft.envs.battlesnake.board import Board
from racecraft.evaluation.arena.match import Played
from racecraft.formats.whole import whole_file
from racecraft.players.snakes.messages import LOOKS, GameCard

if TYPE_CHECKING:
    from rich.text import Text

COLOURS = ("#2a9d8f", "#e76f51", "#7b2cbf", "#e9c46a", "#277da1", "#d62828", "#90be6d", "#6d597a")
"""Colours of snakes that did not choose one, in seat order."""
GROUND, GRID, FOOD, HAZARD = "#ffffff", "#e6e6ea", "#d90429", "#8d99ae"
SQUARE_PIXELS = 20


def colours_of(ids: Sequence[str], card: GameCard) -> dict[str, str]:
    """Return a colour (#rrggbb) for every snake: its own, or one of ours where it has the default or none we can read.

    >>> colours_of(["a"], GameCard("g", looks={"a": {"color": "no colour"}}))
    {'a': '#2a9d8f'}
    """
    found = {}
    for number, one in enumerate(ids):
        colour = card.looks.get(one, {}).get("color", LOOKS["color"])
        try:
            plain = "#{:02x}{:02x}{:02x}".format(*ImageColor.getrgb(colour)[:3])
        except (ValueError, AttributeError):
            plain = LOOKS["color"]
        found[one] = COLOURS[number % len(COLOURS)] if plain == LOOKS["color"] else plain
    return found


def as_text(board: Board, card: GameCard) -> Text:
    """Return a position for the terminal: two columns a square, heads as `()`, and a line for every snake."""
    from rich.text import Text

    colours = colours_of([snake.id for snake in board.snakes], card)
    squares = {point: ("::", "bright_black") for point, count in board.hazards.items() if count > 0}
    squares |= {point: ("<>", f"bold {FOOD}") for point in board.food}
    for snake in board.alive():
        squares |= {point: ("  ", f"on {colours[snake.id]}") for point in snake.body}
        squares[snake.head] = ("()", f"bold white on {colours[snake.id]}")
    text = Text(f"turn {board.turn}\n")
    for y in reversed(range(board.height)):
        for x in range(board.width):
            text.append(*squares.get((x, y), (" .", "bright_black")))
        text.append("\n")
    for snake in board.snakes:
        state = f"health {snake.health:3d}, length {len(snake.body)}" if snake.alive else f"{snake.cause} on {snake.on}"
        text.append(f"{card.names.get(snake.id, snake.id):20.20} ", colours[snake.id])
        text.append(f"{state}\n")
    return text


def draw_board(board: Board, colours: dict[str, str], square: int = SQUARE_PIXELS) -> Image.Image:
    """Return a picture of a position, RGB, `square` pixels a square."""
    image = Image.new("RGB", (board.width * square + 1, board.height * square + 1), GROUND)
    pen = ImageDraw.Draw(image)

    def box(x: int, y: int, inset: int) -> tuple[int, int, int, int]:
        top = (board.height - 1 - y) * square
        return x * square + inset, top + inset, (x + 1) * square - inset, top + square - inset

    for x, y in board.squares():
        pen.rectangle(box(x, y, 0), fill=HAZARD if board.hazards.get((x, y)) else GROUND, outline=GRID)
    for x, y in board.food:
        pen.ellipse(box(x, y, square // 4), fill=FOOD)
    for snake in board.alive():
        colour = colours[snake.id]
        for a, b in zip(snake.body, snake.body[1:], strict=False):
            if abs(a[0] - b[0]) + abs(a[1] - b[1]) <= 1:
                ends = (*box(*a, 3), *box(*b, 3))
                pen.rectangle((min(ends[0::2]), min(ends[1::2]), max(ends[0::2]), max(ends[1::2])), fill=colour)
        for x, y in snake.body:
            if board.holds((x, y)):
                pen.rectangle(box(x, y, 3), fill=colour)
        if board.holds(snake.head):
            pen.ellipse(box(*snake.head, square // 3), fill=GROUND)
    return image


def write_gif(played: Played, path: str | Path, frames_per_second: float = 8) -> None:
    """Write a game as a GIF that stays on its last position for a while."""
    ids = list(dict.fromkeys(snake.id for board in played.boards for snake in board.snakes))
    colours = colours_of(ids, played.card)
    frames = [draw_board(board, colours).quantize(32) for board in played.boards]
    durations = [round(1000 / frames_per_second)] * (len(frames) - 1) + [2000]
    with whole_file(path) as part:
        frames[0].save(part, format="GIF", save_all=True, append_images=frames[1:], duration=durations, loop=0)
