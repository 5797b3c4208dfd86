"""Pay for pointing where the road goes, and for speed.

The direction of the road is that from the waypoint behind to the one ahead. Angles of `math` are radians and `heading`
is degrees: convert before subtracting, and bring the difference into -180 to 180.
"""

import math


def reward_function(params):
    """Return the reward for one tick."""
    if not params["all_wheels_on_track"]:
        return 1e-3
    behind, ahead = (params["waypoints"][i] for i in params["closest_waypoints"])
    road = math.degrees(math.atan2(ahead[1] - behind[1], ahead[0] - behind[0]))
    off = abs((road - params["heading"] + 180.0) % 360.0 - 180.0)
    return max(1e-3, math.cos(math.radians(min(off, 90.0)))) * params["speed"] ** 2
