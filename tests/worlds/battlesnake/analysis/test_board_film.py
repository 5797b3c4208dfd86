"""Games of snakes as pictures, films and text."""

from collections import Counter

import pytest
from PIL import Image, ImageColor

from racecraft.analysis.video import VideoError
from racecraft.worlds.battlesnake.analysis.board_film import film_game
from racecraft.worlds.battlesnake.analysis.board_frames import colours_of, title_of
from racecraft.worlds.battlesnake.analysis.board_picture import EVEN, as_text, draw_board, draw_position
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.players.messages import GameCard

CARD = GameCard("g", names={"s0": "Flo", "s1": "Sam"})
COLOURS = colours_of(["s0", "s1"], CARD)


def boards(width=7, height=5, turns=4):
    found = []
    for turn in range(turns):
        flo, sam = Snake("s0", [(1 + turn, 1), (turn, 1)]), Snake("s1", [(5, 3), (5, 4)])
        if turn == turns - 1:
            sam.cause, sam.on = "out-of-health", turn
        found.append(Board(width, height, turn, [flo, sam], [(3, 3)], Counter({(0, 4): 1})))
    return found


def pixel(image, board, point, square):
    return image.getpixel((round((point[0] + 0.5) * square), round((board.height - 0.5 - point[1]) * square)))


def test_a_square_has_the_colour_of_what_lies_there():
    board = boards()[1]
    image = draw_board(board, COLOURS, 21)
    assert image.size == (7 * 21, 5 * 21)
    assert pixel(image, board, (1, 1), 21) == ImageColor.getrgb(COLOURS["s0"])
    assert pixel(image, board, (5, 4), 21) == ImageColor.getrgb(COLOURS["s1"])
    assert pixel(image, board, (3, 3), 21) == ImageColor.getrgb("#e5383b")
    assert pixel(image, board, (6, 0), 21) == ImageColor.getrgb(EVEN)
    assert pixel(image, board, (0, 4), 21) != ImageColor.getrgb(EVEN), "a hazard"
    between = image.getpixel((round(2 * 21), round(3.5 * 21)))
    assert between == ImageColor.getrgb(COLOURS["s0"]), "segments hang together"


def test_the_dead_are_seen_once_and_then_no_more():
    board = boards()[-1]
    assert pixel(draw_board(board, COLOURS, 21), board, (5, 4), 21) != ImageColor.getrgb(COLOURS["s1"])
    board.turn += 1
    assert pixel(draw_board(board, COLOURS, 21), board, (5, 4), 21) == ImageColor.getrgb(
        EVEN if 9 % 2 == 0 else "#f0f3f5"
    )


def test_over_joined_edges_a_body_leaves_and_comes_in():
    board = Board(7, 7, 1, [Snake("s0", [(0, 3), (6, 3)])])
    image = draw_board(board, COLOURS, 21)
    own = ImageColor.getrgb(COLOURS["s0"])
    assert image.getpixel((0, round(3.5 * 21))) == own
    assert image.getpixel((7 * 21 - 1, round(3.5 * 21))) == own
    assert pixel(image, board, (3, 3), 21) != own, "not across the board"


@pytest.mark.parametrize("size", [(3, 3), (7, 7), (19, 21), (25, 25)])
def test_positions_have_even_sides_and_any_name(size):
    board = boards(*size)[0] if size != (3, 3) else Board(3, 3, 0, [Snake("s0", [(1, 1)])])
    card = GameCard("g", names={"s0": "a very long name that does not fit " * 5, "s1": "\x00\u202e漢字"})
    image = draw_position(board, card, COLOURS, 352)
    assert image.width % 2 == image.height % 2 == 0


def test_a_game_is_filmed_as_h264_that_browsers_play(tmp_path):
    import av

    path = film_game(boards(), CARD, tmp_path / "game.mp4", turns_a_second=8)
    assert path.read_bytes().index(b"moov") < path.read_bytes().index(b"mdat"), "the index stands in front"
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        pictures = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
        assert stream.average_rate == 24
    assert len(pictures) == 4 * 3 + 48, "three pictures a turn at 24 a second, two seconds at the end"
    assert (pictures[0] == pictures[2]).mean() > 0.97
    assert abs(pictures[0].astype(int) - pictures[3]).max() > 100, "Flo moved"


def test_a_game_is_drawn_as_a_gif(tmp_path):
    path = film_game(boards(), CARD, tmp_path / "game.gif", turns_a_second=4)
    with Image.open(path) as picture:
        assert (picture.format, picture.n_frames, picture.info["duration"]) == ("GIF", 4, 250)


def test_other_endings_are_refused_before_anything_is_drawn(tmp_path):
    with pytest.raises(VideoError, match=r"game.avi.*\.mp4 or \.gif"):
        film_game([], CARD, tmp_path / "game.avi")


def test_a_position_is_told_in_the_terminal_with_colours_or_letters():
    told = as_text(boards()[-1], CARD)
    assert "turn 3" in told.plain
    assert "out-of-health on 3" in told.plain
    assert any(COLOURS["s0"] in str(span.style) for span in told.spans)
    plain = as_text(boards()[1], CARD, colour=False)
    assert plain.spans == []
    assert ".aA...." in plain.plain
    assert "A Flo" in plain.plain


def test_colours_and_titles_of_strangers():
    card = GameCard(
        "g", names={str(n): f"n{n}" for n in range(6)}, appearances={"0": {"color": 5}, "1": {"color": "#ABC"}}
    )
    found = colours_of(list(card.names), card)
    assert found["1"] == "#aabbcc"
    assert len(set(found.values())) == 6
    assert title_of(card) == "n0 – n1 – n2 – 3 more"
