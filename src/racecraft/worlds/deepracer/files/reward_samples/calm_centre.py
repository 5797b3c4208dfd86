"""Pay for the centre line, and take a fifth away for steering more than 15 degrees.

Less zigzag on straights. The limit lies below the table's larger angles: a car that needs them in a bend is paid less
there, so the limit has to fit the table.
"""

CALM = 15.0  # degrees


def reward_function(params):
    """Return the reward for one tick."""
    share = params["distance_from_center"] / (0.5 * params["track_width"])
    if share <= 0.2:
        reward = 1.0
    elif share <= 0.5:
        reward = 0.5
    elif share <= 1.0:
        reward = 0.1
    else:
        reward = 1e-3
    if abs(params["steering_angle"]) > CALM:
        reward *= 0.8
    return reward
