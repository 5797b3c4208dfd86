"""DeepRacer cars as a `World`: N worlds of M cars, each world on its own copy of the track.

What it is       1/18-scale cars with cameras and LiDAR on an AWS DeepRacer track: time trial, boxes or bots in the way
Acts             15 times a second: one of the action table's (steering, speed) pairs, or a pair within two ranges,
                 steering in rad, positive left, speed in m/s
Sees             one camera, uint8 grey (H, W), 160x120 or any smaller size by the same optics, of STEREO_CAMERAS
                 (H, W, 2); perhaps a LiDAR, float32; `sensors.py` has the names and what each is told;
                 track_state, float32, privileged: for a critic while training, never for a policy
Rewarded by      the user's reward_function(params); every key in `reward_params.py`
Begins           at rest on the centre line, nose along it; one prepare tick; each episode a little further round,
                 on an open track always at its start.
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
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from racecraft.contract.errors import ContractError
from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, WorldSpec
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionSpace, Commands, OwnActions
from racecraft.worlds.deepracer.env.camera import MOUNT_V3, Camera, CameraMount
from racecraft.worlds.deepracer.env.fidelity import habits
from racecraft.worlds.deepracer.env.kernels import race as kernels
from racecraft.worlds.deepracer.env.light import light_for
from racecraft.worlds.deepracer.env.numba_threads import PIXELS_A_THREAD, at_most
from racecraft.worlds.deepracer.env.objects import OBJECT_STATE, new_around, new_objects
from racecraft.worlds.deepracer.env.placing import plan_objects
from racecraft.worlds.deepracer.env.race_spec import world_spec
from racecraft.worlds.deepracer.env.randomisation import RandomisedCars
from racecraft.worlds.deepracer.env.reward_caller import CarRewards, RewardCaller, RewardFunction, require_rewards
from racecraft.worlds.deepracer.env.rules import first_starts, require_grid, rules_of
from racecraft.worlds.deepracer.env.scene import build_scene
from racecraft.worlds.deepracer.env.sensor_rendering import SensorRenderer, grey_weights
from racecraft.worlds.deepracer.env.sensors import FRONT_CAMERA, STEREO, MountedLidar, Sensors
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig, CameraConfig, RaceConfig, objects_in
from racecraft.worlds.deepracer.env.variation import VariationConfig
from racecraft.worlds.deepracer.env.vehicle import PROFILES, TICK_SECONDS, CarProfile
from racecraft.worlds.deepracer.tracks.track import Track


class RaceWorld:
    """N worlds of M cars on one track.

    Args:
        track: The circuit, in driving direction.
        actions: What a car can be told, or what each of them can.
        reward: Called once a car and tick, world by world and in a world in the order of its cars; one for all, or one
            for each car in that order, N * M of them, perhaps in a process of their own; None gives no reward.
        race_config: How episodes start and end.
        camera_config: Size of the frame.
        num_cars: N, the number of worlds; with one car in each, the number of cars.
        start_shares: Where each world's first car first starts, share of the lap, (N,); spread evenly by default.
            An open track is driven from its start; `move_starts` puts cars elsewhere on it.
        laps: An episode ends after so many complete laps; on an open track after one.
        mount: Where the camera sits.
        sensors: What every car sees with.
        cars_per_world: M.
        profiles: How each car of a world answers steering and throttle, (M,); by default all as RaceConfig.car says.
        objects: What stands or drives on the road besides; None: what RaceConfig.type has by default.
        variation: What differs from episode to episode.
        start_ahead: How far ahead of another car of its world a car starts again, m, or behind it where its own car is
            the faster one; 0: where its own next start lies.
        drive_seconds: A car that completes a lap drives on: the lap is truncated and the next episode begins at the
            finish, at speed, until so much simulated time after the last standing start. None: `laps` end an episode.

    Raises:
        SettingError: So many objects, or M cars, do not fit on the lap.
        ContractError: `start_shares` or `profiles` have the wrong length.
    """

    def __init__(
        self,
        track: Track,
        actions: ActionSpace | OwnActions,
        reward: RewardFunction | Sequence[RewardFunction] | CarRewards | None = None,
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
        drive_seconds: float | None = None,
    ) -> None:
        counted = track.as_filed() if race_config.waypoints == "as_filed" else track
        self.track = counted.reversed() if race_config.reverse else counted
        self.actions = actions
        require_rewards(reward, num_cars * cars_per_world)
        self.reward = reward
        self.drawn_track = track.reversed() if race_config.reverse else track
        """As `track`, with its waypoints as cameras draw them."""
        scene = build_scene(self.drawn_track, light_for(camera_config.light, race_config.car), camera_config.grass)
        self.camera = Camera(scene, camera_config.width, camera_config.height, mount)
        self.sensors = sensors
        self.habits = habits(race_config.fidelity)
        """Which of the original's bugs this world has."""
        self.reports = np.zeros((num_cars, cars_per_world), race.TICK_REPORT)
        """What was written down of every car in the tick just taken, TICK_REPORT (N, M)."""
        self._seeing = SensorRenderer(self.camera, sensors, self.habits, self.reports.shape)
        self._every_car = np.ones(self.reports.shape, bool)
        self._arrays = self.track.arrays()
        self.profiles = _profiles(profiles or [PROFILES[race_config.car]] * cars_per_world, self.reports.shape)
        """How each car answers steering and throttle, PROFILE (N, M); may be written to between ticks."""
        self._rules = rules_of(race_config, self.track, laps, start_ahead, drive_seconds)
        wanted = objects or objects_in(race_config.type)
        self._plan = plan_objects(self.track, wanted, self.habits, cars_per_world)
        self._objects = new_objects(self._plan, num_cars)
        self._varied = self._varied_cars(variation) if variation.is_on else None
        self.variation = None if self._varied is None else self._varied.drawn.copy()
        """What the episodes have drawn that the reports are of, (N, M), as `variation.DRAWN`; None: all are alike."""
        self._around = new_around(self._objects, cars_per_world)
        self._action_shape = (num_cars, cars_per_world, *actions.spec.shape)
        self._action_count = math.prod(self._action_shape)
        self._threads = num_cars * cars_per_world * self.camera.width * self.camera.height // PIXELS_A_THREAD
        self._paying = RewardCaller(self.track, race_config.reverse, self._plan, self._objects, self._around)
        self._start_shares = first_starts(self.track, start_shares, num_cars)
        require_grid(self.track, cars_per_world)
        self._cars = race.new_cars(self.track, cars_per_world, self._start_shares)
        self._parked = np.zeros(self._cars.shape, bool)
        self._keys = _keys(0, self._cars.shape)
        self._reward_sums = np.zeros(self._cars.shape)
        self._finished: list[EpisodeRecord] = []
        has_objects = wanted is not None or cars_per_world > 1
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
    def lidar(self) -> MountedLidar:
        """The LiDAR as it sits on every car; without one on board it is never asked."""
        return self._seeing.lidar

    @property
    def lidar_ranges(self) -> Array:
        """What each car's LiDAR read last, m, before it is told to the policy, float64 (N, M, 64); a copy."""
        return self._seeing.ranges.copy()

    @property
    def boxes(self) -> Array:
        """Boxes and bots as they stand now, (N, K, 6): x, y (m), yaw (rad), half length, half width, height (m)."""
        return self._objects.boxes.copy()

    @property
    def seen_boxes(self) -> Array:
        """As `boxes`, where they stood when the tick just taken was written down, (N, K, 6)."""
        return self._paying.seen_boxes

    @property
    def kinds(self) -> Array:
        """Which of `objects.KINDS` each of them is, int64 (N, K)."""
        return self._objects.kinds.copy()

    @property
    def has_bots(self) -> bool:
        """Whether objects of this world drive."""
        return self._plan.speed > 0.0

    @property
    def start_shares(self) -> Array:
        """Where each world's first car first starts, share of the lap (N,)."""
        return self._start_shares.copy()

    @property
    def track_lengths(self) -> Array:
        """Length of each world's centre line, m (N,)."""
        return np.full(self._spec.num_worlds, self.track.length)

    @property
    def has_reward(self) -> bool:
        """Whether a reward function is asked."""
        return self.reward is not None

    @property
    def episodes_started(self) -> int:
        """Episodes that all cars together have begun since `reset`, less the first of each."""
        return int(self._cars["episode"].sum())

    @property
    def next_start_share(self) -> float:
        """Where the next episode would start if the first car alone had driven every car's, share of the lap."""
        return float((self._start_shares[0] + self.episodes_started * self._rules.start_advance) % 1.0)

    def _varied_cars(self, variation: VariationConfig) -> RandomisedCars:
        """Return what every car sees and drives with, and let kernels take it instead of what is common to all."""
        varied = RandomisedCars(
            variation, self.camera, grey_weights(self.sensors), len(self.sensors.eyes_left_m), self.profiles,
            self._objects.kinds,
        )  # fmt: skip
        self._seeing.vary(varied)
        self._objects = self._objects._replace(paints=varied.paints)
        return varied

    def look_with(self, camera: Camera, sensors: Sensors, rows: Array) -> dict[str, Array]:
        """Return what cars see who carry another camera than this world's: (R, H, W), of two eyes (R, H, W, 2), uint8.

        Args:
            camera: Made with a scene of the same track.
            sensors: Which camera that is; of a LiDAR, see `look_around_with`.
            rows: Which cars, (R, 2): world and number in it.
        """
        return self._seeing.look_with(camera, sensors, self._around, self._cars, rows)

    def look_around_with(self, sensors: Sensors, rows: Array, ranges: Array) -> dict[str, Array]:
        """Return what cars are told who carry another LiDAR than this world's, (R, L) float32; nothing without one.

        Args:
            sensors: Which LiDAR that is.
            rows: Which cars, (R, 2): world and number in it.
            ranges: Their newest readings, float64 (R, 64), m: the caller's, for they stand until the next is due.
        """
        return self._seeing.look_around_with(sensors, self._objects, self._cars, rows, self._keys, ranges)

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
        kernels.place_on_grid(
            self._arrays, self._plan, self._objects, self._around, *self._seeing.sight, self._keys, self._cars,
            self._seeing.ranges, *self._seeing.views(buffers.observations),
        )  # fmt: skip
        self._show_frames(buffers)
        self._show_active(buffers)

    def freeze(self, rows: Array) -> None:
        """Carry cars (bool (N, M)) off the road until `begin_episodes` or `reset`: no tick, no report, no reward.

        Nobody meets them there. Their next start stays where it is, so that a car whose quota is full does not run
        ahead of the others.
        """
        self._parked[:] = self._cars["away"] = rows
        kernels.refresh_nearby(self._arrays, self._objects, self._cars, self._around)

    def take_part(self, rows: Array, come: Array, buffers: StepBuffers) -> None:
        """Let only these cars (bool (N, M)) drive on, the others wait off the road; those that come see anew."""
        self.freeze(~rows)
        self._look_again(come, buffers)
        self._show_frames(buffers)
        self._show_active(buffers)

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
                "{name}: actions {actions!r} are not {size} of {actions_2}: expected shape {action_shape}",
                name=self._spec.name,
                actions=actions,
                size=self._cars.size,
                actions_2=self.actions,
                action_shape=self._action_shape,
            )
        commands = self.as_reported(self.actions.commands(actions.reshape(self._action_shape)))
        self._paying.keep(is_asked=self.has_reward)
        with at_most(self._threads):
            kernels.tick(*self.of_a_tick(commands, buffers))
        buffers.terminated[:] = self.reports["terminated"]
        buffers.truncated[:] = self.reports["truncated"]
        if self._varied is not None:
            self._go_on_varied(self._varied, buffers)
        self._seeing.show_last(buffers.terminated | buffers.truncated, buffers.final_observations)
        self._show_frames(buffers)
        self._show_active(buffers)
        buffers.reward[:] = 0.0
        if self.reward is not None:
            self._paying.compute_rewards(self.reward, self.reports, buffers.reward)
        self._keep_episodes(buffers.reward)

    def as_reported(self, commands: Commands) -> Commands:
        """Return commands whose `chosen` is what rewards and traces see: at AWS as written, else as sent."""
        return commands if self.habits.commands_are_as_written else commands._replace(chosen=commands.sent)

    def of_a_tick(self, commands: Commands, buffers: StepBuffers) -> tuple[Any, ...]:
        """Return what `kernels/race.py` takes for a tick, in its order: for those who drive many in compiled code.

        Nothing is copied: what it writes is this world's, and what is seen is in the buffers.
        """
        varied = self._varied
        profiles, sent = (
            (self.profiles, commands.sent)
            if varied is None
            else (varied.profiles, varied.send(self._cars, commands.sent))
        )
        return (
            self._arrays, self._plan, self._objects, self._around, profiles, self._rules, *self._seeing.sight,
            commands.numbers, commands.chosen, sent, self._parked, self._keys, self._cars, self.reports,
            self._seeing.ranges,
            *self._seeing.views(buffers.observations), *self._seeing.last_views(buffers.final_observations),
        )  # fmt: skip

    @property
    def is_compiled_tick_enough(self) -> bool:
        """Whether a compiled tick is all of a step: one eye that sees what is there, and nobody who pays."""
        return self._varied is None and self.sensors.camera != STEREO and self.reward is None

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, oldest first."""
        finished, self._finished = self._finished, []
        return finished

    def save_state(self) -> dict[str, Array]:
        """Return every car, field by field, (N, M) each, and what its LiDAR last read."""
        state = {f"car.{name}": self._cars[name].copy() for name in race.CAR_STATE.names or ()}
        if self.sensors.lidar is not None:
            state["ranges"] = self._seeing.ranges.copy()
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
            self._seeing.ranges[:] = state["ranges"]
        if self._varied is not None:
            self._varied.load_state(state, self._cars["episode"])
        self._look_again(self._every_car, buffers)
        self._show_frames(buffers)
        self._show_active(buffers)

    def close(self) -> None:
        """Nothing is held open."""

    def _show_active(self, buffers: StepBuffers) -> None:
        buffers.active[:] = self.habits.prepare_is_learned | ~self._cars["preparing"]

    def _look_again(self, rows: Array, buffers: StepBuffers) -> None:
        kernels.look_again(
            self._arrays, self._objects, self._around, *self._seeing.sight, rows, self._cars, self._seeing.ranges,
            *self._seeing.views(buffers.observations),
        )  # fmt: skip

    def _go_on_varied(self, varied: RandomisedCars, buffers: StepBuffers) -> None:
        """Let cars whose episode ended go into the next with what that one draws."""
        assert self.variation is not None
        self.variation[:] = varied.drawn
        ended = self.reports["terminated"] | self.reports["truncated"]
        if ended.any():
            varied.show(self._cars, ended, self._seeing.last_views(buffers.final_observations)[0], is_last=True)
            varied.begin(ended, self._cars["episode"])
            self._look_again(ended, buffers)

    def _show_frames(self, buffers: StepBuffers) -> None:
        """Turn what cameras should have seen into what they show, where episodes differ, and bring it to the policy."""
        if self._varied is not None:
            self._varied.show(self._cars, self._every_car, self._seeing.views(buffers.observations)[0])
        self._seeing.show(buffers.observations)

    def record(self, world: int, agent: int, reward: float = 0.0) -> EpisodeRecord:
        """Return what the episode of a car came to that ended in the tick just taken."""
        report = self.reports[world, agent]
        steps = int(report["steps"])
        return EpisodeRecord(
            world=world,
            agent=agent,
            steps=steps,
            reward=reward,
            status=race.TRUNCATED
            if report["truncated"] and report["status"] != race.LAP_COMPLETE
            else race.STATUSES[report["status"]],
            facts={
                "progress_percent": float(report["progress"]),
                "lap_seconds": float(report["lap_seconds"]) if report["status"] == race.LAP_COMPLETE else math.nan,
                "seconds": steps * TICK_SECONDS,
            },
        )

    def _keep_episodes(self, rewards: Array) -> None:
        self._reward_sums += rewards
        for n, m in zip(*np.nonzero(self.reports["terminated"] | self.reports["truncated"]), strict=True):
            self._finished.append(self.record(int(n), int(m), float(self._reward_sums[n, m])))
            self._reward_sums[n, m] = 0.0


def _keys(seed: int, shape: tuple[int, ...]) -> Array:
    """Return each car's stream of chance, uint64 (N, M), which depends on no other world and no other car."""
    worlds, cars = shape
    purposes = ["ticks of a car", *(f"ticks of car {m}" for m in range(1, cars))]
    return np.column_stack([stream_keys(seed, purpose, worlds) for purpose in purposes])


def _object_keys(seed: int, num_worlds: int) -> Array:
    """Return each world's streams of chance for its objects, uint64 (N, 2): their places, their changes of lanes."""
    return np.column_stack([stream_keys(seed, what, num_worlds) for what in ("places of objects", "lanes of bots")])


def _profiles(profiles: Sequence[CarProfile], shape: tuple[int, ...]) -> Array:
    if len(profiles) != shape[1]:
        raise ContractError(
            "{count} profiles for {shape} cars a world; expected one for each", count=len(profiles), shape=shape[1]
        )
    return np.tile(race.car_profiles(profiles), (shape[0], 1))
