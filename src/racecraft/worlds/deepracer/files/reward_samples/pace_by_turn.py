"""Pay for the speed that the road ahead allows: fast on straights, slow where it bends.

How much the road bends is measured over the next eight waypoints. The wanted speed falls from 2.5 m/s on a straight to
1.5 m/s in a sharp bend; driving faster or slower than that is paid less.
"""

import math

AHEAD = 8  # waypoints
FAST, SLOW = 2.5, 1.5  # m/s
SHARP = 60.0  # degrees of turn over the waypoints ahead


def turn_ahead(params):
    """Return how many degrees the road turns over the waypoints ahead, without a sign."""
    waypoints = params["waypoints"][:-1]
    first = params["closest_waypoints"][1]
    a, b, c, d = (waypoints[(first + k) % len(waypoints)] for k in (0, 1, AHEAD - 1, AHEAD))
    now = math.atan2(b[1] - a[1], b[0] - a[0])
    later = math.atan2(d[1] - c[1], d[0] - c[0])
    turn = math.degrees(later - now)
    return abs((turn + 180.0) % 360.0 - 180.0)


def reward_function(params):
    """Return the reward for one tick."""
    if not params["all_wheels_on_track"]:
        return 1e-3
    wanted = FAST - (FAST - SLOW) * min(turn_ahead(params) / SHARP, 1.0)
    pace = max(0.0, 1.0 - abs(params["speed"] - wanted))
    return (pace + 1e-3) * params["speed"] ** 2
