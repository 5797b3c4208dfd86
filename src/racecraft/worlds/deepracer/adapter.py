"""A DeepRacer car as `gymnasium.Env`.

`import racecraft.adapters`, then `gymnasium.make("racecraft/DeepRacer-v0")`, or `gymnasium.make_vec` with
`vectorization_mode="vector_entry_point"` for many cars in one call.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.adapters.gymnasium_env import WorldEnv
from racecraft.adapters.gymnasium_vector import WorldVectorEnv
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionSpace, ActionTable, action_space
from racecraft.worlds.deepracer.env.camera import Camera
from racecraft.worlds.deepracer.env.reward_caller import CarRewards
from racecraft.worlds.deepracer.env.reward_process import open_reward
from racecraft.worlds.deepracer.env.sensors import FRONT, car_sensors
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import MAX_SPEED_MPS, MAX_STEERING_RAD, MIN_SPEED_MPS, TICKS_PER_SECOND
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.model_metadata import default_model_metadata
from racecraft.worlds.deepracer.tracks.catalogue import load_track

RENDER_WIDTH, RENDER_HEIGHT = 640, 480

Reward = Callable[[dict[str, Any]], float]


class DeepRacerEnv(WorldEnv):
    """One car on a DeepRacer track, with a front camera or other sensors; the card is in `env/world.py`.

    Observation: uint8 (height, width), grey; with several sensors a dictionary by their names. Action: a number of the
    action table, or with two ranges the pair itself, float32 (steering in rad, positive left; speed in m/s). The first
    action of an episode is not obeyed (the car is held at the start); `info["active"]` tells so.

    Args:
        track: A name of the catalogue, or a waypoint file.
        reward: `reward_function(params)`, or the path of a file that holds one; by default the share of the road's
            half width that lies between the car and the border, 1 on the centre line.
        actions: (steering angle in degrees, positive left; speed in m/s) pairs; by default the console's ten. Or two
            ranges, `{"steering_angle": (-30, 30), "speed": (0.5, 2)}`: then actions are continuous.
        car: Vehicle profile: "v4", "v5-classic", "v6", "v6-unlimited" or "kinematic".
        width, height: Pixels of the frame.
        sensors: Names as in `model_metadata.json`: one camera, and at most one LiDAR.
        lidar_config: Of a DISCRETIZED_SECTOR_LIDAR, as there.
        trust_reward: Whether a file's reward function keeps all your rights; a function that is given has them.
        max_episode_seconds: An episode is truncated after so much simulated time; None: as in training.
        render_mode: "rgb_array" for a 640x480 colour picture of what the car sees.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": TICKS_PER_SECOND}  # noqa: RUF012

    def __init__(self, render_mode: str | None = None, **options: Any) -> None:
        if render_mode not in (None, "rgb_array"):
            raise SettingError("render_mode is {render_mode!r}; expected None or 'rgb_array'.", render_mode=render_mode)
        self.cars = race_world(num_cars=1, **options)
        super().__init__(self.cars)
        self.render_mode = render_mode
        self._eye: Camera | None = None

    def render(self) -> Array | None:
        """Return what the car sees, uint8 (480, 640, 3); None without a render mode."""
        if self.render_mode is None:
            return None
        if self._eye is None:
            camera = self.cars.camera
            self._eye = Camera(camera.scene, RENDER_WIDTH, RENDER_HEIGHT, camera.mount)
        car = self.cars.cars[0, 0]
        return np.asarray(self._eye.render_rgb(np.array([[car["x"], car["y"], car["yaw"]]]))[0])


def deepracer_vector_env(num_envs: int = 1, **options: Any) -> WorldVectorEnv:
    """Return many cars in one vector environment; options as for `DeepRacerEnv`."""
    options.pop("render_mode", None)
    return WorldVectorEnv(race_world(num_cars=num_envs, **options))


def race_world(
    num_cars: int = 1,
    track: str | Path = "reinvent_base",
    reward: Reward | str | Path | None = None,
    actions: Sequence[tuple[float, float]] | Mapping[str, tuple[float, float]] | None = None,
    car: str = "v6",
    width: int = 160,
    height: int = 120,
    max_episode_seconds: float | None = None,
    sensors: Sequence[str] = (FRONT,),
    lidar_config: Mapping[str, float] | None = None,
    trust_reward: bool = False,
) -> RaceWorld:
    """Return cars as Gymnasium's users describe them; arguments as for `DeepRacerEnv`.

    Raises:
        UserInputError: A track, file, action or setting that cannot be used.
    """
    if reward is None:
        paid: Reward | CarRewards = stay_near_the_centre
    elif callable(reward):
        paid = reward
    else:
        paid = open_reward(reward, is_trusted=trust_reward).copies(num_cars)
    return RaceWorld(
        load_track(track),
        _action_space(actions),
        paid,
        race_config=RaceConfig(car=car, max_episode_seconds=max_episode_seconds),
        camera_config=CameraConfig(width, height),
        num_cars=num_cars,
        sensors=car_sensors(sensors, lidar_config),
    )


def stay_near_the_centre(params: dict[str, Any]) -> float:
    """Return 1 on the centre line, falling to 0 at the border and beyond."""
    return max(0.0, 1.0 - 2.0 * params["distance_from_center"] / params["track_width"])


def _action_space(actions: Sequence[tuple[float, float]] | Mapping[str, tuple[float, float]] | None) -> ActionSpace:
    if actions is None:
        return action_space(default_model_metadata().actions)
    if isinstance(actions, Mapping):
        return _box(actions)
    for number, (degrees, speed) in enumerate(actions):
        _check(f"action {number}", degrees, speed)
    if len(actions) < 1:
        raise SettingError("actions is empty; expected at least one (degrees, m/s) pair.")
    return ActionTable.of([(math.radians(degrees), speed) for degrees, speed in actions])


def _box(ranges: Mapping[str, tuple[float, float]]) -> ActionBox:
    expected = 'expected {"steering_angle": (low, high), "speed": (low, high)} in degrees and m/s'
    if set(ranges) != {"steering_angle", "speed"} or any(len(ends) != 2 for ends in ranges.values()):
        raise SettingError("actions is {dict}; {expected}.", dict=dict(ranges), expected=expected)
    (right, left), (slow, fast) = ranges["steering_angle"], ranges["speed"]
    for name, degrees, speed in (("the low end of actions", right, slow), ("the high end of actions", left, fast)):
        _check(name, degrees, speed)
    if not (right < left and slow < fast):
        raise SettingError(
            "actions is {dict}; {expected}, each low below its high.", dict=dict(ranges), expected=expected
        )
    return ActionBox((math.radians(right), math.radians(left)), (float(slow), float(fast)))


def _check(name: str, degrees: float, speed: float) -> None:
    top = math.degrees(MAX_STEERING_RAD)
    if not (abs(degrees) <= top + 1e-9 and MIN_SPEED_MPS <= speed <= MAX_SPEED_MPS):
        raise SettingError(
            "{name} is ({degrees}, {speed}); expected -{top:g} to {top:g} degrees and {min_speed_mps:g} to "
            "{max_speed_mps:g} m/s.",
            name=name,
            degrees=degrees,
            speed=speed,
            top=top,
            min_speed_mps=MIN_SPEED_MPS,
            max_speed_mps=MAX_SPEED_MPS,
        )
