"""DeepRacer cars as a `World`: N worlds of M cars, each world on its own copy of the track.

What it is       1/18-scale cars with cameras and LiDAR on an AWS DeepRacer track: time trial, boxes or bots in the way
Acts             15 times a second: one of the action table's (steering, speed) pairs, or a pair within two ranges,
                 steering in rad, positive left, speed in m/s
Sees             one camera, uint8 grey (H, W), 160x120 or any smaller size by the same optics, of STEREO_CAMERAS
                 (H, W, 2); perhaps a LiDAR, float32; `sensors.py` has the names and what each is told;
                 track_state, float32, privileged: for a critic while training, never for a policy
Rewarded by      the user's reward_function(params); every key in `reward_params.py`
Begins           at rest on the centre line, nose along it; one prepare tick; each episode a little further round.
                 Several cars of a world begin in two lanes, 0.75 m behind one another, and never within each other
Meets            the other cars of its world: they are in its camera and its LiDAR, in the object keys of its reward
                 behind boxes and bots, and a car that runs into one has crashed; the one ahead drives on
Terminates       lap complete, crashed into an object or a car, off track (all four wheels), immobilised, reversed
Truncates        after RaceConfig.max_episode_seconds of simulated time a lap
Settings         RaceConfig, CameraConfig, VariationConfig
Departs from AWS as `fidelity.py` says line by line: RaceConfig.fidelity `aws` brings the original's habits back
Exactness        same seed and actions, same bits, whatever the threads; N worlds equal each alone
Leaves out       what a collision does to the bodies: who is hit drives on as if nothing had been
Sources          simapp 6.0.5 (Apache-2.0) as measured in the project's facts; vehicle fitted to real logs
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from racecraft.contract.errors import ContractError
from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import Array, ArraySpec, EpisodeRecord, StepBuffers, WorldSpec
from racecraft.envs.deepracer import race
from racecraft.envs.deepracer.actions import ActionSpace, OwnActions
from racecraft.envs.deepracer.camera import MOUNT_V1, MOUNT_V2, MOUNT_V3, Camera, CameraMount
from racecraft.envs.deepracer.fidelity import habits
from racecraft.envs.deepracer.kernels import lidar as lidar_kernels
from racecraft.envs.deepracer.kernels import race as kernels
from racecraft.envs.deepracer.kernels import sight
from racecraft.envs.deepracer.kernels.eyes import join_eyes
from racecraft.envs.deepracer.light import light_for
from racecraft.envs.deepracer.objects import OBJECT_STATE, new_around, new_objects
from racecraft.envs.deepracer.placing import plan_objects
from racecraft.envs.deepracer.reward_params import ObjectReports, RewardParams
from racecraft.envs.deepracer.rules import first_starts, require_grid, rules_of
from racecraft.envs.deepracer.scene import GREY_WEIGHTS, build_scene
from racecraft.envs.deepracer.sensors import (
    AWS_HERTZ,
    FRONT,
    FRONT_CAMERA,
    LIDAR_NOISE_M,
    STEREO,
    STEREO_GREY_WEIGHTS,
    MountedLidar,
    Sensors,
    mounted_lidar,
)
from racecraft.envs.deepracer.settings import BotsConfig, BoxesConfig, CameraConfig, RaceConfig, objects_in
from racecraft.envs.deepracer.variation import VariationConfig
from racecraft.envs.deepracer.varied_cars import VariedCars, plain_optics
from racecraft.envs.deepracer.vehicle import PROFILES, TICK_SECONDS, TICKS_PER_SECOND, CarProfile
from racecraft.formats.aws.lidar_config import BEAMS
from racecraft.tracks.track import Track

CAMERA_NAME = FRONT
CRITIC_NAME = "track_state"
EYE_PAIR = np.dtype("<u2")
"""Two eyes' grey levels of one pixel, left before right in memory, as one number."""

RewardFunction = Callable[[dict[str, Any]], float]


