"""Pay the same everywhere on the road, and nearly nothing beside it.

The car learns to stay between the borders. No line and no speed is asked for, so it weaves, and a slow lap earns as
much a second as a fast one.
"""


def reward_function(params):
    """Return the reward for one tick."""
    half_width = 0.5 * params["track_width"]
    if params["all_wheels_on_track"] and half_width - params["distance_from_center"] >= 0.05:
        return 1.0
    return 1e-3
