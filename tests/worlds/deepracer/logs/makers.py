"""Logs made up for tests: cars that follow the centre line, laid out as each tool lays out its files."""

from __future__ import annotations

import tarfile

import numpy as np

from racecraft.worlds.deepracer.files.sim_trace import sim_trace_text, write_sim_trace
from racecraft.worlds.deepracer.files.simulation_log import episode_line, trace_lines
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ((-0.5, 1.0), (0.0, 2.0), (0.5, 1.0))
"""Steering in rad and speed in m/s of the made-up car."""


def episode(number, share=0.3, ticks=12, start_s=10.0, status="off_track", track=None, reward=1.0, continuous=False):
    """Return AWS's columns of one episode that covers a share of the lap on the centre line."""
    track = track or load_track("reinvent_base")
    arc = np.linspace(0.0, share * track.length, ticks)
    at = np.minimum(arc, track.length - 1e-9)
    x, y = (np.interp(at, track.arc, track.centre[:, k]) for k in (0, 1))
    ahead = [np.interp((at + 0.01) % track.length, track.arc, track.centre[:, k]) for k in (0, 1)]
    action = np.arange(ticks) % len(ACTIONS)
    statuses = ["prepare", *["in_progress"] * (ticks - 2), status]
    rewards = np.full(ticks, reward)
    rewards[0] = 0.0
    return {
        "episode": np.full(ticks, number), "steps": np.arange(1.0, ticks + 1), "X": x, "Y": y,
        "yaw": np.degrees(np.arctan2(ahead[1] - y, ahead[0] - x)),
        "steer": np.degrees([ACTIONS[a][0] for a in action]), "throttle": np.array([ACTIONS[a][1] for a in action]),
        "action": np.full(ticks, -1) if continuous else action, "reward": rewards,
        "done": np.arange(ticks) == ticks - 1, "all_wheels_on_track": np.full(ticks, True),
        "progress": 100.0 * share * arc / arc[-1], "closest_waypoint": track.locate(np.c_[x, y]).nearer_waypoint,
        "track_len": np.full(ticks, track.length), "tstamp": start_s + np.arange(ticks) / 15.0,
        "episode_status": np.array(statuses), "pause_duration": np.zeros(ticks),
    }  # fmt: skip


def joined(*episodes):
    """Return the columns of several episodes, one after another."""
    return {name: np.concatenate([one[name] for one in episodes]) for name in episodes[0]}


def iteration(numbers, **details):
    """Return the columns of an iteration with these episodes."""
    return joined(*(episode(number, start_s=10.0 + 5 * k, **details) for k, number in enumerate(numbers)))


def lap_by_lap(laps=3, ticks=10, track=None):
    """Return the columns of a continuous evaluation: held once, steps and clock run on from lap to lap."""
    parts = [episode(k, 1.0, ticks, status="in_progress", track=track) for k in range(laps)]
    for k, part in enumerate(parts):
        part["steps"] = part["steps"] + k * ticks
        part["tstamp"] = 10.0 + (np.arange(ticks) + k * ticks) / 15.0
        part["done"] = np.zeros(ticks, bool)
        if k:
            part["episode_status"] = np.array(["in_progress"] * ticks)
    whole = joined(*parts)
    whole["done"][-1] = True
    whole["episode_status"] = whole["episode_status"].astype("<U12")
    whole["episode_status"][-1] = "lap_complete"
    return whole


def write(path, columns):
    """Write a trace where it shall lie."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_sim_trace(path, columns)
    return path


def drfc(folder, workers=1, iterations=2, episodes=3):
    """Lay out a DeepRacer for Cloud prefix; with several workers each counts its episodes from 0."""
    for worker in range(workers):
        home = folder / str(worker) if workers > 1 else folder
        for k in range(iterations):
            numbers = range(k * episodes, (k + 1) * episodes)
            write(home / "training-simtrace" / f"{k}-iteration.csv", iteration(numbers))
    return folder


def log_text(columns, episodes_per_iteration=None, prefix=""):
    """Return a simulation log with the lines of a trace among others."""
    lines = ["some node started", " * /WORLD_NAME: reinvent_base"]
    if episodes_per_iteration:
        lines += [
            "Using the following hyper-parameters",
            "{",
            f'"num_episodes_between_training": {episodes_per_iteration}',
            "}",
        ]
        for k in np.unique(columns["episode"]):
            lines.append(episode_line(0, int(k) + 1, 1.0, 5, int(k) // episodes_per_iteration))
    return "\n".join(prefix + line for line in [*lines, *trace_lines(columns), "bye"]) + "\n"


def packed(folder, archive, top="model-id"):
    """Pack a folder into a .tar.gz with one directory at the top."""
    with tarfile.open(archive, "w:gz") as tar:
        tar.add(folder, arcname=top)
    return archive


def csv_text(columns):
    """Return a trace as the text of its file."""
    return sim_trace_text(columns)
