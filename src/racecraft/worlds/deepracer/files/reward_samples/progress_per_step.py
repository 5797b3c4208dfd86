"""Pay for progress over steps: how fast the car was on average since the episode began.

Popular among racers. It pays for the past as well: after a fast beginning a slow moment is paid well, so single actions
are hard to tell apart. `metres_gained` pays for the moment alone.
"""


def reward_function(params):
    """Return the reward for one tick."""
    if params["is_offtrack"]:
        return 1e-3
    return max(1e-3, params["progress"] / params["steps"])
