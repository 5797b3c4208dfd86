"""An arena at play: draw who meets, seat them, let them play, keep the game; as long as one likes. See `Arena`.

Everything it knows lies in its store, game by game, so it may be stopped or killed at any time and goes on where it
was; a meeting of which only some games were played is played to its end first.
"""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Any

from racecraft.contract.errors import UserInputError
from racecraft.contract.random_streams import stream_keys
from racecraft.league.pairing import next_group
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.evaluation.match import Played, play
from racecraft.worlds.battlesnake.evaluation.record import record_text
from racecraft.worlds.battlesnake.evaluation.remote import Remote
from racecraft.worlds.battlesnake.evaluation.seats import SETUP_SECONDS, Seat, take_seat
from racecraft.worlds.battlesnake.league.entry import require_same
from racecraft.worlds.battlesnake.league.ladder import Ladder
from racecraft.worlds.battlesnake.league.store import ArenaStore
from racecraft.worlds.battlesnake.league.terms import ArenaError, ArenaGame, Entrant, Meeting
from racecraft.worlds.battlesnake.players.protocol import PlayerError

SEATS_KEPT = 16
"""Players kept ready between meetings; of a FILE.py that is a process each."""
FIRST_PAUSE_SECONDS, LONGEST_PAUSE_SECONDS = 5.0, 300.0
"""How long a player that cannot play is left alone before it is asked again; twice as long each time."""


