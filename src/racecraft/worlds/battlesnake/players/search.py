"""Player 5: looks many moves ahead, as long as it is given time.

Against one other it looks for what it can be sure of (`alpha_beta_search.py`): deeper and deeper, with the other's best
reply to every move. Among several it grows a tree of what may happen (`mcts.py`), for nobody there plays against it
alone; moves of which alpha-beta can tell within a blink that somebody may end it there are not walked. Both may be
stopped at any time, and both keep from turn to turn what still holds (`sessions.py`).

A guide, another player, may say where to look first. In a duel its move is the one that alpha-beta looks at first, and
keeps where no other is better. In a tree it has more than its share of the first walks; a guide that weighs moves, such
as a trained policy, says so for every snake on the board, whose replies are then looked at as likely as it thinks them.
One that was trained among fewer snakes is not asked until so few are left.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial

import numpy as np

from racecraft.contract.world import Array
from racecraft.players.thread_pool import ThreadPool
from racecraft.worlds.battlesnake.env.board import MOVES, Board
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.alpha_beta_search import SearchResult
from racecraft.worlds.battlesnake.players.kernels.alpha_beta import DRAWN
from racecraft.worlds.battlesnake.players.mcts import Tree
from racecraft.worlds.battlesnake.players.network_tree import Network, NetworkTree
from racecraft.worlds.battlesnake.players.protocol import MovePrior, SnakePlayer
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move, find_snake, safe_moves
from racecraft.worlds.battlesnake.players.search_position import DEEPEST
from racecraft.worlds.battlesnake.players.sessions import Plant, SearchSession, SessionCache
from racecraft.worlds.battlesnake.players.weights import DEFAULT_WEIGHTS, Weights

SURE_AMONG = 2
"""Snakes alive up to which it looks for what it can be sure of."""
NEAR_TURNS = 3
"""Turns ahead within which a tree's moves must not lose, or end in a draw, against any play."""
NEAR_EFFORT = 3000
"""Turns played for that, for each move; a few milliseconds."""
SURE_EFFORT = 20_000
"""Turns played for each move of a duel to prove what it can, before a network is asked."""
NEAR_SHARE = 0.3
"""Share of the time that it may take."""


