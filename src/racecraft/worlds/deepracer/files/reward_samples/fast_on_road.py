"""Pay for commanded speed, as long as the car is on the road.

A tick at 2 m/s pays four times a tick at 1 m/s. The square makes the faster lap the better paid one although it has
fewer ticks; with the plain speed all laps would earn about the same.
"""

TOP = 2.5  # m/s, the fastest command of the table


def reward_function(params):
    """Return the reward for one tick."""
    if not params["all_wheels_on_track"]:
        return 1e-3
    return (params["speed"] / TOP) ** 2
