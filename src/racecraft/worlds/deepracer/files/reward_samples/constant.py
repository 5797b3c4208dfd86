"""Pay 1 whatever happens.

Nothing is asked of the car except that the episode goes on: it learns to stay on the road, as leaving ends the pay, and
has no reason to hurry.
"""


def reward_function(params):
    """Return the reward for one tick."""
    return 1.0
