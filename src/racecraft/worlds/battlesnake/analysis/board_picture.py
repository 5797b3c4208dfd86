"""A position of snakes as a picture, and as text for the terminal: the same look as the page's (`board_page.py`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from PIL import Image, ImageDraw, ImageFont

from racecraft.worlds.battlesnake.analysis.board_frames import colours_of
from racecraft.worlds.battlesnake.env.board import Board, Point, Snake, draw
from racecraft.worlds.battlesnake.players.messages import GameCard

if TYPE_CHECKING:
    from rich.text import Text

EVEN, ODD, LINE, FOOD, HAZARD = "#fafbfc", "#f0f3f5", "#dfe3e6", "#e5383b", "#8d99a4"
PAPER, INK, QUIET, SLOT = "#ffffff", "#1d2327", "#5c6770", "#e4e9ec"
GOOD, WARN, BAD = "#2a9d62", "#d98a00", "#d62839"
FINER = 2
"""Pictures are drawn so many times larger and then made small, for smooth edges."""


def as_text(board: Board, card: GameCard, colour: bool = True) -> Text:
    """Return a position for the terminal, with a line for every snake.

    With colour: two columns a square, heads as `()`. Without: letters, capital heads, as `board.draw`.
    """
    from rich.text import Text

    colours = colours_of([snake.id for snake in board.snakes], card)
    text = Text(f"turn {board.turn}\n")
    text.append_text(_coloured(board, colours) if colour else Text(draw(board) + "\n"))
    for number, snake in enumerate(board.snakes):
        state = f"health {snake.health:3d}, length {len(snake.body)}" if snake.alive else f"{snake.cause} on {snake.on}"
        letter = "" if colour else f"{chr(ord('A') + number % 26)} "
        text.append(f"{letter}{card.names.get(snake.id, snake.id):20.20} ", colours[snake.id] if colour else "")
        text.append(f"{state}\n")
    return text


def _coloured(board: Board, colours: dict[str, str]) -> Text:
    from rich.text import Text

    squares = {point: ("::", "bright_black") for point, count in board.hazards.items() if count > 0}
    squares |= {point: ("<>", f"bold {FOOD}") for point in board.food}
    for snake in board.alive():
        squares |= {point: ("  ", f"on {colours[snake.id]}") for point in snake.body}
        squares[snake.head] = ("()", f"bold white on {colours[snake.id]}")
    text = Text()
    for y in reversed(range(board.height)):
        for x in range(board.width):
            text.append(*squares.get((x, y), (" .", "bright_black")))
        text.append("\n")
    return text


def draw_board(board: Board, colours: dict[str, str], square: int) -> Image.Image:
    """Return a picture of the squares and who lies on them, RGB, `square` pixels a square."""
    s = square * FINER
    image = Image.new("RGB", (board.width * s, board.height * s), EVEN)
    pen = ImageDraw.Draw(image)
    for x, y in board.squares():
        left, top = x * s, (board.height - 1 - y) * s
        stacked = board.hazards.get((x, y), 0)
        pen.rectangle((left, top, left + s - 1, top + s - 1), fill=_ground(x, y, stacked))
    for point in board.food:
        _disc(pen, _middle(point, board, s), 0.27 * s, FOOD)
    for snake in board.snakes:
        if snake.alive or snake.on == board.turn:
            _draw_snake(pen, snake, board, s, colours[snake.id])
    return image.resize((board.width * square, board.height * square), Image.Resampling.BOX)


def draw_position(board: Board, card: GameCard, colours: dict[str, str], side: int) -> Image.Image:
    """Return the board with its table to the right: names, lengths, health; even sides, as films want them.

    Args:
        board: The position.
        card: Names.
        colours: #rrggbb by id.
        side: Pixels of the longer side of the board, about; the table takes another 240.
    """
    square = max(8, side // max(board.width, board.height))
    picture = draw_board(board, colours, square)
    margin, panel = 16, 240
    height = max(picture.height, 34 + 46 * len(board.snakes)) + 2 * margin
    width = picture.width + panel + 3 * margin
    image = Image.new("RGB", (width + width % 2, height + height % 2), PAPER)
    image.paste(picture, (margin, margin))
    pen = ImageDraw.Draw(image)
    pen.rectangle((margin - 1, margin - 1, margin + picture.width, margin + picture.height), outline=LINE)
    _draw_table(pen, board, card, colours, picture.width + 2 * margin, margin, panel)
    return image


def _draw_table(
    pen: ImageDraw.ImageDraw, board: Board, card: GameCard, colours: dict[str, str], left: int, top: int, width: int
) -> None:
    bold, plain = ImageFont.load_default(17), ImageFont.load_default(14)
    pen.text((left, top), f"turn {board.turn}", fill=INK, font=bold)
    for number, snake in enumerate(board.snakes):
        y = top + 34 + 46 * number
        name = _shortened(pen, card.names.get(snake.id, snake.id), plain, width - 60)
        pen.rounded_rectangle((left, y + 2, left + 13, y + 15), 4, fill=colours[snake.id])
        pen.text((left + 22, y), name, fill=INK if snake.alive else QUIET, font=plain)
        if not snake.alive:
            pen.text(
                (left + 22, y + 19), f"{snake.cause}, turn {snake.on}", fill=QUIET, font=ImageFont.load_default(13)
            )
            continue
        pen.text((left + width, y), str(len(snake.body)), fill=QUIET, font=plain, anchor="ra")
        full = width - 22
        hue = GOOD if snake.health > 50 else WARN if snake.health > 20 else BAD
        pen.rounded_rectangle((left + 22, y + 23, left + width, y + 30), 3, fill=SLOT)
        pen.rounded_rectangle((left + 22, y + 23, left + 22 + full * snake.health / 100, y + 30), 3, fill=hue)


def _shortened(
    pen: ImageDraw.ImageDraw, text: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: int
) -> str:
    text = "".join(letter if letter.isprintable() else "?" for letter in text)[:60]
    if pen.textlength(text, font) <= width:
        return text
    while text and pen.textlength(text + "…", font) > width:
        text = text[:-1]
    return text + "…"


def _draw_snake(pen: ImageDraw.ImageDraw, snake: Snake, board: Board, s: int, colour: str) -> None:
    shade = colour if snake.alive else _mixed(colour, EVEN, 0.55)
    half = round(0.36 * s)
    for a, b in zip(snake.body, snake.body[1:], strict=False):
        for part in _parts(a, b):
            (x, y), (to_x, to_y) = (_middle(point, board, s) for point in part)
            across, along = half * (x == to_x), half * (y == to_y)
            pen.rectangle(
                (min(x, to_x) - across, min(y, to_y) - along, max(x, to_x) + across, max(y, to_y) + along), fill=shade
            )
    for point in snake.body:
        _disc(pen, _middle(point, board, s), half, shade)
    (x, y), (fx, fy) = _middle(snake.head, board, s), _facing(snake)
    for side in (-1, 1):
        eye = x + (0.1 * fx + 0.17 * fy * side) * s, y + (-0.1 * fy + 0.17 * fx * side) * s
        _disc(pen, eye, 0.115 * s, "#ffffff")
        if snake.alive:
            _disc(pen, (eye[0] + 0.035 * fx * s, eye[1] - 0.035 * fy * s), 0.06 * s, "#111111")


def _parts(a: Point, b: Point) -> Sequence[tuple[Point, Point]]:
    """Return the strokes between two segments: over joined edges one leaves and one comes in."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    if abs(dx) + abs(dy) <= 1:
        return ((a, b),)
    step = (-1 if dx > 0 else 1, 0) if abs(dx) > 1 else (0, -1 if dy > 0 else 1)
    return ((a, (a[0] + step[0], a[1] + step[1])), ((b[0] - step[0], b[1] - step[1]), b))


def _facing(snake: Snake) -> Point:
    for point in snake.body[1:]:
        dx, dy = snake.head[0] - point[0], snake.head[1] - point[1]
        if abs(dx) + abs(dy) == 1:
            return dx, dy
    return 0, 1


def _middle(point: Point, board: Board, s: int) -> tuple[float, float]:
    return (point[0] + 0.5) * s, (board.height - 0.5 - point[1]) * s


def _disc(pen: ImageDraw.ImageDraw, middle: tuple[float, float], radius: float, colour: str) -> None:
    x, y = middle
    pen.ellipse((x - radius, y - radius, x + radius, y + radius), fill=colour)


def _ground(x: int, y: int, stacked: int) -> str:
    plain = ODD if (x + y) % 2 else EVEN
    return _mixed(plain, HAZARD, min(0.85, 0.28 + 0.14 * stacked)) if stacked > 0 else plain


def _mixed(a: str, b: str, share: float) -> str:
    """Return a colour on the way from one (#rrggbb) to another."""
    pairs = ((int(a[n : n + 2], 16), int(b[n : n + 2], 16)) for n in (1, 3, 5))
    return "#" + "".join(f"{round(x + (y - x) * share):02x}" for x, y in pairs)
