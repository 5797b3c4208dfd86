"""Pay more the nearer the car is to the centre line, without steps.

A curve in place of three bands: every centimetre counts, so each correction is felt at once. Speed is not asked for.
"""

import math


def reward_function(params):
    """Return the reward for one tick."""
    share = params["distance_from_center"] / (0.5 * params["track_width"])
    return math.exp(-4.0 * share * share) + 1e-3
