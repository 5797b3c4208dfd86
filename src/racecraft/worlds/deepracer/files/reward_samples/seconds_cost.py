"""Take a little away every tick, and pay for metres gained: the lap that loses least time earns most.

The price of a tick is what the car gains at 1 m/s, so creeping costs and everything faster pays. Leaving the road costs
five metres; without that price a car whose ticks cost more than they bring would learn to end the episode.
"""


class Before:
    """What was so a tick ago; every car has its own."""

    steps, progress = float("inf"), 0.0


def reward_function(params):
    """Return the reward for one tick."""
    steps, progress = params["steps"], params["progress"]
    if steps <= Before.steps:  # a new episode
        Before.progress = progress
    metres = (progress - Before.progress) / 100.0 * params["track_length"]
    Before.steps, Before.progress = steps, progress
    if params["is_offtrack"]:
        return -5.0
    return metres - 1.0 / 15.0
