"""A request's fields: converted, checked, and found again in its groups."""

import math
from dataclasses import dataclass
from pathlib import Path

import pytest

from racecraft.contract.errors import SettingError
from racecraft.settings.request import (
    Option,
    Request,
    argument,
    group,
    make_request,
    option,
    options_as_typed,
    options_of,
)
from racecraft.settings.table import check_value


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


@pytest.mark.parametrize(
    ("setting", "found", "named"),
    [("Rules.fps", 60, "--fps"), ("Rules.from", Path("b"), "--from"), ("Rules.tracks", "c", "TRACKS"),
     ("Rules.fps", 61, "Rules.fps"), ("Rules.pace", 1.0, "Rules.pace"), ("Rules.size", 60, "Rules.size")],
)  # fmt: skip
def test_what_rules_refuse_is_named_as_it_was_typed_where_it_was(setting, found, named):
    """What stood elsewhere keeps its own name, and a default was typed by nobody."""
    request = make_request(Drive, tracks=["Oval_track", "c"], fps=60, **{"from": "b"})
    with pytest.raises(SettingError) as caught, options_as_typed(request):
        raise SettingError("{setting} is {found}; expected another.", setting=setting, found=found)
    assert str(caught.value) == f"{named} is {found}; expected another."
    assert caught.value.as_data()["fields"]["setting"] == named


def test_a_missing_argument_is_named():
    with pytest.raises(SettingError, match="TRACKS was not given"):
        make_request(Drive, fps=30)


@pytest.mark.parametrize(
    ("low", "high", "unit", "found", "message"),
    [
        (0.5, 4.0, "m/s", 9.0, "--speed is 9.0; expected 0.5 to 4 m/s."),
        (0.5, None, "", 0.0, "--speed is 0.0; expected 0.5 or more."),
        (0.5, None, "m/s", math.nan, "--speed is nan; expected 0.5 m/s or more."),
    ],
)
def test_an_error_of_a_range_names_it_its_unit_and_what_was_found(low, high, unit, found, message):
    row = Option("", "speed", float, 1.0, "", unit, low, high, ())
    with pytest.raises(SettingError) as caught:
        check_value(row, found)
    fields = caught.value.as_data()["fields"]
    assert str(caught.value) == message
    assert {name: fields[name] for name in ("setting", "low", "high", "unit")} == {
        "setting": "--speed", "low": low, "high": high, "unit": unit,
    }  # fmt: skip
    assert fields["found"] == found or math.isnan(found)
