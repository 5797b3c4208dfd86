"""What a letter says: where, what was found, what was expected, what to do; and which name was meant."""

import pytest

from racecraft.contract.errors import InputFileError, TrackError, UserInputError, nearest


@pytest.mark.parametrize(
    ("more", "letter"),
    [
        ({}, "a.json: 3 found; expected 4."),
        ({"hint": "Mend it."}, "a.json: 3 found; expected 4. Mend it."),
        ({"line": 7}, "a.json:7: 3 found; expected 4."),
        ({"line": 7, "key": "speed", "hint": "Mend it."}, "a.json:7: speed: 3 found; expected 4. Mend it."),
    ],
)
def test_a_letter_about_a_file_names_what_is_known_of_the_place(more, letter):
    error = InputFileError("a.json", "3 found", "4", **more)
    assert str(error) == letter
    assert (error.path.name, error.found, error.expected, error.hint) == (
        "a.json", "3 found", "4", more.get("hint", "")
    )  # fmt: skip
    assert (error.line, error.key) == (more.get("line"), more.get("key"))
    assert isinstance(TrackError("a", "b", "c"), UserInputError)


def test_one_name_is_told_the_nearest_in_its_own_letters_or_all_are():
    assert nearest("HORIZN", ["horizon", "horizons", "Num_Worlds"]) == "Did you mean 'horizon'?"
    assert nearest("num_world", ["horizon", "Num_Worlds"]) == "Did you mean 'Num_Worlds'?"
    assert nearest("q", (name for name in ("left", "right"))) == "Known: left, right."
    assert nearest("q", ()) == "There is none."
