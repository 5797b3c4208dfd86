"""Names of columns: what stands where in the arrays of `state.Games` and in a game's parameters."""

# games (N, G) int32
TURN = 0
FOOD = 1  # food on the board
NEXT_EVENT = 2  # first row of `events` not yet done
ALIVE = 3  # snakes alive
NUM_GAME_COLUMNS = 4

# snakes (N, S, 10) int32
X = 0  # head; off the board after a wall collision
Y = 1
START = 2  # place of the head in the ring
LENGTH = 3
HEALTH = 4
CAUSE = 5  # index into board.CAUSES
BY = 6  # snake, -1 for none
ON = 7  # turn of elimination
VERDICT = 8  # scratch of one turn
VERDICT_BY = 9
NUM_SNAKE_COLUMNS = 10

# cells (N, 4, C) int16
OWNER = 0  # 1 + snake whose living body lies here, 0 none
MEAL = 1  # 1 where food lies
HAZARD = 2  # stacked hazards
NOTE = 3  # snail_mode: hazards that appear next turn

# events (N, E, 3) int32: turn, cell, hazards added
# params (16,) int32
WIDTH = 0
HEIGHT = 1
WRAPPED = 2
ROYALE = 3
CONSTRICTOR = 4
SOLO = 5
DAMAGE = 6
SHRINK = 7
FOOD_RULE = 8  # 0 none, 1 standard, 2 off hazards, 3 arcade, 4 castle
CHANCE = 9
MIN_FOOD = 10
HAZARD_RULE = 11  # 0 plan, 1 royale, 2 snail, 3 maze
CASTLE_FOOD = 12
START_FOOD = 13  # 1 standard first food, 0 none
NUM_PARAMS = 16

# causes, in the order of board.CAUSES
STARVED = 1
WALL = 2
SELF = 3
BODY = 4
HEAD = 5
BURNT = 6