class RaceWorld:
    """N worlds of M cars on one track.

    Args:
        track: The circuit, in driving direction.
        actions: What a car can be told, or what each of them can.
        reward: Called once a car and tick, world by world and in a world in the order of its cars; one for all, or one
            for each car in that order, N * M of them; None gives no reward.
        race_config: How episodes start and end.
        camera_config: Size of the frame.
        num_cars: N, the number of worlds; with one car in each, the number of cars.
        start_shares: Where each world's first car first starts, share of the lap, (N,); spread evenly by default.
        laps: An episode ends after so many complete laps.
        mount: Where the camera sits.
        sensors: What every car sees with.
        cars_per_world: M.
        profiles: How each car of a world answers steering and throttle, (M,); by default all as RaceConfig.car says.
        objects: What stands or drives on the road besides; None: what RaceConfig.type has by default.
        variation: What differs from episode to episode.
        start_ahead: How far ahead of another car of its world a car starts again, m, or behind it where its own car is
            the faster one; 0: where its own next start lies.

    Raises:
        SettingError: So many objects, or M cars, do not fit on the lap.
        ContractError: `start_shares` or `profiles` have the wrong length.
    """

    def __init__(
        self,
        track: Track,
        actions: ActionSpace | OwnActions,
        reward: RewardFunction | Sequence[RewardFunction] | None = None,
        *,
        race_config: RaceConfig = RaceConfig(),  # noqa: B008 (frozen)
        camera_config: CameraConfig = CameraConfig(),  # noqa: B008 (frozen)
        num_cars: int = 1,
        start_shares: Sequence[float] | Array | None = None,
        laps: int = 1,
        mount: CameraMount = MOUNT_V3,
        sensors: Sensors = FRONT_CAMERA,
        cars_per_world: int = 1,
        profiles: Sequence[CarProfile] | None = None,
        objects: BoxesConfig | BotsConfig | None = None,
        variation: VariationConfig = VariationConfig(),  # noqa: B008 (frozen)
        start_ahead: float = 0.0,
    ) -> None:
        counted = track.as_filed() if race_config.waypoints == "as_filed" else track
        self.track = counted.reversed() if race_config.reverse else counted
        self.actions = actions
        _require_rewards(reward, num_cars * cars_per_world)
        self.reward = reward
        self.drawn_track = track.reversed() if race_config.reverse else track
        """As `track`, with its waypoints as cameras draw them."""
        scene = build_scene(self.drawn_track, light_for(camera_config.light, race_config.car), camera_config.grass)
        self.camera = Camera(scene, camera_config.width, camera_config.height, mount)
        self.reports = np.zeros((num_cars, cars_per_world), race.TICK_REPORT)
        """What was written down of every car in the tick just taken, TICK_REPORT (N, M)."""
        self.sensors = sensors
        self._ranges = np.zeros((*self.reports.shape, BEAMS))
        self._no_lidar = np.zeros((*self.reports.shape, 0), np.float32)
        self._every_car = np.ones(self.reports.shape, bool)
        self._frames, self._last_frames = (self._room_for_eyes() for _ in range(2))
        self._arrays = self.track.arrays()
        self.profiles = _profiles(profiles or [PROFILES[race_config.car]] * cars_per_world, self.reports.shape)
        """How each car answers steering and throttle, PROFILE (N, M); may be written to between ticks."""
        self.habits = habits(race_config.fidelity)
        """Which of the original's bugs this world has."""
        self.lidar = self._mounted(sensors)
        """The LiDAR as it sits on every car; without one on board it is never asked."""
        self._rules = rules_of(race_config, self.track.length, laps, start_ahead)
        asked = objects or objects_in(race_config.type)
        self._plan = plan_objects(self.track, asked, self.habits, cars_per_world)
        self._objects = new_objects(self._plan, num_cars)
        self._palettes = np.tile(self.camera.scene.palette @ _grey_weights(sensors), (*self.reports.shape, 1))
        self._sight = (scene, plain_optics(self.camera, self.reports.shape), sensors.eyes_left_m, self.lidar)
        self._varied = self._varied_cars(variation) if variation.is_on else None
        self.variation = None if self._varied is None else self._varied.drawn.copy()
        """What the episodes have drawn that the reports are of, (N, M), as `variation.DRAWN`; None: all are alike."""
        self._around = new_around(self._objects, cars_per_world)
        self._action_shape = (num_cars, cars_per_world, *actions.spec.shape)
        self._action_count = math.prod(self._action_shape)
        self.seen_objects = np.zeros(self._objects.boxes.shape[:2], OBJECT_STATE)
        """How objects stood when the tick just taken was written down, OBJECT_STATE (N, K)."""
        self.seen_boxes = np.zeros_like(self._objects.boxes)
        """And where, (N, K, 6), as `boxes`."""
        self._told = [part.copy() for part in self._found]
        """And what each car then found around it: boxes, states and how many of them count, as in `Around`."""
        self._params = RewardParams(self.track, race_config.reverse)
        self._start_shares = first_starts(start_shares, num_cars)
        require_grid(self.track, cars_per_world)
        self._cars = race.new_cars(self.track, cars_per_world, self._start_shares)
        self._parked = np.zeros(self._cars.shape, bool)
        self._keys = _keys(0, self._cars.shape)
        self._reward_sums = np.zeros(self._cars.shape)
        self._finished: list[EpisodeRecord] = []
        has_objects = asked is not None or cars_per_world > 1
        self._spec = world_spec(
            actions, camera_config, num_cars, f"DeepRacer {track.name}", cars_per_world, sensors, has_objects
        )

    @property
    def spec(self) -> WorldSpec:
        """The shape of this world's promise."""
        return self._spec

    @property
    def cars(self) -> Array:
        """The cars as they stand now, CAR_STATE (N, M); a copy."""
        return self._cars.copy()

    @property
    def lidar_ranges(self) -> Array:
        """What each car's LiDAR read last, m, before it is told to the policy, float64 (N, M, 64); a copy."""
        return self._ranges.copy()

    @property
    def boxes(self) -> Array:
        """Boxes and bots as they stand now, (N, K, 6): x, y (m), yaw (rad), half length, half width, height (m)."""
        return self._objects.boxes.copy()

    @property
    def kinds(self) -> Array:
        """Which of `objects.KINDS` each of them is, int64 (N, K)."""
        return self._objects.kinds.copy()

    @property
    def start_shares(self) -> Array:
        """Where each world's first car first starts, share of the lap (N,)."""
        return self._start_shares.copy()

    @property
    def track_lengths(self) -> Array:
        """Length of each world's centre line, m (N,)."""
        return np.full(self._spec.num_worlds, self.track.length)

    @property
    def is_paid(self) -> bool:
        """Whether a reward function is asked."""
        return self.reward is not None

    @property
    def episodes_begun(self) -> int:
        """Episodes that all cars together have begun since `reset`, less the first of each."""
        return int(self._cars["episode"].sum())

    @property
    def next_start_share(self) -> float:
        """Where the next episode would start if the first car alone had driven every car's, share of the lap."""
        return float((self._start_shares[0] + self.episodes_begun * self._rules.start_advance) % 1.0)

    def _varied_cars(self, variation: VariationConfig) -> VariedCars:
        """Return what every car sees and drives with, and let kernels take it instead of what is common to all."""
        varied = VariedCars(
            variation, self.camera, _grey_weights(self.sensors), len(self.sensors.eyes_left_m), self.profiles,
            self._objects.kinds,
        )  # fmt: skip
        self._palettes = varied.palettes
        self._sight = (self._sight[0], varied.optics, *self._sight[2:])
        self._objects = self._objects._replace(paints=varied.paints)
        return varied

    def look_with(self, camera: Camera, sensors: Sensors, rows: Array) -> dict[str, Array]:
        """Return what cars see who carry another camera than this world's: (R, H, W), of two eyes (R, H, W, 2), uint8.

        Args:
            camera: Made with a scene of the same track.
            sensors: Which camera that is; of a LiDAR, see `look_around_with`.
            rows: Which cars, (R, 2): world and number in it.
        """
        frames = np.empty((len(rows), len(sensors.eyes_left_m), camera.height, camera.width), np.uint8)
        palette = camera.scene.palette @ _grey_weights(sensors)
        around, eyes = self._around, sensors.eyes_left_m
        sight.look_with(camera.scene, camera.optics, eyes, palette, around, self._cars, rows, frames)
        if sensors.camera != STEREO:
            return {sensors.camera_name: frames[:, 0]}
        both = np.empty((len(rows), 1, camera.height, camera.width, 2), np.uint8)
        join_eyes(frames[:, None], np.ones((len(rows), 1), bool), both.view(EYE_PAIR)[..., 0])
        return {STEREO: both[:, 0]}

    def look_around_with(self, sensors: Sensors, rows: Array, ranges: Array) -> dict[str, Array]:
        """Return what cars are told who carry another LiDAR than this world's, (R, L) float32; nothing without one.

        Args:
            sensors: Which LiDAR that is.
            rows: Which cars, (R, 2): world and number in it.
            ranges: Their newest readings, float64 (R, 64), m: the caller's, for they stand until the next is due.
        """
        if sensors.lidar is None:
            return {}
        told = np.zeros((len(rows), *sensors.lidar.spec.shape), np.float32)
        scene, lidar = self.camera.scene, self._mounted(sensors)
        lidar_kernels.look_around_with(lidar, scene, self._objects, self._cars, rows, self._keys, ranges, told)
        return {sensors.lidar.name: told}

    def move_starts(self, start_shares: Sequence[float] | Array) -> None:
        """Let the next `reset` line the cars up elsewhere: shares of the lap, (N,)."""
        self._start_shares = np.array(start_shares, float)

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Line every car up at its first start; `seed` is of what chance does to them, where it does."""
        self._keys = _keys(seed, self._cars.shape)
        if self._objects.kinds.size:
            self._objects.states["changes"] = 0
            self._objects.keys[:] = _object_keys(seed, self._spec.num_worlds)
        self._cars = race.new_cars(self.track, self._spec.num_agents, self._start_shares)
        if self._varied is not None:
            self._varied.seed(seed)
        self.begin_episodes(buffers)

    def begin_episodes(self, buffers: StepBuffers) -> None:
        """Put every car at the start of its episode; one that was under way is driven again from its start."""
        self._parked[:] = False
        self._reward_sums[:] = 0.0
        self._finished.clear()
        if self._varied is not None:
            self._varied.begin(self._every_car, self._cars["episode"])
        kernels.line_up(
            self._arrays, self._plan, self._objects, self._around, *self._sight, self._palettes, self._keys,
            self._cars, self._ranges, *self._views(buffers.observations, self._frames),
        )  # fmt: skip
        self._disturb(self._every_car, buffers.observations, self._frames)
        self._join_eyes(self._frames, self._every_car, buffers.observations)
        self._show_active(buffers)

    def park(self, rows: Array) -> None:
        """Carry cars (bool (N, M)) off the road until `begin_episodes` or `reset`: no tick, no report, no reward.

        Nobody meets them there. Their next start stays where it is, so that a car whose quota is full does not run
        ahead of the others.
        """
        self._parked[:] = self._cars["away"] = rows
        kernels.settle(self._arrays, self._objects, self._cars, self._around)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Advance every car by one tick; see `race.py` for the order of acts.

        Args:
            actions: Choices (N, M) of a table, or float32 (N, M, 2) within a box's ranges.
            buffers: Written in place.

        Raises:
            ContractError: `actions` are not one action for every car.
            RewardError: The user's reward function failed; cars and buffers then stand as after the tick, without the
                rewards from the failing car on.
        """
        actions = np.asarray(actions)
        if actions.size != self._action_count:
            raise ContractError(
                f"{self._spec.name}: actions {actions!r} are not {self._cars.size} of {self.actions}: "
                f"expected shape {self._action_shape}"
            )
        told = self.actions.commands(actions.reshape(self._action_shape))
        if self._objects.kinds.size:
            self.seen_objects[:], self.seen_boxes[:] = self._objects.states, self._objects.boxes
        if self._spec.num_agents > 1 and self.reward is not None:
            for kept, found in zip(self._told, self._found, strict=True):
                kept[:] = found
        varied = self._varied
        profiles, sent = (
            (self.profiles, told.sent) if varied is None else (varied.profiles, varied.send(self._cars, told.sent))
        )
        kernels.tick(
            self._arrays, self._plan, self._objects, self._around, profiles, self._rules, *self._sight, self._palettes,
            told.numbers, told.chosen, sent, self._parked, self._keys, self._cars, self.reports, self._ranges,
            *self._views(buffers.observations, self._frames),
            *self._views(buffers.final_observations, self._last_frames),
        )  # fmt: skip
        buffers.terminated[:] = self.reports["terminated"]
        buffers.truncated[:] = self.reports["truncated"]
        if varied is not None:
            self._show_varied(varied, buffers)
        self._join_eyes(self._frames, self._every_car, buffers.observations)
        self._join_eyes(self._last_frames, buffers.terminated | buffers.truncated, buffers.final_observations)
        self._show_active(buffers)
        buffers.reward[:] = 0.0
        if self.reward is not None:
            self._call_reward(buffers.reward)
        self._keep_episodes(buffers.reward)

    def take_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, oldest first."""
        finished, self._finished = self._finished, []
        return finished

    def save_state(self) -> dict[str, Array]:
        """Return every car, field by field, (N, M) each, and what its LiDAR last read."""
        state = {f"car.{name}": self._cars[name].copy() for name in race.CAR_STATE.names or ()}
        if self.sensors.lidar is not None:
            state["ranges"] = self._ranges.copy()
        if self._objects.kinds.size:
            state["object.boxes"], state["object.keys"] = self._objects.boxes.copy(), self._objects.keys.copy()
            for name in OBJECT_STATE.names or ():
                state[f"object.{name}"] = self._objects.states[name].copy()
        if self._varied is not None:
            state |= self._varied.save_state()
        return {**state, "reward_sums": self._reward_sums.copy(), "keys": self._keys.copy()}

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state; what the cars see is drawn again."""
        for name in race.CAR_STATE.names or ():
            if f"car.{name}" in state:  # a race saved before cars had lanes to start in does not name them
                self._cars[name] = state[f"car.{name}"].reshape(self._cars.shape)
        if "keys" in state:  # one saved before chance had a hand in it has none
            self._keys = state["keys"].reshape(self._cars.shape).copy()
        if self._objects.kinds.size:
            self._objects.boxes[:], self._objects.keys[:] = state["object.boxes"], state["object.keys"]
            for name in OBJECT_STATE.names or ():
                if f"object.{name}" in state:
                    self._objects.states[name] = state[f"object.{name}"]
        self._parked[:] = self._cars["away"] = False
        self._reward_sums[:] = state["reward_sums"].reshape(self._cars.shape)
        self._finished.clear()
        if self.sensors.lidar is not None:
            self._ranges[:] = state["ranges"]
        if self._varied is not None:
            self._varied.load_state(state, self._cars["episode"])
        self._look_again(self._every_car, buffers)
        self._disturb(self._every_car, buffers.observations, self._frames)
        self._join_eyes(self._frames, self._every_car, buffers.observations)
        self._show_active(buffers)

    def close(self) -> None:
        """Nothing is held open."""

    def _show_active(self, buffers: StepBuffers) -> None:
        buffers.active[:] = self.habits.prepare_is_learned | ~self._cars["preparing"]

    def _look_again(self, rows: Array, buffers: StepBuffers) -> None:
        kernels.look_again(
            self._arrays, self._objects, self._around, *self._sight, self._palettes, rows, self._cars, self._ranges,
            *self._views(buffers.observations, self._frames),
        )  # fmt: skip

    def _show_varied(self, varied: VariedCars, buffers: StepBuffers) -> None:
        """Disturb what was seen; cars whose episode ended go into the next with what that one draws."""
        assert self.variation is not None
        self.variation[:] = varied.drawn
        ended = self.reports["terminated"] | self.reports["truncated"]
        if ended.any():
            self._disturb(ended, buffers.final_observations, self._last_frames, is_last=True)
            varied.begin(ended, self._cars["episode"])
            self._look_again(ended, buffers)
        self._disturb(self._every_car, buffers.observations, self._frames)

    def _disturb(self, rows: Array, observations: Mapping[str, Array], own: Array, is_last: bool = False) -> None:
        """Turn what cameras should have seen into what they show; nothing where all episodes are alike."""
        if self._varied is not None:
            frames, _, _ = self._views(observations, own)
            self._varied.show(self._cars, rows, frames, is_last)

    def _views(self, observations: Mapping[str, Array], own: Array) -> tuple[Array, Array, Array]:
        """Return what kernels write: frames (N, M, E, H, W), the critic's numbers, what the LiDAR tells.

        One eye is drawn where its observation lies; two are drawn into a room of our `own`, see `_join_eyes`.
        """
        lidar = self.sensors.lidar
        frames = own if self.sensors.camera == STEREO else observations[self.sensors.camera_name][:, :, None]
        return frames, observations[CRITIC_NAME], self._no_lidar if lidar is None else observations[lidar.name]

    def _room_for_eyes(self) -> Array:
        """Return room for the frames of two eyes, (N, M, 2, H, W); one eye needs none."""
        count = 2 if self.sensors.camera == STEREO else 0
        return np.zeros((*self.reports.shape, count, self.camera.height, self.camera.width), np.uint8)

    def _join_eyes(self, own: Array, cars: Array, observations: Mapping[str, Array]) -> None:
        """Show the frames of two eyes as one of two channels, for cars (bool (N, M))."""
        if self.sensors.camera == STEREO:
            join_eyes(own, cars, observations[STEREO].view(EYE_PAIR)[..., 0])

    def _mounted(self, sensors: Sensors) -> MountedLidar:
        return mounted_lidar(
            sensors.lidar,
            backward=self.habits.lidar_faces_backward,
            hertz=AWS_HERTZ if self.habits.lidar_is_slow else round(TICKS_PER_SECOND),
            noise=LIDAR_NOISE_M if self.habits.lidar_is_noisy else 0.0,
        )

    def _call_reward(self, rewards: Array) -> None:
        assert self.reward is not None
        reports, paid = self.reports.reshape(-1), rewards.flat
        called = ~np.isin(reports["status"], (race.PREPARE, race.PARK, race.PAUSE))
        of_car = [self.reward] * called.size if callable(self.reward) else self.reward
        objects = self._object_reports() if self._around.kinds.size else None
        cars = np.flatnonzero(called)
        for car, params in zip(cars.tolist(), self._params.of(reports[called], objects, cars), strict=True):
            paid[car] = of_car[car](params)

    @property
    def _found(self) -> tuple[Array, Array, Array]:
        """What each car finds around it now: boxes, states and how many of them count."""
        return self._around.boxes, self._around.states, self._around.counts

    def _object_reports(self) -> ObjectReports:
        drive = bool(self._plan.knots.size)
        count = len(self._plan.kinds)
        if self._spec.num_agents == 1:
            return ObjectReports(self.seen_boxes, self.seen_objects, count, drive, self._plan.speed)
        boxes, states, counts = (told.reshape(-1, *told.shape[2:]) for told in self._told)
        return ObjectReports(boxes, states, count, drive, self._plan.speed, counts)

    def _keep_episodes(self, rewards: Array) -> None:
        self._reward_sums += rewards
        for n, m in zip(*np.nonzero(self.reports["terminated"] | self.reports["truncated"]), strict=True):
            report = self.reports[n, m]
            lap_seconds = float(report["lap_seconds"]) if report["status"] == race.LAP_COMPLETE else float("nan")
            steps = int(report["steps"])
            self._finished.append(
                EpisodeRecord(
                    world=int(n),
                    agent=int(m),
                    steps=steps,
                    reward=float(self._reward_sums[n, m]),
                    status="truncated" if report["truncated"] else race.STATUSES[report["status"]],
                    facts={
                        "progress_percent": float(report["progress"]),
                        "lap_seconds": lap_seconds,
                        "seconds": steps * TICK_SECONDS,
                    },
                )
            )
            self._reward_sums[n, m] = 0.0


