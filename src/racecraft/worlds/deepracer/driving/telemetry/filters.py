"""Which laps of a log count. Begin with `LapOptions`.

The options of a command are made from it, so nothing heavy is imported before laps are chosen.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from racecraft.contract.errors import SettingError
from racecraft.settings.request import Request, option

if TYPE_CHECKING:
    from racecraft.contract.world import Array
    from racecraft.worlds.deepracer.driving.telemetry.laps import Laps
    from racecraft.worlds.deepracer.logs.table import Logs

LINE, REST, FLYING = "line", "rest", "flying"
LINE_SHARE = 0.02
"""A lap begins at the start line if it begins within so much of the lap from it."""
LEFT, RIGHT = "left", "right"
NUMBER = r"(\d+(?:\.\d+)?)"
RANGE = r"(?=-?\d|\.\.-?\d)(-?\d+(?:\.\d+)?)?(?:(\.\.)(-?\d+(?:\.\d+)?)?)?"
"""Such as 10..20, 10.., ..20 or 10."""


@dataclass(frozen=True, kw_only=True)
class LapOptions(Request):
    """What a lap must be to count; every condition that is given must hold."""

    PANEL: ClassVar[str] = "Which laps count"
    phase: str | None = option(None, "training, evaluation or leaderboard.",
                               choices=("training", "evaluation", "leaderboard"))  # fmt: skip
    iterations: str | None = option(None, "Iterations of the training, such as 10..20, counted as in AWS's file names.")
    quarter: int | None = option(None, "Quarter of the episodes, 1 to 4: how early or late in the training.",
                                 low=1, high=4)  # fmt: skip
    begins: str | None = option(None, "line: at the start line; rest: from standstill; flying: at speed.",
                                choices=(LINE, REST, FLYING))  # fmt: skip
    within: float | None = option(None, "At most so many per cent slower than the fastest lap.", low=0.0)
    fastest: int | None = option(None, "So many laps, the fastest.", low=1)
    clean: bool = option(False, "Only laps in which the car never left the road.")
    turn: str | None = option(None, "Turn 3 with the straight behind it takes 1.6 s at most: 3=1.6.")
    section: str | None = option(None, "From waypoint 30 to 50 in 1.6 s at most: 30..50=1.6; also over the start line.")
    at: str | None = option(
        None,
        "At waypoint 57 the car drives 2 m/s at least: 57=2; at most: 57=..2; or is left or right of the centre "
        "line: 57=left.",
    )
    reward_at: str | None = option(None, "At waypoint 57 a tick pays 1.5 at least: 57=1.5; at most: 57=..1.5.")
    future_at: str | None = option(
        None,
        "At waypoint 57 the discounted rewards of this tick and all later ones of the episode come to so much "
        "at least: 57=20; at most: 57=..20.",
    )
    discount: float | None = option(
        None, "Discount factor of rewards to come; by default the training's own.", low=0.0, high=1.0
    )
    printed: str | None = option(None, "The reward function printed this text, as simulation logs hold it.")
    actions: str | None = option(None, "Action 4 is chosen somewhere: 4; or several follow one another: 4,4,7.")
    slide: float | None = option(
        None, "At most so many degrees between where the car points and where it goes.", low=0.0
    )
    top_speed: float | None = option(None, "The car drives so fast somewhere, m/s.")
    mean_reward: float | None = option(None, "A tick pays so much on average.")

    def rows(self, laps: Laps, log: Logs | None = None) -> Array:
        """Return the rows of the laps that count, in the log's order.

        Args:
            laps: All of them.
            log: Where they were found, for the training's discount and what was printed.

        Raises:
            SettingError: A value that no lap of this track or log can have.
        """
        import numpy as np

        if not len(laps):
            return np.zeros(0, int)
        met = [*self._from_there(laps), *self._driven(laps), *self._paid(laps, log)]
        rows = np.flatnonzero(np.all(met, axis=0)) if met else np.arange(len(laps))
        seconds = laps.lap_seconds
        if self.within is not None and len(rows):
            rows = rows[seconds[rows] <= seconds[rows].min() * (1.0 + self.within / 100.0) + 1e-9]
        if self.fastest is not None:
            rows = np.sort(rows[np.argsort(seconds[rows], kind="stable")[: self.fastest]])
        return rows

    def _from_there(self, laps: Laps) -> Iterator[Array]:
        """Yield which laps (L,) stem from where they are to stem from: phase, iteration, quarter, beginning."""
        about = laps.about
        if self.phase is not None:
            yield (about["phase"] == self.phase).to_numpy()
        if self.iterations is not None:
            first, dots, last = _read("iterations", self.iterations, RANGE, "a number, or two such as 10..20")
            yield _between(
                "iterations", self.iterations, about["iteration"].to_numpy(), (first, last if dots else first)
            )
        if self.quarter is not None:
            yield (4 * about["unique_episode"].to_numpy() // max(1, laps.episodes)) + 1 == self.quarter
        if self.begins == LINE:
            share = about["begin_share"].to_numpy()
            yield (share <= LINE_SHARE) | (share >= 1.0 - LINE_SHARE)
        elif self.begins is not None:
            yield about["from_rest"].to_numpy() == (self.begins == REST)

    def _driven(self, laps: Laps) -> Iterator[Array]:
        """Yield which laps (L,) were driven as they are to be driven."""
        import numpy as np

        if self.clean:
            yield laps.about["resets"].to_numpy() == 0
        if self.top_speed is not None:
            yield np.nanmax(laps.speed_mps, axis=1) >= self.top_speed
        if self.slide is not None:
            yield laps.about["max_slide_rad"].to_numpy() <= math.radians(self.slide)
        for text, met in ((self.turn, _turn), (self.section, _section), (self.at, _at), (self.actions, _actions)):
            if text is not None:
                yield met(laps, text)

    def _paid(self, laps: Laps, log: Logs | None) -> Iterator[Array]:
        """Yield for which laps (L,) the reward function paid and printed what it is to pay and print."""
        if self.discount is not None and self.future_at is None:
            raise SettingError("--discount: expected --future-at beside it, which discounts rewards.")
        if self.mean_reward is not None:
            yield (laps.about["mean_reward"] >= self.mean_reward).fill_null(False).to_numpy()
        if self.reward_at is not None:
            yield _worth_at(laps, "reward_at", self.reward_at, 0.0)
        if self.future_at is not None:
            yield _worth_at(laps, "future_at", self.future_at, self._discount(log))
        if self.printed is not None:
            yield _printed(laps, log, self.printed)

    def _discount(self, log: Logs | None) -> float:
        says = {} if log is None else log.about
        found = says.get("discount", says.get("hyperparameters", {}).get("discount_factor"))
        found = found if self.discount is None else self.discount
        if not isinstance(found, float | int):
            raise SettingError("--future-at: the log does not tell its discount; expected --discount beside it.")
        return float(found)


def _turn(laps: Laps, text: str) -> Array:
    """Tell which laps (L,) take so many seconds at most in the zone of a corner, "3=1.6"."""
    from racecraft.worlds.deepracer.driving.telemetry.timing import time_laps

    number, seconds = _read("turn", text, r"(\d+)=" + NUMBER, "a corner and seconds, such as 3=1.6")
    timing = time_laps(laps)
    if not 1 <= int(number) <= len(timing.corners):
        raise SettingError(
            "--turn {number}: {track} has {count} corners; expected one of them.",
            number=number, track=laps.track.name, count=len(timing.corners),
        )  # fmt: skip
    return timing.zone_seconds[:, int(number) - 1] <= float(seconds)


def _section(laps: Laps, text: str) -> Array:
    """Tell which laps (L,) take so many seconds at most from one waypoint to another, "30..50=1.6"."""
    expected = "two waypoints and seconds, such as 30..50=1.6"
    first, last, seconds = _read("section", text, r"(\d+)\.\.(\d+)=" + NUMBER, expected)
    begin, end = (_share(laps, "section", int(one)) for one in (first, last))
    behind, before = laps.shares >= begin, laps.shares < end
    inside = behind & before if begin <= end else behind | before
    return laps.seconds[:, inside].sum(axis=1) <= float(seconds)


def _at(laps: Laps, text: str) -> Array:
    """Tell which laps (L,) pass a waypoint at such a speed, "57=2..3", or on a side, "57=left"."""
    expected = "a waypoint and left, right or a speed in m/s, such as 57=left, 57=2.5 or 57=..2.5"
    waypoint, wanted, *ends = _read("at", text, rf"(\d+)=({LEFT}|{RIGHT}|{RANGE})", expected)
    piece = _piece(laps, "at", int(waypoint))
    if wanted in (LEFT, RIGHT):
        return (laps.offset_m[:, piece] > 0.0) == (wanted == LEFT)
    return _between("at", text, laps.speed_mps[:, piece], ends)


def _worth_at(laps: Laps, name: str, text: str, discount: float) -> Array:
    """Tell for which laps (L,) the tick at a waypoint and later ones, discounted, pay so much, "57=20"."""
    import numpy as np

    waypoint, *ends = _read(name, text, rf"(\d+)={RANGE}", "a waypoint and a reward, such as 57=1.5 or 57=..1.5")
    begins = laps.tick[:, _piece(laps, name, int(waypoint))]
    reward, episode = (laps.ticks[column].cast(float).to_numpy() for column in ("reward", "unique_episode"))
    stops = np.searchsorted(episode, episode[begins], side="right")
    worth = [
        reward[begin:stop] @ discount ** np.arange(stop - begin) for begin, stop in zip(begins, stops, strict=True)
    ]
    return _between(name, text, np.array(worth), ends)


def _between(name: str, text: str, values: Array, ends: Sequence[str]) -> Array:
    """Tell which values lie between the ends of a RANGE; one alone is the least."""
    low, high = float(ends[0] or "-inf"), float(ends[-1] or "inf")
    if low > high:
        raise _refusal(name, text, "the smaller number first")
    return (values >= low) & (values <= high)


def _printed(laps: Laps, log: Logs | None, text: str) -> Array:
    """Tell in which laps (L,) the reward function printed a text."""
    import numpy as np

    rows = np.zeros(0, int) if log is None else log.printed(text)
    if not len(rows):
        raise SettingError(
            "--printed {text!r}: stands between no two rows of a simulation log; expected a text that the reward "
            "function printed there. Traces hold no prints, nor does log.txt say of which car they are.", text=text
        )  # fmt: skip
    first, last = (np.searchsorted(rows, laps.about[name].to_numpy(), "right") for name in ("first_row", "last_row"))
    return np.asarray(last > first)


def _actions(laps: Laps, text: str) -> Array:
    """Tell in which laps (L,) actions follow one another, "4,4,7"."""
    import numpy as np
    from numpy.lib.stride_tricks import sliding_window_view

    _read("actions", text, r"(\d+(?:,\d+)*)", "numbers of actions, such as 4 or 4,4,7")
    wanted = [int(one) for one in text.split(",")]
    chosen = laps.about["actions"].explode().drop_nulls().unique().sort()
    if unknown := sorted(set(wanted) - set(chosen.to_list())):
        raise SettingError(
            "--actions {text}: no lap of the log chooses action {unknown}; expected some of {chosen} "
            "(-1: the actions are continuous and have no numbers).",
            text=text, unknown=unknown[0], chosen=", ".join(map(str, chosen)),
        )  # fmt: skip
    return np.array([
        len(one) >= len(wanted) and (sliding_window_view(one.to_numpy(), len(wanted)) == wanted).all(axis=1).any()
        for one in laps.about["actions"]
    ], np.bool_)  # fmt: skip


def _share(laps: Laps, name: str, waypoint: int) -> float:
    """Return where on the lap a waypoint is, a share of it."""
    waypoints = laps.track.as_filed().centre
    if waypoint >= len(waypoints):
        raise SettingError(
            "--{name}: {track} has no waypoint {waypoint}; expected 0 to {last}.",
            name=name.replace("_", "-"), track=laps.track.name, waypoint=waypoint, last=len(waypoints) - 1,
        )  # fmt: skip
    return float(laps.track.locate(waypoints[[waypoint]]).arc[0] / laps.track.length)


def _piece(laps: Laps, name: str, waypoint: int) -> int:
    """Return in which piece of the lap a waypoint lies."""
    return min(int(_share(laps, name, waypoint) * laps.pieces), laps.pieces - 1)


def _read(name: str, text: str, form: str, expected: str) -> tuple[str, ...]:
    """Return the parts of an option's value.

    Raises:
        SettingError: It has another form.
    """
    match = re.fullmatch(form, text)
    if match is None:
        raise _refusal(name, text, expected)
    return match.groups("")


def _refusal(name: str, text: str, expected: str) -> SettingError:
    return SettingError(
        "--{name} is {text!r}; expected {expected}.", name=name.replace("_", "-"), text=text, expected=expected
    )
