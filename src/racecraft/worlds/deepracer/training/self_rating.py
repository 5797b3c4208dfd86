"""How much better a car that raced others has become: its last self against earlier ones. Begin with `rate_selves`."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

from racecraft.evaluation.rating import Rating, Result, rate
from racecraft.formats.atomic import write_atomic
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.films.film import FilmStyle
from racecraft.worlds.deepracer.analysis.race_film import film_race
from racecraft.worlds.deepracer.env.settings import RaceConfig
from racecraft.worlds.deepracer.evaluation.head_to_head import HeadToHead, RaceResult, race_head_to_head, summed
from racecraft.worlds.deepracer.players.driver import Driver, driver_of
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.tracks.track import Track

RATING, FILM = "selves.json", "race.mp4"
RACES, LAPS, MAX_RESETS = 8, 1, 2
"""Races of every pair, over so many laps; after a few mishaps who cannot drive at all is out."""
PASSING_LAPS = 2
"""Of the races against a slower car, in which it is lapped as well as overtaken."""
STEPS = 2
"""Earlier selves that are met, evenly spread over the training, the first among them."""


@dataclass(frozen=True)
class SelfRating:
    """Ratings of a run's selves, oldest first, and of the models it trained against behind them."""

    names: tuple[str, ...]
    ratings: tuple[Rating, ...]
    gain: float
    """Elo points of the last self over the first."""
    low: float
    high: float
    """The least and the most that the 95 % intervals of both leave of it."""
    driven: tuple[dict[str, Any], ...]
    """What each driver came to over all its races, as `head_to_head.summed` has it."""
    passing: dict[str, Any]
    """What the last self came to against itself in a slower car, likewise, and its `pace`: whether it overtakes."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the ratings as plain values, fit for JSON."""
        records = [
            {"name": name, **{key: round(value, 1) for key, value in asdict(one).items()}, **facts}
            for name, one, facts in zip(self.names, self.ratings, self.driven, strict=True)
        ]
        gain = {"points": round(self.gain, 1), "low": round(self.low, 1), "high": round(self.high, 1)}
        return {"selves": records, "last_over_first": gain, "against_a_slower_self": self.passing}


def rate_selves(
    run: RunFolder, chosen: Sequence[Driver], on_message: Callable[[str], None], film: bool = True
) -> tuple[SelfRating, dict[str, Path]]:
    """Race a run's last self, earlier ones and chosen models against each other, each pair on its own.

    Args:
        run: A car's run.
        chosen: Models that it trained against.
        on_message: Called with what is being done.
        film: Whether that of the last self's races against a slower car of its own is filmed in which it overtook most.

    Returns:
        The ratings, also written into the run folder, and the files by kind.
    """
    cars = [load_trained_car(run.path, str(number)) for number in _steps(run)]
    selves = [driver_of(car, f"iteration {car.checkpoint.iteration}") for car in cars]
    drivers = [*selves, *chosen]
    track, config = cars[-1].trained_on, cars[-1].settings.race
    on_message(f"Racing {len(drivers)} drivers against each other …")
    results: list[Result] = []
    met: dict[tuple[int, int], RaceResult] = {}
    for one, other in combinations(range(len(drivers)), 2):
        met[one, other] = _meet([drivers[one], drivers[other]], track, config)
        results += [Result((one, other), (a.place, b.place)) for a, b in met[one, other].races]
    ratings = rate(len(drivers), results)
    driven = tuple(_driven(number, driver, met) for number, driver in enumerate(drivers))
    last, pace = selves[-1], cars[-1].settings.against.slowest
    slower = replace(last, name=f"{last.name}, {pace:.0%} pace", pace=pace)
    passed = _meet([last, slower], track, config, PASSING_LAPS)
    passing = {**summed(last.name, passed.of(0)), "pace": pace}
    rated = _rating(tuple(driver.name for driver in drivers), ratings, len(selves), driven, passing)
    place = run.path / RATING
    write_atomic(place, json.dumps(rated.as_dictionary(), indent=2) + "\n")
    files = {"rating": place}
    if film:
        on_message("Filming a race …")
        number = most_passing(passed)
        files |= film_race(passed, [last, slower], track, run.path / FILM, FilmStyle("pip"), number=number)
    return rated, files


def most_passing(result: RaceResult) -> int:
    """Return the number of the race, of those whose ticks were kept, in which the first driver overtook most."""
    return max(range(len(result.ticks)), key=lambda number: result.races[number][0].overtakes)


def _steps(run: RunFolder) -> list[int]:
    """Return the iterations whose selves meet: evenly spread among those kept, first and last always."""
    kept = sorted(entry.iteration for entry in Checkpoints(run.checkpoints).entries())
    count = min(STEPS + 1, len(kept))
    return sorted({kept[round(k * (len(kept) - 1) / max(count - 1, 1))] for k in range(count)})


def _meet(pair: Sequence[Driver], track: Track, config: RaceConfig, laps: int = LAPS) -> RaceResult:
    return race_head_to_head(pair, track, HeadToHead(laps=laps, races=RACES, max_resets=MAX_RESETS), config)


def _driven(number: int, driver: Driver, met: dict[tuple[int, int], RaceResult]) -> dict[str, Any]:
    """Return what a driver came to over all pairs."""
    own = [showing for pair, result in met.items() if number in pair for showing in result.of(pair.index(number))]
    return summed(driver.name, own)


def _rating(
    names: tuple[str, ...],
    ratings: Sequence[Rating],
    selves: int,
    driven: tuple[dict[str, Any], ...],
    passing: dict[str, Any],
) -> SelfRating:
    first, last = ratings[0], ratings[selves - 1]
    gain = last.points - first.points
    return SelfRating(names, tuple(ratings), gain, last.low - first.high, last.high - first.low, driven, passing)
