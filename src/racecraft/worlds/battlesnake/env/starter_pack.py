"""The AWS starter pack's gym: its rules, observations, rewards and options, quirks included.

For who repeats its experiments or ports its agents. It is not the official game (facts: B.1): reversing kills as a
"forbidden move", hunger is looked at before eating, heads that swap squares fight by length, equal heads leave the
food, starts are random squares, one food at the start, then 15 percent a turn (also onto a food, which then is one)
and no minimum; a meal shows in the length one turn later. `starter_pack_rules.py` tells how snakes move and meet; it is
held equal to the original turn by turn. Rows count downward: action 0 "up" is row - 1.

Observations are (rows, columns, 1 + snakes): food 1 in channel 0, then a channel for each snake; uint8 where flat,
float64 with a border, as the pack has it.

    flat-51s       head 5, body 1                       flat-num       tail 1, upward to the head
    bordered-51s   with a ring of -1 about the board    bordered-num
    max-bordered-51s, max-bordered-num                  21 - rows squares of -1 on both axes: 21 x 21 for a square board

`row_order`: "down" as the pack shows it (row 0 on top, action "up" lowers the row); "up" turns observations over, so
that row index equals the official y (row 0 at the bottom).

Mean length of an episode of 5 snakes, measured in the original (facts: D.3) and here (1,500 games on 7 x 7, 300 to
600 on 11 x 11, 150 to 600 on 15 x 15):

    board     uniform random     no reverse       random among free squares
    7 x 7     3.5  here 3.4      6.0  here 5.8    38.8  here 43.2 (the original, 250 games more: 41.0 ± 1.8)
    11 x 11   4.4  here 4.3      12.4 here 12.5   102   here 105
    15 x 15   4.8  here 4.9      21.3 here 21.7   165   here 153

This class follows the pack's Gym surface of its time: `reset() -> (state, {}, dones, info)`, `step(actions) -> (state,
rewards, dones, info)`, all dictionaries by snake number, `dones` True for the dead, `won` and `died` paid when a game
of several has at most one snake left. A game of one snake is never over and never pays them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from racecraft.contract.errors import nearest
from racecraft.contract.random_streams import generator
from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.starter_pack_rules import (
    DEAD,
    FATAL,
    FORBIDDEN,
    FREE,
    REWARD_OF,
    STARVED,
    Snake,
    Square,
    facing_of,
    outcome,
)

OBSERVATION_TYPES = (
    "flat-51s", "flat-num", "bordered-51s", "bordered-num", "max-bordered-51s", "max-bordered-num",
)  # fmt: skip
LARGEST_BOARD = 21
FOOD_CHANCE = 0.15


@runtime_checkable
class RewardScheme(Protocol):
    """Whoever prices what happens to a snake: the pack's own surface for rewards of one's own."""

    def get_reward(self, name: str, snake_id: int, episode: Any) -> float:
        """Return the price of one of the twelve keys of `Rewards` for a snake.

        `episode` is what the caller handed to `step` as `episodes`; None where it handed nothing.
        """
        ...


@dataclass(frozen=True)
class Rewards:
    """The twelve reward keys, with the defaults in force since May 2020."""

    another_turn: float = 1.0
    ate_food: float = 0.0
    won: float = 0.0
    died: float = 0.0
    ate_another_snake: float = 0.0
    hit_wall: float = 0.0
    hit_other_snake: float = 0.0
    hit_self: float = 0.0
    was_eaten: float = 0.0
    other_snake_hit_body: float = 0.0
    forbidden_move: float = 0.0
    starved: float = 0.0

    @classmethod
    def named(cls, values: Mapping[str, float]) -> Rewards:
        """Return rewards with some keys changed; an unknown key is refused with the nearest known one."""
        known = asdict(cls())
        for name in values:
            if name not in known:
                raise BoardError("There is no reward '{name}'. {hint}", name=name, hint=nearest(name, known))
        return cls(**{**known, **values})

    def get_reward(self, name: str, snake_id: int, episode: Any) -> float:
        """Return a key's price, the same for every snake and episode."""
        price: float = getattr(self, name)
        return price


REWARDS_FEBRUARY_2020 = Rewards(another_turn=1, won=2, died=-3, forbidden_move=-1)
REWARDS_APRIL_2020 = Rewards(another_turn=0.05, won=5, died=-1, forbidden_move=-1)
REWARDS_MAY_2020 = Rewards()


