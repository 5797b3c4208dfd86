"""A car's run folder for tests: driven by chance, kept by the real recorder, and never trained. See `make_run`."""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import allocate
from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.env.actions import action_space
from racecraft.worlds.deepracer.env.multi_course import MultiCourseWorld
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.model_metadata import action_space_from_aws
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.recorder import EpisodeRecorder

ACTIONS = [{"steering_angle": angle, "speed": 2.0, "index": k} for k, angle in enumerate((-20.0, 0.0, 20.0))]
RACE, CAMERA = RaceConfig(), CameraConfig(width=16, height=12)


def make_world(worlds=3, cars=1, track="reinvent_base", race=RACE, objects=None):
    """Return a race world of the run's cars, without a reward."""
    return RaceWorld(
        load_track(track),
        action_space(action_space_from_aws(ACTIONS)),
        race_config=race,
        camera_config=CAMERA,
        num_cars=worlds,
        cars_per_world=cars,
        objects=objects,
    )


BOXES, BOTS = RaceConfig(type="OBJECT_AVOIDANCE"), RaceConfig(type="HEAD_TO_BOT", reverse=True)
COURSES = [
    ("reinvent_base", {"race": {"type": "TIME_TRIAL"}}, 2),
    ("Oval_track", {"race": {"type": "OBJECT_AVOIDANCE"}, "boxes": {"number": 3}}, 2),
    ("Oval_track", {"race": {"type": "HEAD_TO_BOT", "reverse": True}, "bots": {"number": 2, "speed": 1.0}}, 1),
]
"""Track, settings and cars of each course of a run on several."""


def make_courses():
    """Return the world of a run on several courses."""
    return MultiCourseWorld(
        [
            make_world(2),
            make_world(2, 1, "Oval_track", BOXES, BoxesConfig(number=3)),
            make_world(1, 1, "Oval_track", BOTS, BotsConfig(number=2, speed=1.0)),
        ]
    )


def drive(world, ticks, observers, seed=0, buffers=None):
    """Drive by chance; return the buffers, to go on with."""
    dice = np.random.default_rng(seed)
    if buffers is None:
        buffers = allocate(world.spec)
        world.reset(buffers, seed)
    for _ in range(ticks):
        actions = dice.integers(0, 3, buffers.reward.shape)
        world.step(actions, buffers)
        for observe in observers:
            observe(world, buffers, actions)
    return buffers


def make_run(path, iterations=3, ticks=40, worlds=3, cars=1, several=False):
    """Make a run folder with so many kept iterations of so many ticks; `several`: on COURSES."""
    job = {
        "kind": "deepracer",
        "title": "re:Invent 2018, car v6",
        "algorithm": "ppo",
        "asked": {"track": "reinvent_base", "stops": ["minutes=1"]},
        "track": {"name": "reinvent_base", "copy": None},
        "model_metadata": {"action_space": ACTIONS, "version": "5"},
        "settings": {"race": {"car": RACE.car}, "camera": {"width": 16, "height": 12}},
        "seed": 1,
    }
    if several:
        told = [(load_track(track), settings, count) for track, settings, count in COURSES]
        job["courses"] = [{"track": t.name, "hash": t.hash(), "settings": s, "cars": count} for t, s, count in told]
        job["settings"]["rollout"] = {"num_worlds": sum(count for *_, count in COURSES)}
    run = RunFolder.create(path, job)
    world, recorder, buffers = make_courses() if several else make_world(worlds, cars), EpisodeRecorder(), None
    for iteration in range(1, iterations + 1):
        buffers = drive(world, ticks, [recorder], iteration, buffers)
        write_episodes(run.episodes / f"{iteration}.parquet", recorder.pop(iteration))
        score = 50.0 + iteration if iteration % 2 else None
        run.append_metrics(
            {
                "iteration": iteration,
                "steps": iteration * ticks * worlds,
                "seconds": float(iteration),
                "steps_per_second": 120.0,
                "mean_reward": float(iteration),
                "training_score": 10.0 * iteration,
                "evaluation_score": score,
                "best_lap_seconds": None,
                "entropy": 1.0,
            }
        )
    return run