def world_spec(
    actions: ActionSpace | OwnActions,
    camera_config: CameraConfig,
    num_cars: int = 1,
    name: str = "DeepRacer",
    cars_per_world: int = 1,
    sensors: Sensors = FRONT_CAMERA,
    has_objects: bool = False,
) -> WorldSpec:
    """Return the promise of a race world; the same on every track."""
    critic_numbers = race.CRITIC_NUMBERS + (race.CRITIC_OBJECT_NUMBERS if has_objects else 0)
    return WorldSpec(
        name=name,
        num_worlds=num_cars,
        num_agents=cars_per_world,
        observations={
            **sensors.specs(camera_config.width, camera_config.height),
            CRITIC_NAME: ArraySpec(
                (critic_numbers,), np.float32, privileged=True, doc="Place, speed and the road ahead."
            ),
        },
        actions=actions.spec,
        tick_seconds=TICK_SECONDS,
    )


def told_of_objects(spec: WorldSpec) -> WorldSpec:
    """Return a race world's promise with a critic that is told of objects, too."""
    told = replace(spec.observations[CRITIC_NAME], shape=(race.CRITIC_NUMBERS + race.CRITIC_OBJECT_NUMBERS,))
    return replace(spec, observations={**spec.observations, CRITIC_NAME: told})


