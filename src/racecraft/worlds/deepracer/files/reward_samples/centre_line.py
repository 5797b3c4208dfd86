"""Pay the car for staying near the centre line.

`params` tells where the car is and what it does at this moment; the number returned is its pay for this moment.
Change the shares and the pay below, train again, and see what the car makes of it.
"""


def reward_function(params):
    """Return the reward for one tick."""
    # How far the car is from the centre line, in metres, and how wide the track is here.
    distance = params["distance_from_center"]
    width = params["track_width"]

    # Three bands round the centre line: the nearer, the more.
    if distance <= 0.10 * width:
        return 1.0
    if distance <= 0.25 * width:
        return 0.5
    if distance <= 0.50 * width:
        return 0.1

    # Beyond the border: next to nothing, but not zero, so that less bad is still told from worse.
    return 1e-3
