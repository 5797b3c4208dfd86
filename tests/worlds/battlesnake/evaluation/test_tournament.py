"""Who meets whom in which seats, with which dice, and what is counted of each game; games of one or two turns."""

from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.seats import Seat
from racecraft.worlds.battlesnake.evaluation.standings import GameResult
from racecraft.worlds.battlesnake.evaluation.tournament import Tournament

SMALL = GameSettings(7, 7, 2)


class Fails:
    """Has a move every so many times it is asked."""

    def __init__(self, every=1):
        self.every, self.asked = every, 0

    def choose(self, board, settings, snake_id, seconds):
        self.asked += 1
        if self.asked % self.every:
            raise ValueError("no move")
        return "up"


def seats_of(*every):
    return [Seat(f"player {number}", Fails(one)) for number, one in enumerate(every)]


def test_every_group_meets_in_every_rotation_with_the_same_dice_round_after_round():
    held = Tournament(seats_of(1, 1, 1), SMALL, rounds=2, seed=3, most_turns=1)
    assert held.planned == 12
    games = list(held.play())
    meetings = [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)]
    assert [game.players for game, _ in games] == meetings * 2
    assert [game.number for game, _ in games] == [*range(1, 13)]
    assert [played.card.id for _, played in games] == [f"game-{number}" for number in range(1, 13)]
    starts = [str([snake.body for snake in played.boards[0].snakes] + played.boards[0].food) for _, played in games]
    assert starts[::2] == starts[1::2], "both rotations begin alike"
    assert len(set(starts)) > 3, "and each meeting with dice of its own"
    assert all(game.turns == played.turns == 1 for game, played in games)
    assert [game for game, _ in games] == held.games
    fewer = Tournament(seats_of(1, 1, 1), SMALL, seed=3, most_turns=1)
    assert [game for game, _ in fewer.play()] == held.games[:6], "more rounds begin with the games of fewer"
    other = Tournament(seats_of(1, 1, 1), SMALL, seed=4, most_turns=1)
    assert next(other.play())[1].boards[0] != games[0][1].boards[0]


def test_three_at_a_board_sit_in_three_rotations():
    held = Tournament(seats_of(1, 1, 1, 1), GameSettings(11, 11, 3), most_turns=1)
    assert held.planned == 12
    assert [game.players for game, _ in held.play()][:4] == [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 1, 3)]


def test_failures_are_counted_in_the_game_in_which_they_happen():
    seats = seats_of(2, 1)
    seats[0].failures.crashes, seats[0].failures.timeouts = 7, 9
    seats[1].failures.note_late(0, "before")
    held = Tournament(seats, SMALL, most_turns=2)
    first, second = (game for game, _ in held.play())
    assert (first.crashes, first.timeouts) == ((1, 0), (0, 0))
    assert (second.players, second.crashes, second.timeouts) == ((1, 0), (0, 1), (0, 0))
    assert [line.crashes for line in held.table().standings if line.name == "player 0"] == [2]


def test_games_that_were_played_are_not_played_again_nor_more_than_there_are():
    old = [GameResult(number, (0, 1), (0, 1), 5, (0, 0), (0, 0)) for number in range(1, 6)]
    held = Tournament(seats_of(1, 1), SMALL, played=iter(old[:1]), most_turns=1)
    assert [game.number for game, _ in held.play()] == [2]
    assert held.games[0] is old[0]
    full = Tournament(seats_of(1, 1), SMALL, played=old)
    assert (full.games, list(full.play())) == (old[:2], [])
    assert full.table().games_planned == 2
