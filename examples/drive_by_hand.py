"""Drive a car by hand through Gymnasium: steer towards a point of the centre line a little way ahead."""

import math

import gymnasium
import numpy as np

import racecraft.adapters  # noqa: F401  (registers racecraft/DeepRacer-v0)

LOOK_AHEAD_M = 0.6

env = gymnasium.make("racecraft/DeepRacer-v0", track="Oval_track", width=40, height=30)
world = env.unwrapped.cars  # one car; the world knows where it is
angles = np.array(world.actions.steering)
fast = np.flatnonzero(np.array(world.actions.speed) == 1.0)

frame, info = env.reset(seed=1)
total, ended = 0.0, False
while not ended:
    car = world.cars[0, 0]
    ahead = world.track.pose_at(float(car["arc"]) + LOOK_AHEAD_M)
    wanted = math.remainder(math.atan2(ahead.y - car["y"], ahead.x - car["x"]) - car["yaw"], math.tau)
    action = fast[np.abs(angles[fast] - wanted).argmin()]
    frame, reward, terminated, truncated, info = env.step(action)
    total, ended = total + reward, terminated or truncated

(episode,) = world.pop_episodes()
print(f"{episode.status} after {episode.steps} steps, {episode.facts['lap_seconds']:.2f} s, paid {total:.1f}")
assert episode.status == "lap_complete"
