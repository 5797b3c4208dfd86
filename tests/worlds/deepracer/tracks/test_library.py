"""Own circuits: looked at once, found by name, never written over unasked."""

import numpy as np
import pytest

from racecraft.contract.errors import TrackError
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.library import add_track, library_folder, own_names, own_summary, own_track

ROWS = load_track("Oval_track").rows


@pytest.fixture(autouse=True)
def library(tmp_path, monkeypatch):
    monkeypatch.setenv("RACECRAFT_TRACKS", str(tmp_path / "library"))
    return tmp_path / "library"


@pytest.fixture
def garage(tmp_path):
    np.save(tmp_path / "garage.npy", ROWS)
    return tmp_path / "garage.npy"


def test_a_track_of_one_s_own_is_found_by_name_and_is_the_same(garage):
    add_track(garage)
    assert own_names() == ["garage"]
    assert load_track("Garage").hash() == load_track("Oval_track").hash()
    assert load_track("garage").name == "garage"
    figures = own_summary("garage")
    assert (figures.rows, figures.direction, figures.tags) == (len(ROWS), "ccw", ("own",))
    assert figures.length == pytest.approx(load_track("Oval_track").length, abs=1e-4)


def test_nothing_is_written_over_unless_asked(garage, library):
    add_track(garage)
    np.save(garage, 2 * ROWS)
    with pytest.raises(TrackError, match=r"taken by .*garage\.npy.*--replace"):
        add_track(garage)
    assert load_track("garage").length < 0.6 * load_track(garage).length
    add_track(garage, replace=True)
    assert load_track("garage").length == load_track(garage).length
    assert [path.name for path in library.iterdir()] == ["garage.npy"]


@pytest.mark.parametrize("name", ["Smile Speedway", "REINVENT-BASE"])
def test_the_catalogue_s_names_stay_the_catalogue_s(garage, name):
    with pytest.raises(TrackError, match="the name .*--name"):
        add_track(garage, name)


@pytest.mark.parametrize("name", ["a b", "../up", ".hidden", "x" * 65])
def test_names_that_no_folder_bears_are_refused(garage, name):
    with pytest.raises(TrackError, match="letters, digits"):
        add_track(garage, name)
    assert own_names() == []


def test_a_bad_file_is_not_kept(tmp_path):
    rows = ROWS.copy()
    rows[7, 3] = np.nan
    np.save(tmp_path / "bad.npy", rows)
    with pytest.raises(TrackError, match="row 7"):
        add_track(tmp_path / "bad.npy")
    assert own_names() == []


def test_a_name_that_is_nobody_s_is_refused_with_the_nearest(garage):
    add_track(garage)
    with pytest.raises(TrackError, match="Did you mean 'garage'"):
        load_track("garaje")
    assert own_track("garaje") is None


@pytest.mark.parametrize(
    ("system", "environment", "folder"),
    [
        ("linux", {"HOME": "/home/ann"}, "/home/ann/.local/share/racecraft/tracks"),
        ("linux", {"HOME": "/home/ann", "XDG_DATA_HOME": "/data"}, "/data/racecraft/tracks"),
        ("darwin", {"HOME": "/Users/ann"}, "/Users/ann/Library/Application Support/racecraft/tracks"),
        ("win32", {"HOME": "/h", "LOCALAPPDATA": "/local"}, "/local/racecraft/tracks"),
    ],
)
def test_each_system_keeps_it_where_it_keeps_a_user_s_data(system, environment, folder):
    assert library_folder(environment, system).as_posix() == folder
