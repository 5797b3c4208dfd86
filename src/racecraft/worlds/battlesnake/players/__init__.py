"""Snakes that play by hand-written wits, each a short page. Begin in `protocol.py`, then read them in rising strength.

protocol.py      what a player is
find.py          finding one by name
safe_moves.py         what every snake should look at: walls, bodies, dangerous heads
random_safe.py   1 any move that is not surely fatal
hungry.py        2 straight to the nearest food
flood_fill.py    3 counts the room behind each move
area_control.py  4 counts whose squares are whose, after every reply
search.py        5 looks many moves ahead, as long as it is given time
trained.py       a policy out of a run folder
anchors.py       players 1 to 3 at the speed of training
one_seat.py      games of one learner against players, as a world
gymnasium_env.py that world by its Gymnasium id
kernels/         squares counted and trees grown, compiled
from_file.py     a user's own `move(data)`, in a process of its own
file_worker.py   that process
messages.py      the official JSON, both ways
living_snakes.py the dead and the unreadable left out of what engines send
appearance.py         a snake's colour
time_budget.py   how much of the timeout a player has
json_adapter.py  asks such a file as if it saw boards
"""
