"""JSON that is none: the comma after a last entry is found wherever a Python points."""

import json

import pytest

from racecraft.formats.json_text import _trailing_comma


@pytest.mark.parametrize("text", ['{"a": 1, }', "[1, 2,\n]", '{"a": [3 ,]}'])
@pytest.mark.parametrize("points_at", ["the comma", "the bracket behind it"])
def test_a_comma_after_the_last_entry_is_found_where_python_points_at_it_and_where_behind_it(text, points_at):
    """Python 3.13 points at the comma, earlier ones at the bracket."""
    comma = text.rindex(",")
    bracket = comma + len(text[comma + 1 :]) - len(text[comma + 1 :].lstrip()) + 1
    wrong = json.JSONDecodeError("", text, comma if points_at == "the comma" else bracket)
    assert _trailing_comma(text, wrong) == comma


def test_where_something_else_is_wrong_no_comma_is_found():
    text = '{"a": 1, b}'
    for place in (text.index(","), text.index("b"), text.index("}")):
        assert _trailing_comma(text, json.JSONDecodeError("", text, place)) is None
