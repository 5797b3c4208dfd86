"""A request's fields: converted, checked, and found again in its groups."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from racecraft.contract.errors import SettingError
from racecraft.settings.request import Request, argument, group, make_request, option, options_of


@dataclass(frozen=True, kw_only=True)
class Film(Request):
    PANEL = "Film"

    fps: int = option(30, "Pictures a second.", low=15, high=60)
    view: str = option("car", "Camera.", choices=("car", "top"))


@dataclass(frozen=True, kw_only=True)
class Drive(Request):
    tracks: tuple[str, ...] = argument("Tracks.")
    film: Film = group(Film)
    out: Path | None = option(None, "File.")
    from_: Path | None = option(None, "Begin there.")
    pace: float = option(1.0, "Share of the speed.", low=0.1)


def test_plain_values_become_a_request_with_its_groups():
    made = make_request(Drive, "Oval_track", fps=60, out="a.csv", **{"from": "b"}, pace=1)
    assert made == Drive(tracks=("Oval_track",), film=Film(fps=60), out=Path("a.csv"), from_=Path("b"), pace=1.0)
    assert [row.full_name for row in options_of(Drive)] == ["TRACKS", "--fps", "--view", "--out", "--from", "--pace"]
    assert made.film.given() == {"--fps": 60}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"fps": 10}, "--fps is 10; expected 15 to 60"),
        ({"view": "tob"}, "Did you mean 'top'"),
        ({"pace": "fast"}, "--pace is 'fast'; expected a number"),
        ({"fsp": 30}, "there is no option 'fsp'. Did you mean 'fps'"),
    ],
)
def test_what_cannot_be_used_is_refused_by_its_spelling(values, message):
    with pytest.raises(SettingError, match=message):
        make_request(Drive, **{"tracks": ["a"], **values})


def test_a_missing_argument_is_named():
    with pytest.raises(SettingError, match="TRACKS was not given"):
        make_request(Drive, fps=30)
