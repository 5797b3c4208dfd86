"""Snakes on a board under the official rules. Begin in `reference.py`: one turn, told by the referee.

    board.py          what a position is: snakes, food, hazards; drawn as text
    settings.py       what one game is played with
    dice.py           random draws passed in, and fixed ones for tests
    stages.py         the rules, one named stage each
    rulesets.py       standard, solo, royale, constrictor, wrapped: lists of stages
    maps.py           the 25 maps: where snakes start, where food falls, how hazards come
    starts.py         start squares and starting food        hazard_plans.py   hazards revealed over time
    layouts.py        drawn walls and rivers (layouts.toml)  solo_maze.py      the maze that grows with its snake
    reference.py      the slow, readable referee
    state.py          N games as a structure of arrays, there and back
    kernels/          the same rules compiled, for many games side by side; the observation
    observation.py    what a snake sees: one function for training, server and arena
    world.py          N games of M snakes under the `World` contract
    records.py        recorded games          verify.py   hold referee and kernel against them
    starter_pack.py   the AWS starter pack's gym, quirks included; its rules in starter_pack_rules.py

x grows to the right, y upward, (0, 0) is bottom-left; a cell is numbered `y * width + x`. Health is 0 to 100.
The rules follow the official engine's behaviour as described in the project's facts (A.1 to A.9); no line is its code.
"""