def _grey_weights(sensors: Sensors) -> Array:
    """Return the weights (3,) of red, green and blue in the grey level that this camera tells."""
    return STEREO_GREY_WEIGHTS if sensors.camera == STEREO else GREY_WEIGHTS


def _keys(seed: int, shape: tuple[int, ...]) -> Array:
    """Return each car's stream of chance, uint64 (N, M), which depends on no other world and no other car."""
    worlds, cars = shape
    purposes = ["ticks of a car", *(f"ticks of car {m}" for m in range(1, cars))]
    return np.column_stack([stream_keys(seed, purpose, worlds) for purpose in purposes])


def _object_keys(seed: int, num_worlds: int) -> Array:
    """Return each world's streams of chance for its objects, uint64 (N, 2): their places, their changes of lanes."""
    return np.column_stack([stream_keys(seed, what, num_worlds) for what in ("places of objects", "lanes of bots")])


def _require_rewards(reward: RewardFunction | Sequence[RewardFunction] | None, cars: int) -> None:
    if isinstance(reward, Sequence) and len(reward) != cars:
        raise ContractError(f"{len(reward)} reward functions were given; expected one for all or {cars}")


def _profiles(profiles: Sequence[CarProfile], shape: tuple[int, ...]) -> Array:
    if len(profiles) != shape[1]:
        raise ContractError(f"{len(profiles)} profiles for {shape[1]} cars a world; expected one for each")
    return np.tile(race.car_profiles(profiles), (shape[0], 1))


def mount_for_version(version: str | None) -> CameraMount:
    """Return where the camera sits on cars of a metadata version: 1 and 2 each carry a mount of their own."""
    if version is None or float(version) >= 3:
        return MOUNT_V3
    return MOUNT_V2 if float(version) >= 2 else MOUNT_V1
