"""Whose line an error is told to have come from."""

import json

import pytest

from racecraft.contract.blame import own_line


def raised(act):
    with pytest.raises(Exception) as caught:  # noqa: PT011
        act()
    return caught.value


def test_a_file_that_is_no_python_is_told_by_the_line_that_is_none(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    error = raised(lambda: compile("x = 1\ny = (\n", str(tmp_path / "mine.py"), "exec"))
    assert own_line(error) == "mine.py:2"


@pytest.mark.parametrize("place", [(None, None, None, None), ("mine.py", None, None, None), (None, 3, 1, "x")])
def test_a_syntax_error_of_no_place_is_told_by_the_line_that_raised_it(place):
    def act():
        raise SyntaxError("no place", place)

    assert "test_blame.py:" in own_line(raised(act))


def test_the_innermost_line_that_is_the_users_own_is_told():
    told = own_line(raised(lambda: json.loads("{")))
    assert "test_blame.py:" in told
    assert own_line(SyntaxError("never raised")) == ""