class Search:
    """Alpha-beta in duels, decoupled PUCT among more; area control where they stop. Anytime.

    Args:
        most_walks: Walks of the tree, or turns played by alpha-beta, after which it is sure enough; None: until the
            time is up. With a number and enough time its moves are the same every time, for it then keeps nothing
            from turn to turn.
        guide: A player that says where to look first.
        sure_among: Snakes alive up to which it looks for what it can be sure of; 0 never.
        ponders: Whether it thinks on while nobody asks it.
        cores: Cores that may think about one move, 1 or 2. A second one looks a turn deeper by alpha-beta, remembering
            in the same place, or grows a tree of its own whose visits count like the first one's.
        network: A policy with its critic, which is asked about the leaves of its trees; with one it always grows a
            tree, once it knows that nothing is certain.
        weights: What positions are appraised by, where no network is asked; None: what serves best, which is not the
            same in duels and in trees among more.
    """

    def __init__(
        self,
        most_walks: int | None = None,
        guide: SnakePlayer | None = None,
        sure_among: int = SURE_AMONG,
        ponders: bool = False,
        network: Network | None = None,
        cores: int = 1,
        weights: Weights | None = None,
    ) -> None:
        self.cores, self._helpers, self._is_free = cores, ThreadPool(), threading.Lock()
        self.most_walks, self.guide, self.network, self.weights = most_walks, guide, network, weights or DEFAULT_WEIGHTS
        self.sure_among = 0 if network is not None else sure_among
        self._plant: Plant = (
            partial(Tree, weights=weights) if network is None else partial(NetworkTree, network=network)
        )
        self.minds = SessionCache(ponders=ponders, plant=self._plant, weights=self.weights)

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the move that is surest, or was walked most, when the time is up."""
        until = time.monotonic() + seconds
        find_snake(board, snake_id)
        mine = safe_moves(board, settings, snake_id)
        if len(mine) < 2:
            return mine[0] if mine else best_safe_move(board, settings, snake_id)
        if self.most_walks is not None:
            return self._think(
                SearchSession(board, settings, snake_id, self._plant, self.weights), mine, seconds, until
            )
        mind, move = self.minds.recall(board, settings, snake_id), None
        try:
            move = self._think(mind, mine, seconds, until)
        finally:
            self.minds.keep(mind, move)
        return move

    def warm_up(self, board: Board, settings: GameSettings, snake_id: str) -> None:
        """Have everything compiled that a game may come to need."""
        mind = SearchSession(board, settings, snake_id, self._plant, self.weights)
        mind.certainty.deepen(0.0)
        mind.grown_tree().keep_below(0)
        mind.go_on(board, settings)

    def _think(self, mind: SearchSession, mine: list[str], seconds: float, until: float) -> str:
        if len(mind.board.alive()) <= self.sure_among:
            mind.tree = None
            if (first := self._guides_move(mind, mine, seconds)) is not None:
                mind.certainty.look_first_at(first)
            found = self._deepen(mind, until)
            if not found.loses or found.depth > NEAR_TURNS:
                return found.move
        return self._walk(mind, mine, seconds, until)

    def _walk(self, mind: SearchSession, mine: list[str], seconds: float, until: float) -> str:
        surest, dangers = self._prove(mind, mine, until - (1 - NEAR_SHARE) * seconds)
        if surest is not None:
            return surest
        tree = mind.grown_tree()
        self._ask_guide(tree, mind, seconds)
        tree.exclude_move(dangers)
        with self._second_core(lambda: self._begin_beside(mind, seconds, dangers)) as other:
            self._grow(tree, until)
        visits = tree.visits() + (other.tree.visits() if other is not None and other.tree is not None else 0)
        return MOVES[int(np.argmax(visits))]

    def _grow(self, tree: Tree, until: float) -> None:
        """Walk a tree until the time is up, or it was walked enough."""
        left = self.most_walks if self.most_walks is not None else 1 << 30
        while left > 0:
            walks = min(left, tree.walks_at_a_time)
            tree.simulate(walks)
            left -= walks
            if time.monotonic() >= until:
                break

    def _deepen(self, mind: SearchSession, until: float) -> SearchResult:
        """Look for what is sure, on as many cores as there may be; of two findings the deeper one counts."""

        def begin() -> SearchSession:
            mind.helper.tree = None
            return mind.helper

        with self._second_core(begin) as other:
            own = mind.certainty.deepen(until, self.most_walks)
        if other is None:
            return own
        its = other.certainty.found
        return its if its.wins or (its.depth > own.depth and not own.wins) else own

    def _begin_beside(self, mind: SearchSession, seconds: float, dangers: list[str]) -> SearchSession:
        """Return a second mind whose tree is ready to be walked."""
        other = mind.helper
        tree = other.grown_tree()
        self._ask_guide(tree, other, seconds)
        tree.exclude_move(dangers)
        return other

    @contextmanager
    def _second_core(self, begin: Callable[[], SearchSession]) -> Iterator[SearchSession | None]:
        """Let a second core think on until this block is left, a few milliseconds at a time.

        Yields:
            Whose thoughts they are, to be read behind the block; None where there is no second core, or it is busy with
            another game: nobody waits for it.
        """
        if self.cores < 2 or self.most_walks is not None or not self._is_free.acquire(blocking=False):
            yield None
            return
        try:
            other, done = begin(), threading.Event()

            def think() -> None:
                while not done.is_set() and other.ponder():
                    pass

            beside = self._helpers.submit(think)
            try:
                yield other
            finally:
                done.set()
                if not beside.cancel():  # one that has not begun by now never will
                    beside.result()
        finally:
            self._is_free.release()

    def _guides_move(self, mind: SearchSession, mine: list[str], seconds: float) -> str | None:
        """Return which of the moves that are not surely fatal the guide would make; None: it does not say."""
        said = self._guides_word(mind, seconds)
        if said is None or isinstance(said, str):
            return said if said in mine else None
        chances = said[[snake.id for snake in mind.board.alive()].index(mind.snake_id)]
        return max(mine, key=lambda move: chances[MOVES.index(move)])

    def _ask_guide(self, tree: Tree, mind: SearchSession, seconds: float) -> None:
        move = self._guides_word(mind, seconds)
        if isinstance(move, str):
            tree.boost_move(move)
        elif move is not None:
            tree.mix_priors(move)

    def _guides_word(self, mind: SearchSession, seconds: float) -> Array | str | None:
        """Return the priors of every living snake's moves, of a `MovePrior`, or one move of ours; or None."""
        guide = self.guide
        if isinstance(guide, MovePrior):
            return guide.move_priors(mind.board, mind.settings)
        if guide is not None:
            with suppress(TimeoutError):  # a user's file that is too slow is no help, and no harm
                return guide.choose(mind.board, mind.settings, mind.snake_id, seconds / 4)
        return None

    def _prove(self, mind: SearchSession, mine: list[str], until: float) -> tuple[str | None, list[str]]:
        """Return a move that wins against any play, if one is found, and those not to be walked.

        Not to be walked are moves after which the others may end the snake, or the game in a draw, within a few turns,
        whatever it does; in a duel with a network, where there is time to look further, those that are proven to lose.
        """
        deepest, effort = (NEAR_TURNS, NEAR_EFFORT)
        if self.network is not None and len(mind.board.alive()) <= SURE_AMONG:
            deepest, effort = DEEPEST - 1, SURE_EFFORT
        found: list[str] = []
        for number, move in enumerate(mine):
            now = time.monotonic()
            mind.certainty.narrow([move])
            finding = mind.certainty.deepen(
                now + (until - now) / (len(mine) - number), effort, 1 if now >= until else deepest
            )
            if finding.wins:
                return move, found
            if finding.loses or (finding.value <= DRAWN + mind.board.turn + NEAR_TURNS):
                found.append(move)
        return None, found