class Arena:
    """Plays meetings in a store.

    Args:
        store: Where everything lies.
        memory_mb: Memory that a FILE.py may use.
        on_message: Called with a sentence: why somebody cannot play.
    """

    def __init__(self, store: ArenaStore, memory_mb: int = 2048, on_message: Callable[[str], None] = print) -> None:
        self.store, self._memory_mb, self._on_message = store, memory_mb, on_message
        self.ladder = Ladder(store.terms.snakes)
        self._seats: OrderedDict[int, Seat] = OrderedDict()
        self._pauses: dict[int, tuple[float, float]] = {}
        self._left_out: set[int] = set()

    def play(self) -> Generator[tuple[ArenaGame, Played], None, None]:
        """Play game after game, each kept before it is told; closing the iterator is how it ends.

        Raises:
            ArenaError: Somebody plays here already, or there are too few who can.
        """
        with self.store.lock():
            try:
                while True:
                    yield from self._play_meeting(*self._next_meeting())
            finally:
                self.leave()

    def leave(self) -> None:
        """Let go of all players."""
        while self._seats:
            self._seats.popitem()[1].leave()

    def _next_meeting(self) -> tuple[Meeting, int]:
        """Return who meets, and how many games they had: the last meeting while it goes on, or a new one."""
        while True:
            self.ladder.count(self.store.games(self.ladder.last_game))
            entrants = self.store.entrants()
            able = [one.number for one in entrants if not one.rests and self._is_able(one)]
            last = self.store.last_meeting()
            if last is not None and last[1] < len(last[0].players) and set(last[0].players) <= set(able):
                return last
            sizes = [size for size in self.store.terms.snakes if size <= len(able)]
            if sizes:
                return self._draw(entrants, able, min(sizes, key=self.ladder.games)), 0
            self._wait_for_more(entrants, able)

    def _draw(self, entrants: Sequence[Entrant], able: Sequence[int], size: int) -> Meeting:
        strengths, covariance = self.ladder.strengths(entrants, size)
        return self.store.draw(next_group(strengths, covariance, self.ladder.met(entrants, size), able, size))

    def _wait_for_more(self, entrants: Sequence[Entrant], able: Sequence[int]) -> None:
        """Wait for a server that may come back; where none is missing, say that there are too few."""
        if not self._pauses:
            raise ArenaError(
                "{path}: {count} of {count_2} players can play, and "
                "{snakes} sit at a board; expected as many. `racecraft snakes arena add` lets "
                "more in.",
                path=self.store.path,
                count=len(able),
                count_2=len(entrants),
                snakes=min(self.store.terms.snakes),
            )
        time.sleep(max(0.0, min(until for until, _ in self._pauses.values()) - time.monotonic()))

    def _play_meeting(self, meeting: Meeting, played: int) -> Iterator[tuple[ArenaGame, Played]]:
        """Play what is left of a meeting; it ends early where somebody cannot go on."""
        entrants = {one.number: one for one in self.store.entrants()}
        if not all([self._takes_seat(entrants[one]) for one in meeting.players]):
            return
        for rotation in range(played, len(meeting.players)):
            result, game = self._play_game(meeting, rotation)
            gone = [
                one for one, bad in zip(result.players, result.crashes, strict=True) if bad and not self._answers(one)
            ]
            for one in gone:
                self._pause(entrants[one], "its server went away; the game does not count")
            if gone:
                return
            kept = self.store.keep(result, record_text(game))
            self.ladder.count([kept])
            yield kept, game
        while len(self._seats) > SEATS_KEPT:
            self._seats.popitem(last=False)[1].leave()

    def _play_game(self, meeting: Meeting, rotation: int) -> tuple[ArenaGame, Played]:
        terms, group = self.store.terms, meeting.seated(rotation)
        seats = [self._seats[one] for one in group]
        before = [(seat.failures.timeouts, seat.failures.crashes) for seat in seats]
        key = int(stream_keys(terms.seed, f"snake arena, meeting {meeting.number}", 1)[0])
        game = play(
            terms.game(len(group)), seats, StreamDice(key), f"arena-{meeting.number}-{rotation + 1}",
            terms.timeout_ms, most_turns=terms.most_turns,
        )  # fmt: skip
        late = tuple(seat.failures.timeouts - was for seat, (was, _) in zip(seats, before, strict=True))
        failed = tuple(seat.failures.crashes - was for seat, (_, was) in zip(seats, before, strict=True))
        places = tuple(game.places())
        return ArenaGame(0, group, places, game.turns, late, failed, meeting.number, rotation, time.time()), game

    def _is_able(self, entrant: Entrant) -> bool:
        """Tell whether a player can play now: it is still the same, and its server, if it has one, is there."""
        if self._pauses.get(entrant.number, (0.0, 0.0))[0] > time.monotonic():
            return False
        try:
            require_same(entrant)
        except UserInputError as problem:
            self._leave_out(entrant, str(problem))
            return False
        self._left_out.discard(entrant.number)
        if entrant.number in self._seats and not self._answers(entrant.number):
            self._pause(entrant, f"{entrant.source} does not answer")
            return False
        return True

    def _takes_seat(self, entrant: Entrant) -> bool:
        """Have a player ready; tell whether it is."""
        if entrant.number not in self._seats:
            seed = self.store.terms.seed + entrant.number
            try:
                seat = take_seat(entrant.source, entrant.name, seed, self._memory_mb)
            except UserInputError as problem:
                self._pause(entrant, str(problem))
                return False
            self._seats[entrant.number] = seat
        self._pauses.pop(entrant.number, None)
        self._seats.move_to_end(entrant.number)
        return True

    def _answers(self, number: int) -> bool:
        """Tell whether a seated player is there: what is no server always is."""
        player: Any = self._seats[number].player
        if not isinstance(player, Remote):
            return True
        try:
            player.appearance(SETUP_SECONDS)
        except PlayerError:
            return False
        return True

    def _pause(self, entrant: Entrant, why: str) -> None:
        """Leave a player alone for a while, twice as long each time."""
        seconds = min(LONGEST_PAUSE_SECONDS, 2 * self._pauses.get(entrant.number, (0.0, FIRST_PAUSE_SECONDS / 2))[1])
        self._pauses[entrant.number] = time.monotonic() + seconds, seconds
        self._on_message(f"{entrant.name} sits out for {seconds:g} s: {why}")
        self._leave_seat(entrant)

    def _leave_out(self, entrant: Entrant, why: str) -> None:
        """Leave a player out until it is what it was; say so once."""
        if entrant.number not in self._left_out:
            self._on_message(f"{entrant.name} is left out: {why}")
        self._left_out.add(entrant.number)
        self._leave_seat(entrant)

    def _leave_seat(self, entrant: Entrant) -> None:
        if entrant.number in self._seats:
            self._seats.pop(entrant.number).leave()
