"""One of AWS's iterations: so many whole episodes, as one worker would have driven them one after the other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.files.sim_trace import trace_from_episodes
from racecraft.worlds.deepracer.files.simulation_log import episode_line, trace_lines
from racecraft.worlds.deepracer.training.aws.episodes import STATUSES, apart, together


@dataclass
class Block:
    """Episodes of one iteration; the last block of a training may still be filling."""

    number: int
    """The iteration, counted from 0."""
    first_episode: int
    """Number of its first episode, counted from 0 over the whole training."""
    episodes: list[Array] = field(default_factory=list)
    """TICK (T,) each."""
    starts: list[int] = field(default_factory=list)
    """Ticks of the virtual clock before each episode."""
    lines: list[str] = field(default_factory=list)
    """What the log says after the episodes: updates and checkpoints."""

    def trace(self, track_length_m: float) -> dict[str, Array]:
        """Return every tick as a simulation trace; the clock runs at 15 ticks a second.

        There is no `wall_clock`: the same seed shall give the same file.
        """
        lengths = [len(episode) for episode in self.episodes]
        ticks = np.concatenate(self.episodes)
        clock = np.concatenate(
            [np.arange(start + 1, start + 1 + length) for start, length in zip(self.starts, lengths, strict=True)]
        )
        columns = {name: ticks[name] for name in ticks.dtype.names or ()}
        columns["episode"] = np.repeat(np.arange(len(lengths)) + self.first_episode, lengths)
        columns["time_s"] = np.round(clock / TICKS_PER_SECOND, 6)
        columns["status"] = np.array(STATUSES)[ticks["status"]]
        columns["track_length_m"] = np.where(ticks["track_length_m"] > 0, ticks["track_length_m"], track_length_m)
        columns["obstacle_crashes"] = (columns["status"] == "crashed").astype(np.int32)  # the first ends the episode
        trace = trace_from_episodes(columns)
        del trace["wall_clock"]
        return trace

    def log_text(self, trace: Mapping[str, Array]) -> str:
        """Return what the simulation log says of this iteration: ticks, episodes, updates."""
        ticks, out, at = trace_lines(trace), [], 0
        for place, episode in enumerate(self.episodes):
            out += ticks[at : at + len(episode)]
            at += len(episode)
            number, reward = self.first_episode + place + 1, float(episode["reward"].sum())
            out.append(episode_line(0, number, reward, len(episode), self.number))
        return "\n".join([*out, *self.lines]) + "\n"

    def state(self) -> dict[str, Any]:
        """Return the block as arrays and plain values."""
        return {
            "number": self.number,
            "first_episode": self.first_episode,
            "ticks": apart(np.concatenate(self.episodes)) if self.episodes else {},
            "lengths": np.array([len(episode) for episode in self.episodes], np.int64),
            "starts": np.array(self.starts, np.int64),
            "lines": list(self.lines),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> Block:
        """Return the block that `state` gave."""
        block = cls(state["number"], state["first_episode"], lines=list(state["lines"]))
        block.starts = np.asarray(state["starts"]).tolist()
        if state["ticks"]:
            block.episodes = np.split(together(state["ticks"]), np.cumsum(state["lengths"])[:-1])
        return block
