"""Pay for steering towards a point of the centre line one metre ahead, and for speed.

The car is told early in which direction the road bends, so it cuts corners a little and turns in before the bend.
"""

import math

AHEAD = 1.0  # metres along the centre line


def point_ahead(params):
    """Return the first waypoint that lies AHEAD of the car along the centre line."""
    waypoints = params["waypoints"]
    place = params["closest_waypoints"][1]
    left = AHEAD
    while left > 0.0:
        following = (place + 1) % len(waypoints)
        left -= math.dist(waypoints[place], waypoints[following])
        place = following
    return waypoints[place]


def reward_function(params):
    """Return the reward for one tick."""
    if not params["all_wheels_on_track"]:
        return 1e-3
    x, y = point_ahead(params)
    wanted = math.degrees(math.atan2(y - params["y"], x - params["x"])) - params["heading"]
    wanted = (wanted + 180.0) % 360.0 - 180.0
    off = min(abs(wanted - params["steering_angle"]), 60.0) / 60.0
    return max(1e-3, 1.0 - off) * params["speed"] ** 2
