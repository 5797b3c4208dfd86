"""The AWS starter pack's gym: its rules, observations, rewards and options, habits included.

For who repeats its experiments or ports its agents. It is not the official game (facts: B.1): reversing kills as a
"forbidden move", hunger is looked at before eating, heads that swap squares fight by length, equal heads leave the
food, starts are random squares, one food at the start, then 15 percent a turn and no minimum. Rows count downward:
action 0 "up" is row - 1.

Observations are (rows, columns, 1 + snakes): food 1 in channel 0, then a channel for each snake.

    flat-51s       head 5, body 1                       flat-num       tail 1, upward to the head
    bordered-51s   with a ring of -1 about the board    bordered-num
    max-bordered-51s, max-bordered-num                  padded with -1 to 21 x 21, whatever the board

`row_order`: "down" as the pack shows it (row 0 on top, action "up" lowers the row); "up" turns observations over, so
that row index equals the official y (row 0 at the bottom).

Mean length of an episode of 5 snakes, measured in the original (facts: D.3) and here (300 games; 150 on 19 x 19):

    board     uniform random     no reverse       random among free squares
    7 x 7     3.5  here 3.4      6.0  here 6.1    38.8  here 39.0
    11 x 11   4.4  here 4.3      12.4 here 12.5   102   here 98
    15 x 15   4.8  here 4.9      21.3 here 21.5   165   here 153
    19 x 19   4.9                31.9             177   here 182

Collisions are settled snake by snake in their order, against the positions after all have moved. This class follows
the pack's Gym surface of its time: `reset() -> (state, {}, dones, info)`, `step(actions) -> (state, rewards, dones,
info)`, all dictionaries by snake number, `dones` True for the dead, `won` and `died` paid when the game ends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from racecraft.contract.errors import nearest
from racecraft.contract.random_streams import generator
from racecraft.contract.world import Array
from racecraft.envs.battlesnake.board import MAX_HEALTH, BoardError

Square = tuple[int, int]
"""(row, column); row 0 is the top."""

OBSERVATION_TYPES = (
    "flat-51s", "flat-num", "bordered-51s", "bordered-num", "max-bordered-51s", "max-bordered-num",
)  # fmt: skip
LARGEST_BOARD = 21
FOOD_CHANCE = 0.15
_START_LENGTH = 3  # a snake begins as a head and grows to this by moving
_STEPS: tuple[Square, ...] = ((-1, 0), (1, 0), (0, -1), (0, 1))


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
                raise BoardError(f"There is no reward '{name}'. {nearest(name, known)}")
        return cls(**{**known, **values})


REWARDS_FEBRUARY_2020 = Rewards(another_turn=1, won=2, died=-3, forbidden_move=-1)
REWARDS_APRIL_2020 = Rewards(another_turn=0.05, won=5, died=-1, forbidden_move=-1)
REWARDS_MAY_2020 = Rewards()


@dataclass
class _Snake:
    body: list[Square]
    """Squares from head to tail."""
    health: int = MAX_HEALTH
    facing: int | None = None
    """The last move; None before the first."""
    alive: bool = True
    turns: int = 0
    """Turns survived."""


class StarterPackGym:
    """One game among n snakes under the starter pack's rules.

    Args:
        observation_type: One of `OBSERVATION_TYPES`.
        map_size: (rows, columns), 3 to 21 each where the observation is padded.
        number_of_snakes: 1 to 16.
        snake_spawn_locations: (row, column) for each snake; drawn at random where empty.
        food_spawn_locations: Squares of food to come, used up one after the other before chance takes over.
        rewards: A `Rewards`, or a dictionary of some of its keys.
        initial_game_state: An official request body (`board`, `turn`) to begin every game with, or None.
        row_order: "down" (the pack's) or "up".
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
        rewards: Rewards | Mapping[str, float] = REWARDS_MAY_2020,
        initial_game_state: Mapping[str, Any] | None = None,
        row_order: str = "down",
        seed: int = 0,
    ) -> None:
        if observation_type not in OBSERVATION_TYPES:
            raise BoardError(f"'{observation_type}' is no observation. {nearest(observation_type, OBSERVATION_TYPES)}")
        if row_order not in ("down", "up"):
            raise BoardError(f"row_order is '{row_order}'; expected 'down' or 'up'.")
        if not all(3 <= side <= LARGEST_BOARD for side in map_size) or not 1 <= number_of_snakes <= 16:
            raise BoardError(
                f"{number_of_snakes} snakes on {map_size}; expected 1 to 16 on 3 to {LARGEST_BOARD} squares."
            )
        self.observation_type, self.map_size, self.row_order = observation_type, tuple(map_size), row_order
        self.number_of_snakes = number_of_snakes
        self.rewards = rewards if isinstance(rewards, Rewards) else Rewards.named(rewards)
        self._spawns, self._food_to_come = list(snake_spawn_locations), list(food_spawn_locations)
        self._initial = initial_game_state
        self._rng = generator(seed, "starter pack")
        self.snakes: list[_Snake] = []
        self.food: list[Square] = []
        self.turn = 0
        self._last_fates: dict[int, str] = {}

    @property
    def observation_shape(self) -> tuple[int, int, int]:
        """Shape of the state: rows, columns, channels."""
        rows, columns = self.map_size
        border = 2 if "bordered" in self.observation_type else 0
        if self.observation_type.startswith("max"):
            rows = columns = LARGEST_BOARD - border
        return rows + border, columns + border, 1 + self.number_of_snakes

    def reset(self) -> tuple[Array, dict[str, Any], dict[int, bool], dict[str, Any]]:
        """Begin a game."""
        self.turn, self._next_food, self._last_fates = 0, 0, {}
        if self._initial is not None:
            self._read(self._initial)
        else:
            self.snakes = [_Snake([square]) for square in self._start_squares()]
            self.food = []
            self._drop_food()
        return self._state(), {}, self._dones(), self._info()

    def step(self, actions: Sequence[int]) -> tuple[Array, dict[int, float], dict[int, bool], dict[str, Any]]:
        """Play a turn.

        Args:
            actions: 0 up, 1 down, 2 left, 3 right for every snake; those of the dead are ignored.
        """
        self.turn += 1
        living = [number for number, snake in enumerate(self.snakes) if snake.alive]
        fates = {number: ["another_turn"] for number in living}
        for number in living:
            self._move(number, int(actions[number]), fates)
        self._collide(fates)
        self._eat(fates)
        if self._rng.random() < FOOD_CHANCE:
            self._drop_food()
        over = self.over
        for number in living:
            self.snakes[number].turns += self.snakes[number].alive
        self._last_fates = {number: ", ".join(reasons) for number, reasons in fates.items()}
        return self._state(), self._pay(fates, over), self._dones(), self._info()

    @property
    def over(self) -> bool:
        """Whether the game is over: one snake left, or none where it played alone."""
        living = sum(snake.alive for snake in self.snakes)
        return living <= (1 if self.number_of_snakes > 1 else 0)

    def _move(self, number: int, action: int, fates: dict[int, list[str]]) -> None:
        snake = self.snakes[number]
        snake.health -= 1
        if snake.health <= 0:
            self._kill(number, "starved", fates)
            return
        if snake.facing is not None and action == snake.facing ^ 1:
            self._kill(number, "forbidden_move", fates)
            return
        snake.facing = action
        head = (snake.body[0][0] + _STEPS[action][0], snake.body[0][1] + _STEPS[action][1])
        if not (0 <= head[0] < self.map_size[0] and 0 <= head[1] < self.map_size[1]):
            self._kill(number, "hit_wall", fates)
            return
        grows = head in self.food or len(snake.body) < _START_LENGTH
        snake.body = [head, *(snake.body if grows else snake.body[:-1])]

    def _collide(self, fates: dict[int, list[str]]) -> None:
        for number, snake in enumerate(self.snakes):
            if not snake.alive:
                continue
            if snake.body[0] in snake.body[1:]:
                self._kill(number, "hit_self", fates)
                continue
            for other, rival in enumerate(self.snakes):
                if other == number or not rival.alive or not snake.alive:
                    continue
                self._meet(number, other, fates)

    def _meet(self, number: int, other: int, fates: dict[int, list[str]]) -> None:
        """Settle one snake's head against another snake."""
        snake, rival = self.snakes[number], self.snakes[other]
        swapped = len(snake.body) > 1 and len(rival.body) > 1
        swapped = swapped and snake.body[0] == rival.body[1] and rival.body[0] == snake.body[1]
        if snake.body[0] == rival.body[0] or swapped:
            if len(snake.body) <= len(rival.body):
                self._kill(number, "was_eaten", fates)
                fates[other].append("ate_another_snake")
            if len(rival.body) <= len(snake.body):
                self._kill(other, "was_eaten", fates)
                fates[number].append("ate_another_snake")
        elif snake.body[0] in rival.body[1:]:
            self._kill(number, "hit_other_snake", fates)
            fates[other].append("other_snake_hit_body")

    def _eat(self, fates: dict[int, list[str]]) -> None:
        for number, snake in enumerate(self.snakes):
            if snake.alive and snake.body[0] in self.food:
                self.food.remove(snake.body[0])
                snake.health = MAX_HEALTH
                fates[number].append("ate_food")

    def _kill(self, number: int, why: str, fates: dict[int, list[str]]) -> None:
        self.snakes[number].alive = False
        fates[number] = [why]

    def _pay(self, fates: Mapping[int, list[str]], over: bool) -> dict[int, float]:
        prices = asdict(self.rewards)
        pay = {number: 0.0 for number in range(len(self.snakes))}
        for number, reasons in fates.items():
            pay[number] += sum(prices[reason] for reason in reasons)
        if over:
            for number, snake in enumerate(self.snakes):
                pay[number] += prices["won" if snake.alive else "died"]
        return pay

    def _start_squares(self) -> list[Square]:
        if self._spawns:
            return list(self._spawns)
        rows, columns = self.map_size
        cells = self._rng.choice(rows * columns, self.number_of_snakes, replace=False)
        return [(int(cell) // columns, int(cell) % columns) for cell in cells]

    def _drop_food(self) -> None:
        if self._next_food < len(self._food_to_come):
            self.food.append(self._food_to_come[self._next_food])
            self._next_food += 1
            return
        taken = {*self.food, *(square for snake in self.snakes if snake.alive for square in snake.body)}
        rows, columns = self.map_size
        free = [(r, c) for r in range(rows) for c in range(columns) if (r, c) not in taken]
        if free:
            self.food.append(free[int(self._rng.integers(len(free)))])

    def _read(self, request: Mapping[str, Any]) -> None:
        """Take over an official request; its y counts upward, our rows downward."""
        board = request["board"]
        rows = self.map_size[0]
        if (board["height"], board["width"]) != self.map_size:
            raise BoardError(f"the state is {board['height']}x{board['width']}; expected {self.map_size}.")
        self.turn = int(request.get("turn", 0))
        self.food = [(rows - 1 - point["y"], point["x"]) for point in board["food"]]
        self.snakes = []
        for snake in board["snakes"]:
            body = list(dict.fromkeys((rows - 1 - point["y"], point["x"]) for point in snake["body"]))
            self.snakes.append(_Snake(body, int(snake["health"]), _facing(body)))
        self.number_of_snakes = len(self.snakes)

    def _state(self) -> Array:
        rows, columns = self.map_size
        state = np.zeros((rows, columns, 1 + self.number_of_snakes), np.int16)
        for row, column in self.food:
            state[row, column, 0] = 1
        for number, snake in enumerate(self.snakes):
            for place, (row, column) in enumerate(reversed(snake.body if snake.alive else [])):
                is_head = place == len(snake.body) - 1
                value = place + 1 if self.observation_type.endswith("num") else 5 if is_head else 1
                state[row, column, 1 + number] = value
        if self.row_order == "up":
            state = state[::-1]
        return self._bordered(state)

    def _bordered(self, state: Array) -> Array:
        shape = self.observation_shape
        framed = np.full(shape, -1, np.int16)
        top, left = (shape[0] - state.shape[0]) // 2, (shape[1] - state.shape[1]) // 2
        framed[top : top + state.shape[0], left : left + state.shape[1]] = state
        return framed

    def _dones(self) -> dict[int, bool]:
        return {number: not snake.alive for number, snake in enumerate(self.snakes)}

    def _info(self) -> dict[str, Any]:
        return {
            "current_turn": self.turn,
            "snake_health": {number: snake.health for number, snake in enumerate(self.snakes)},
            "snake_info": {number: self._last_fates.get(number, "") for number in range(len(self.snakes))},
            "snake_max_len": {number: snake.turns for number, snake in enumerate(self.snakes)},
        }


def source_experiment(side: int = 11, seed: int = 0) -> StarterPackGym:
    """Return the gym of the pack's published experiment: 5 snakes, observations 21 x 21 x 6, no mask, April's rewards.

    Which board the published curves were made on is not known (facts: D.2); 11 x 11 is the pack's later default.

    >>> source_experiment().observation_shape
    (21, 21, 6)
    """
    return StarterPackGym("max-bordered-51s", (side, side), 5, rewards=REWARDS_APRIL_2020, seed=seed)


def _facing(body: Sequence[Square]) -> int | None:
    if len(body) < 2:
        return None
    step = (body[0][0] - body[1][0], body[0][1] - body[1][1])
    return _STEPS.index(step) if step in _STEPS else None
