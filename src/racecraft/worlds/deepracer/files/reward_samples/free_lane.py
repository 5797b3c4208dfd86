"""Pay the car for staying on the road and, near an object, for being in the other lane.

`params` tells where the car is, what it does, and what stands or drives ahead; the number returned is its pay for this
moment. Change the distances and the pay below, train again, and see what the car makes of it.
"""

NEAR = 1.2  # metres ahead within which an object matters
BESIDE = 0.35  # metres past its middle until which it still does


def reward_function(params):
    """Return the reward for one tick."""
    if params["is_crashed"] or params["is_offtrack"]:
        return 1e-3

    # The car's place across the road: -1 at the right border, 0 on the centre line, 1 at the left border.
    half = 0.5 * params["track_width"]
    place = params["distance_from_center"] / half
    if not params["is_left_of_center"]:
        place = -place

    # Where it should be: on the centre line, or in the middle of the lane that the nearest object leaves free.
    wanted = 0.0
    nearest = NEAR
    for distance, is_left in zip(params["objects_distance"], params["objects_left_of_center"]):
        ahead = (distance - params["projection_distance"]) % params["track_length"]
        if params["track_length"] - ahead < BESIDE:
            ahead = 0.0
        if ahead < nearest:
            nearest = ahead
            wanted = -0.55 if is_left else 0.55

    # The nearer to that place, the more; beyond the border nearly nothing.
    if abs(place) > 1.0:
        return 1e-3
    return max(1e-3, 1.0 - abs(place - wanted)) ** 2
