"""Pay the car for speed and, behind or beside another car, for being in the other lane: so that it overtakes.

A car that is paid for its place on the road alone is content behind a slow one. Paid for its speed, it loses by waiting
there, and by running into the other it loses all that would still come.
"""

FAST = 1.0  # m/s that are paid in full; more is paid more
NEAR = 1.5  # metres ahead within which another car matters
BESIDE = 0.4  # metres past its middle until which it still does


def reward_function(params):
    """Return the reward for one tick."""
    if params["is_crashed"] or params["is_offtrack"]:
        return 1e-3

    # The car's place across the road: -1 at the right border, 0 on the centre line, 1 at the left border.
    half = 0.5 * params["track_width"]
    place = params["distance_from_center"] / half
    if not params["is_left_of_center"]:
        place = -place

    # Where it should be: on the centre line, or in the middle of the lane that the nearest car leaves free.
    wanted = 0.0
    nearest = NEAR
    for number, distance in enumerate(params["objects_distance"]):
        ahead = (distance - params["projection_distance"]) % params["track_length"]
        if params["track_length"] - ahead < BESIDE:
            ahead = 0.0
        if ahead < nearest:
            nearest = ahead
            wanted = -0.5 if params["objects_left_of_center"][number] else 0.5

    # The nearer to that place and the faster, the more; beyond the border nearly nothing.
    if abs(place) > 1.0:
        return 1e-3
    return max(1e-3, 1.0 - 0.5 * abs(place - wanted)) ** 2 * params["speed"] / FAST
