"""What marshals go by in a race, and where it may begin: settings made definite for one track. Begin at `rules_of`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from racecraft.contract.errors import ContractError, SettingError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.fidelity import (
    AWS_MAX_TICKS,
    SANE_MAX_SECONDS,
    SANE_MIN_SPEED,
    TICK_JITTER,
    WHEEL_KICK,
    habits,
)
from racecraft.worlds.deepracer.env.settings import RaceConfig
from racecraft.worlds.deepracer.tracks.track import Track


def rules_of(
    race_config: RaceConfig, track: Track, laps: int, start_ahead: float, drive_seconds: float | None = None
) -> race.Rules:
    """Return the rules of a race. On an open track every episode is one drive from its start to its finish.

    Args:
        race_config: As it is asked for.
        track: Where it is driven.
        laps: An episode ends after so many complete laps.
        start_ahead: How far ahead of another car of its world a car starts again, m.
        drive_seconds: A car that completes a lap drives on in its next episode, until so much simulated time after its
            last standing start, or `race_config.practice_seconds`; None: `laps` end an episode.
    """
    has = habits(race_config.fidelity)
    if not track.closed:
        laps, drive_seconds = 1, None
    ticks = most_ticks(race_config, track.length, laps) if drive_seconds is None else race.max_ticks(drive_seconds)
    practice = None if drive_seconds is None else race_config.practice_seconds
    return race.Rules(
        max_ticks=ticks,
        practice_ticks=ticks if practice is None else min(ticks, race.max_ticks(practice)),
        laps=laps,
        start_advance=race_config.start_advance if race_config.change_start and track.closed else 0.0,
        cut_ends=has.cut_is_an_end,
        jitter=TICK_JITTER if has.ticks_jitter else 0.0,
        wheel_kick=WHEEL_KICK if has.wheels_wander else 0.0,
        keeps_wheels=has.wheels_keep_their_angle,
        jumps=has.progress_jumps,
        start_ahead=start_ahead,
        drives_on=drive_seconds is not None,
    )


def most_ticks(race_config: RaceConfig, track_length: float, laps: int) -> int:
    """Return the limit on an episode of so many laps: what was asked for a lap, or what the fidelity has."""
    if race_config.max_episode_seconds is not None:
        return race.max_ticks(race_config.max_episode_seconds * laps)
    if habits(race_config.fidelity).episodes_are_endless:
        return AWS_MAX_TICKS
    return race.max_ticks(max(SANE_MAX_SECONDS, track_length / SANE_MIN_SPEED) * laps)


def first_starts(track: Track, start_shares: Sequence[float] | Array | None, num_worlds: int) -> Array:
    """Return where each world's first car first starts, share of the lap (N,); where nobody says, spread evenly.

    An open track is driven from its start, whatever is asked for.

    Raises:
        ContractError: There is not one for each world.
    """
    shares = np.arange(num_worlds) / num_worlds if start_shares is None else np.asarray(start_shares, float)
    if shares.shape != (num_worlds,):
        raise ContractError(
            "start_shares has shape {shape}; expected ({num_worlds},)", shape=shares.shape, num_worlds=num_worlds
        )
    return shares if track.closed else np.zeros(num_worlds)


def require_grid(track: Track, cars: int) -> None:
    """Refuse more cars than can start behind one another on the lap.

    Raises:
        SettingError: So many do not fit.
    """
    if cars * race.START_GAP_M > track.length:
        raise SettingError(
            "{cars} cars start {start_gap_m} m behind one another, and {name} is {length:.1f} m "
            "long; expected at most {length_2} cars",
            cars=cars,
            start_gap_m=race.START_GAP_M,
            name=track.name,
            length=track.length,
            length_2=int(track.length / race.START_GAP_M),
        )
