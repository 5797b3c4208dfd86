"""A game of snakes as a moving picture: MP4 (H.264) or GIF, by the file's ending."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from racecraft.analysis.video import VideoError, encode_film
from racecraft.contract.world import Array
from racecraft.formats.atomic import atomic_file
from racecraft.worlds.battlesnake.analysis.board_frames import colours_of
from racecraft.worlds.battlesnake.analysis.board_picture import draw_position
from racecraft.worlds.battlesnake.env.board import Board
from racecraft.worlds.battlesnake.players.messages import GameCard

FILM_SIDE, GIF_SIDE = 704, 352
"""Pixels of the board's longer side, about."""
HELD_SECONDS = 2.0
"""How long the last position stays."""
FILM_RATE = 24
"""Pictures a second in an MP4, at least: some players stumble over slower ones."""


def film_game(boards: Sequence[Board], card: GameCard, path: str | Path, turns_a_second: float = 8) -> Path:
    """Write a game as a film that stays on its last position for a while; it arrives whole.

    Args:
        boards: Every position, from the first to the last.
        card: Names and looks.
        path: Ends in .mp4 or .gif.
        turns_a_second: Pace, 0.1 to 50.

    Raises:
        VideoError: Another ending, or no encoder for H.264 is installed.
        MissingExtraError: PyAV is not installed.
        OutputFileError: The place cannot be written.
    """
    path = check_film(path)
    write = _write_mp4 if path.suffix.lower() == ".mp4" else _write_gif
    write(boards, card, path, turns_a_second)
    return path


def check_film(path: str | Path) -> Path:
    """Return the path of a film that is yet to be made; raises VideoError where it ends neither in .mp4 nor in .gif."""
    path = Path(path)
    if path.suffix.lower() not in (".mp4", ".gif"):
        raise VideoError(
            "{path}: a game is filmed as MP4 or GIF; expected a name that ends in .mp4 or .gif.", path=path
        )
    return path


def _colours(boards: Sequence[Board], card: GameCard) -> dict[str, str]:
    return colours_of(list(dict.fromkeys(snake.id for board in boards for snake in board.snakes)), card)


def _write_mp4(boards: Sequence[Board], card: GameCard, path: Path, turns_a_second: float) -> None:
    held = max(1, round(FILM_RATE / turns_a_second))
    encode_film(path, _pictures(boards, card, held), round(turns_a_second * held, 3))


def _pictures(boards: Sequence[Board], card: GameCard, held: int) -> Iterator[Array]:
    """Yield every position as often as it stays, and the last one longer."""
    colours = _colours(boards, card)
    for number, board in enumerate(boards):
        picture = np.asarray(draw_position(board, card, colours, FILM_SIDE))
        last = number == len(boards) - 1
        for _ in range(held + round(HELD_SECONDS * FILM_RATE) * last):
            yield picture


def _write_gif(boards: Sequence[Board], card: GameCard, path: Path, turns_a_second: float) -> None:
    colours = _colours(boards, card)
    pictures = [draw_position(board, card, colours, GIF_SIDE) for board in boards]
    palette = _palette([pictures[0], pictures[len(pictures) // 2], pictures[-1]])
    frames = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    durations = [round(1000 / turns_a_second)] * (len(frames) - 1) + [round(1000 * HELD_SECONDS)]
    with atomic_file(path) as part:
        frames[0].save(part, format="GIF", save_all=True, append_images=frames[1:], duration=durations, loop=0)


def _palette(samples: Sequence[Image.Image]) -> Image.Image:
    """Return the 128 colours that tell these pictures best."""
    width, height = samples[0].size
    together = Image.new("RGB", (width, height * len(samples)))
    for number, sample in enumerate(samples):
        together.paste(sample, (0, height * number))
    return together.quantize(128)
