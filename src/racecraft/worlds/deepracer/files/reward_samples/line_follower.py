"""Pay for following a racing line at the speed that it allows, on re:Invent 2018.

The line comes from `racecraft line reinvent_base --line solver --out line.py`; for another track or car make another. A
tick pays up to 1 for the line, times the square of the share of the line's speed that the car commands.
"""

import math

# (x in m, y in m, speed in m/s)
# fmt: off
LINE = [
    (3.06, 1.07, 2.58), (3.36, 1.07, 2.58), (3.66, 1.07, 2.58), (3.96, 1.06, 2.58), (4.26, 1.06, 2.58),
    (4.55, 1.06, 2.58), (4.85, 1.06, 2.58), (5.15, 1.05, 2.58), (5.45, 1.05, 2.58), (5.75, 1.04, 2.58),
    (6.04, 1.02, 2.58), (6.30, 1.07, 2.58), (6.48, 1.15, 2.58), (6.61, 1.27, 2.58), (6.71, 1.40, 2.58),
    (6.78, 1.56, 2.43), (6.81, 1.71, 2.24), (6.80, 1.88, 2.55), (6.76, 2.06, 2.57), (6.66, 2.22, 2.58),
    (6.53, 2.37, 2.58), (6.34, 2.48, 2.58), (6.08, 2.58, 2.58), (5.78, 2.71, 2.58), (5.48, 2.84, 2.58),
    (5.19, 2.97, 2.58), (4.94, 3.08, 2.58), (4.75, 3.16, 2.58), (4.54, 3.25, 2.58), (4.27, 3.38, 2.58),
    (3.97, 3.52, 2.58), (3.67, 3.65, 2.58), (3.36, 3.79, 2.58), (3.11, 3.92, 2.58), (2.95, 3.99, 2.58),
    (2.82, 4.04, 2.58), (2.58, 4.06, 2.58), (2.30, 4.09, 2.58), (2.00, 4.13, 2.58), (1.70, 4.11, 2.58),
    (1.48, 4.04, 2.58), (1.37, 3.96, 2.58), (1.26, 3.85, 2.58), (1.18, 3.73, 2.58), (1.12, 3.57, 2.58),
    (1.09, 3.34, 2.58), (1.14, 3.07, 2.58), (1.22, 2.77, 2.58), (1.29, 2.48, 2.58), (1.36, 2.18, 2.58),
    (1.42, 1.89, 2.58), (1.48, 1.61, 2.58), (1.60, 1.38, 2.58), (1.69, 1.26, 2.58), (1.77, 1.20, 2.58),
    (1.94, 1.12, 2.58), (2.18, 1.07, 2.58), (2.45, 1.08, 2.58), (2.76, 1.08, 2.58),
]
# fmt: on
NEAR = 0.25  # metres from the line that are still paid


def nearest(x, y):
    """Return the distance to the line, m, and the speed there, m/s."""
    place = min(range(len(LINE)), key=lambda i: (LINE[i][0] - x) ** 2 + (LINE[i][1] - y) ** 2)
    off = math.inf
    for a, b in ((LINE[place - 1], LINE[place]), (LINE[place], LINE[(place + 1) % len(LINE)])):
        dx, dy = b[0] - a[0], b[1] - a[1]
        share = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy)
        share = min(max(share, 0.0), 1.0)
        off = min(off, math.dist((x, y), (a[0] + share * dx, a[1] + share * dy)))
    return off, LINE[place][2]


def reward_function(params):
    """Return the reward for one tick."""
    if params["is_offtrack"]:
        return 1e-3
    off, speed = nearest(params["x"], params["y"])
    on_line = max(0.0, 1.0 - (off / NEAR) ** 2)
    pace = min(params["speed"] / speed, 1.0) ** 2
    return on_line * pace + 1e-3
