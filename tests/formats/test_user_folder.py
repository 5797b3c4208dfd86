"""Where each system keeps a user's data: XDG's base directories, Apple's and Microsoft's guides."""

import pytest

from racecraft.formats.user_folder import data_folder

PLACES = [
    ({"HOME": "/h"}, "linux", "/h/.local/share/racecraft"),
    ({"HOME": "/h", "XDG_DATA_HOME": ""}, "linux", "/h/.local/share/racecraft"),
    ({"HOME": "/h", "XDG_DATA_HOME": "/d"}, "linux", "/d/racecraft"),
    ({"HOME": "/h", "XDG_DATA_HOME": "/d"}, "darwin", "/h/Library/Application Support/racecraft"),
    ({"HOME": "/h", "XDG_DATA_HOME": "/d"}, "win32", "/h/AppData/Local/racecraft"),
    ({"HOME": "/h", "LOCALAPPDATA": "/l"}, "win32", "/l/racecraft"),
    ({"HOME": "/h", "LOCALAPPDATA": "/l"}, "linux", "/h/.local/share/racecraft"),
]


@pytest.mark.parametrize(("environment", "system", "expected"), PLACES)
def test_each_system_has_its_place(environment, system, expected):
    assert data_folder(environment, system).as_posix() == expected


def test_without_a_home_the_account_says_where_it_is(monkeypatch, tmp_path):
    monkeypatch.setattr("pathlib.Path.home", lambda: tmp_path)
    assert data_folder({}, "linux") == tmp_path / ".local/share/racecraft"
