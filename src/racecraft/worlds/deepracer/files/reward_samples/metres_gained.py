"""Pay the car for every metre that it gains along the centre line, less where it steers hastily or leaves the road.

`params` tells where the car is and what it does at this moment; the number returned is its pay for this moment.
A fast line gains more metres a moment, so the car finds one by itself. Change the pay below and train again.
"""


class Before:
    """What the car did a moment ago, and how many drives it has begun; every car has its own."""

    drives, steps, progress, steering, side = 0, float("inf"), 0.0, 0.0, 0.0


def reward_function(params):
    """Return the reward for one tick."""
    steps, progress, steering = params["steps"], params["progress"], params["steering_angle"]
    if steps <= Before.steps:  # a new episode
        Before.drives, Before.progress, Before.steering = Before.drives + 1, progress, steering
    metres = (progress - Before.progress) / 100.0 * params["track_length"]
    turned = abs(steering - Before.steering) / 30.0
    # Small corrections are no change of sides: chance makes them, too, where a policy draws its angles from a range.
    aside = steering if abs(steering) > 8.0 else 0.0
    changed_side = aside * Before.side < 0.0
    Before.steps, Before.progress, Before.steering = steps, progress, steering
    Before.side = aside or Before.side
    # A share of the metres: a price of its own would make a slow drive cost more than it earns, and a quick end pay.
    pay = 2.0 * metres * (1.0 - 0.25 * turned - 0.5 * changed_side)
    # What two and a half metres pay, and in time twenty-five: at first the car shall dare, later it shall finish.
    return pay - min(5.0 + Before.drives / 15.0, 50.0) * params["is_offtrack"]
