"""Whose line an error is told to have come from."""

import json
import os
from pathlib import Path

import pytest

import racecraft
from racecraft.contract.user_code_location import display_path, is_user_file, user_code_location


def raised(act):
    with pytest.raises(Exception) as caught:  # noqa: PT011
        act()
    return caught.value


def test_a_file_that_is_no_python_is_told_by_the_line_that_is_none(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    error = raised(lambda: compile("x = 1\ny = (\n", str(tmp_path / "mine.py"), "exec"))
    assert user_code_location(error) == "mine.py:2"


@pytest.mark.parametrize("place", [(None, None, None, None), ("mine.py", None, None, None), (None, 3, 1, "x")])
def test_a_syntax_error_of_no_place_is_told_by_the_line_that_raised_it(place):
    def act():
        raise SyntaxError("no place", place)

    assert "test_user_code_location.py:" in user_code_location(raised(act))


def test_the_innermost_line_that_is_the_users_own_is_told():
    told = user_code_location(raised(lambda: json.loads("{")))
    assert "test_user_code_location.py:" in told
    assert user_code_location(SyntaxError("never raised")) == ""


def test_neither_ours_nor_pythons_nor_a_packages_files_are_the_users_own(tmp_path):
    for file in (json.__file__, pytest.__file__, user_code_location.__code__.co_filename, "<string>"):
        assert not is_user_file(file), file
    for folder in ("site-packages", "dist-packages"):
        assert not is_user_file(f"/elsewhere/lib/{folder}/somebody/page.py"), "of another environment"
    assert is_user_file(str(tmp_path / "mine.py"))
    assert is_user_file("/elsewhere/packages/mine.py")
    assert is_user_file(f"{Path(racecraft.__file__).parent}_of_mine/page.py"), "a folder that only begins as ours does"


def test_files_below_the_present_folder_are_told_from_there_and_others_whole(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert display_path(str(tmp_path / "rewards" / "mine.py")) == os.path.join("rewards", "mine.py")
    assert display_path(str(tmp_path.parent / "other.py")) == str(tmp_path.parent / "other.py")


def test_of_two_lines_of_the_users_the_inner_one_is_told():
    def inner():
        json.loads("{")

    line = inner.__code__.co_firstlineno + 1
    assert user_code_location(raised(lambda: inner())) == f"{display_path(__file__)}:{line}"