class StarterPackGym:
    """One game among n snakes under the starter pack's rules.

    Args:
        observation_type: One of `OBSERVATION_TYPES`.
        map_size: (rows, columns), 3 to 21 each where the observation is padded.
        number_of_snakes: 1 to 16; an initial state brings its own number.
        snake_spawn_locations: (row, column) for each snake; drawn at random where empty.
        food_spawn_locations: Squares of food to come, used up one after the other before chance takes over.
        rewards: A `Rewards`, a dictionary of some of its keys, or an object of your own with
            `get_reward(name, snake_id, episode)`.
        initial_game_state: A request body (`board`, `turn`) to begin every game with, or None.
        row_order: "down" (the pack's) or "up".
        initial_y: How y counts in the initial state: "down" as the pack reads it (and as requests had it in its time),
            "up" as requests have it today.
        seed: Decides all chance.

    Raises:
        BoardError: An unknown name or an impossible number.
    """

    def __init__(
        self,
        observation_type: str = "flat-51s",
        map_size: tuple[int, int] = (15, 15),
        number_of_snakes: int = 4,
        snake_spawn_locations: Sequence[Square] = (),
        food_spawn_locations: Sequence[Square] = (),
        rewards: RewardScheme | Mapping[str, float] = REWARDS_MAY_2020,
        initial_game_state: Mapping[str, Any] | None = None,
        row_order: str = "down",
        initial_y: str = "down",
        seed: int = 0,
    ) -> None:
        if observation_type not in OBSERVATION_TYPES:
            raise BoardError(
                "'{observation_type}' is no observation. {hint}",
                observation_type=observation_type,
                hint=nearest(observation_type, OBSERVATION_TYPES),
            )
        for name, order in (("row_order", row_order), ("initial_y", initial_y)):
            if order not in ("down", "up"):
                raise BoardError("{name} is '{order}'; expected 'down' or 'up'.", name=name, order=order)
        if initial_game_state is not None:
            number_of_snakes = len(initial_game_state["board"]["snakes"])
        if not all(3 <= side <= LARGEST_BOARD for side in map_size) or not 1 <= number_of_snakes <= 16:
            raise BoardError(
                "{number_of_snakes} snakes on {map_size}; expected 1 to 16 on 3 to {largest_board} squares.",
                number_of_snakes=number_of_snakes,
                map_size=map_size,
                largest_board=LARGEST_BOARD,
            )
        if len(snake_spawn_locations) not in (0, number_of_snakes):
            given = f"{len(snake_spawn_locations)} spawn locations for {number_of_snakes} snakes"
            raise BoardError("{given}; expected one each, or none.", given=given)
        self.observation_type, self.row_order = observation_type, row_order
        self.map_size: tuple[int, int] = (map_size[0], map_size[1])
        self.number_of_snakes = number_of_snakes
        self.rewards = Rewards.named(rewards) if isinstance(rewards, Mapping) else rewards
        if not isinstance(self.rewards, RewardScheme):
            raise BoardError(
                "rewards is a {type_name}; expected a dictionary or an object with get_reward.",
                type_name=type(rewards).__name__,
            )
        self._spawns, self._food_to_come = list(snake_spawn_locations), list(food_spawn_locations)
        self._initial, self._initial_y = initial_game_state, initial_y
        self._rng = generator(seed, "starter pack")
        self.snakes: list[Snake] = []
        self.food: set[Square] = set()
        self.turn = 0
        self._told: dict[int, str] = {}

    @property
    def observation_shape(self) -> tuple[int, int, int]:
        """Shape of the state: rows, columns, channels."""
        rows, columns = self.map_size
        border = self._border
        return rows + border, columns + border, 1 + self.number_of_snakes

    def reset(self) -> tuple[Array, dict[str, Any], dict[int, bool], dict[str, Any]]:
        """Begin a game."""
        self.turn, self._next_food = 0, 0
        if self._initial is not None:
            self._read(self._initial)
        else:
            self.snakes = [Snake([square]) for square in self._start_squares()]
            self.food = set()
            self._drop_food()
        self._told = dict.fromkeys(range(self.number_of_snakes), FREE)
        return self._state(), {}, dict.fromkeys(range(self.number_of_snakes), False), self._info()

    def step(
        self, actions: Sequence[int], episodes: Any = None
    ) -> tuple[Array, dict[int, float], dict[int, bool], dict[str, Any]]:
        """Play a turn.

        Args:
            actions: 0 up, 1 down, 2 left, 3 right for every snake; those of the dead are ignored.
            episodes: Handed on to the rewards.
        """
        happened: dict[int, list[str]] = {number: [] for number in range(len(self.snakes))}
        self._told = {}
        self._move(actions, happened)
        self._meet(happened)
        for number, snake in enumerate(self.snakes):
            snake.turns += snake.alive
            happened[number] += ["another_turn"] * snake.alive
        if self._rng.random() < FOOD_CHANCE:
            self._drop_food()
        if self.number_of_snakes > 1 and self.over:
            for number, snake in enumerate(self.snakes):
                happened[number].append("won" if snake.alive else "died")
        self.turn += 1
        return self._state(), self._pay(happened, episodes), self._dones(), self._info()

    @property
    def over(self) -> bool:
        """Whether the game is over: one snake left, or none where it played alone."""
        living = sum(snake.alive for snake in self.snakes)
        return living <= (1 if self.number_of_snakes > 1 else 0)

    def _move(self, actions: Sequence[int], happened: dict[int, list[str]]) -> None:
        """Let every living snake hunger and move; who starves or turns back is dead before any head is looked at."""
        for number, snake in enumerate(self.snakes):
            if not snake.alive:
                continue
            snake.health -= 1
            if snake.health == 0:
                fate, price = STARVED, "starved"
            elif snake.move(int(actions[number])):
                fate, price = FORBIDDEN, "forbidden_move"
            else:
                continue
            snake.die()
            self._told[number] = fate
            happened[number].append(price)

    def _meet(self, happened: dict[int, list[str]]) -> None:
        """Look at every head in turn, feed who lives, then let all die together that met their end."""
        doomed: list[Snake] = []
        for number, snake in enumerate(self.snakes):
            if not snake.alive:
                continue
            fate = outcome(snake, self.snakes, doomed, self.map_size)
            self._told[number] = fate
            if fate in FATAL:
                doomed.append(snake)
            elif snake.head in self.food:
                self.food.remove(snake.head)
                snake.eat()
                happened[number].append("ate_food")
            happened[number] += [REWARD_OF[fate]] if fate in REWARD_OF else []
        for snake in doomed:
            snake.die()

    def _pay(self, happened: Mapping[int, list[str]], episodes: Any) -> dict[int, float]:
        price = self.rewards.get_reward
        return {number: sum(price(name, number, episodes) for name in names) for number, names in happened.items()}

    def _start_squares(self) -> list[Square]:
        if self._spawns:
            return list(self._spawns)
        rows, columns = self.map_size
        cells = self._rng.choice(rows * columns, self.number_of_snakes, replace=False)
        return [(int(cell) // columns, int(cell) % columns) for cell in cells]

    def _drop_food(self) -> None:
        """Let a food fall where no snake lies; one that falls on another is lost."""
        if self._next_food < len(self._food_to_come) and self._initial is None:
            self.food.add(self._food_to_come[self._next_food])
            self._next_food += 1
            return
        taken = {square for snake in self.snakes for square in snake.body}
        rows, columns = self.map_size
        free = [(r, c) for r in range(rows) for c in range(columns) if (r, c) not in taken]
        if free:
            self.food.add(free[int(self._rng.integers(len(free)))])

    def _read(self, request: Mapping[str, Any]) -> None:
        """Take over a request."""
        board, rows = request["board"], self.map_size[0]
        if (board["height"], board["width"]) != self.map_size:
            raise BoardError(
                "the state is {board}x{board_2}; expected {map_size}.",
                board=board["height"],
                board_2=board["width"],
                map_size=self.map_size,
            )

        def squares(points: Sequence[Mapping[str, int]]) -> list[Square]:
            up = self._initial_y == "up"
            return [(rows - 1 - point["y"] if up else point["y"], point["x"]) for point in points]

        self.turn = int(request.get("turn", 0))
        self.food = set(squares(board["food"]))
        self.snakes = []
        for snake in board["snakes"]:
            body = squares(snake["body"])
            self.snakes.append(Snake(body, int(snake["health"]), facing_of(body), alive=bool(body)))

    def _state(self) -> Array:
        rows, columns = self.map_size
        state = np.zeros((rows, columns, 1 + self.number_of_snakes), np.uint8)
        for row, column in self.food:
            state[row, column, 0] = 1
        numbered = self.observation_type.endswith("num")
        for number, snake in enumerate(self.snakes, 1):
            for place, (row, column) in enumerate(reversed(snake.body), 1):
                state[row, column, number] = place if numbered else 1
            if snake.alive and not numbered:
                state[(*snake.head, number)] = 5
        if self.row_order == "up":
            state = state[::-1]
        return self._bordered(state) if "bordered" in self.observation_type else state

    @property
    def _border(self) -> int:
        """How much longer than the board the state is, on either axis."""
        if "bordered" not in self.observation_type:
            return 0
        return LARGEST_BOARD - self.map_size[0] if self.observation_type.startswith("max") else 2

    def _bordered(self, state: Array) -> Array:
        framed = np.full(self.observation_shape, -1.0)
        edge = self._border // 2
        framed[edge : edge + state.shape[0], edge : edge + state.shape[1]] = state
        return framed

    def _dones(self) -> dict[int, bool]:
        return {number: not snake.alive for number, snake in enumerate(self.snakes)}

    def _info(self) -> dict[str, Any]:
        return {
            "current_turn": self.turn,
            "snake_health": {number: snake.health for number, snake in enumerate(self.snakes)},
            "snake_info": {number: self._told.get(number, DEAD) for number in range(len(self.snakes))},
            "snake_max_len": {number: snake.turns for number, snake in enumerate(self.snakes)},
        }


def source_experiment(side: int = 11, seed: int = 0) -> StarterPackGym:
    """Return the gym of the pack's published experiment: 5 snakes, observations 21 x 21 x 6, no mask, April's rewards.

    Which board the published curves were made on is not known (facts: D.2); 11 x 11 is the pack's later default.

    >>> source_experiment().observation_shape
    (21, 21, 6)
    """
    return StarterPackGym("max-bordered-51s", (side, side), 5, rewards=REWARDS_APRIL_2020, seed=seed)
