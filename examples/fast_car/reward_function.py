"""Pay for speed, as long as the car stays on the road: the car finds its own line."""


def reward_function(params):
    """Return the reward for one tick."""
    # 0 on the centre line, 1 on the border.
    towards_border = min(params["distance_from_center"] / (0.5 * params["track_width"]), 1.0)

    # Leaving the road ends the episode, and with it all further pay; near the border speed pays less.
    if not params["all_wheels_on_track"]:
        return 0.001
    return params["speed"] * (1.0 - 0.5 * towards_border**2)
