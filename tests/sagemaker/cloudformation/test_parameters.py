"""Parameters that a template takes, and values that it does not allow."""

import pytest

from racecraft.sagemaker.cloudformation.parameters import ParameterError, resolve_parameters
from racecraft.sagemaker.cloudformation.template import read_template


def given(tmp_path, said, value):
    """Return what a parameter comes to that the template declares so."""
    path = tmp_path / "t.yaml"
    path.write_text(f"Resources: {{A: {{Type: T}}}}\nParameters:\n  It: {said}\n", encoding="utf-8")
    return resolve_parameters(read_template(path), {} if value is None else {"It": value})["It"]


TAKEN = [
    ("{Type: String, Default: ''}", None, ""),
    ("{Type: String, Default: a}", "b", "b"),
    ("{Type: Number, MinValue: 2}", "1", "1"),
    ("{Type: List<Number>}", "1, 2 ,3", ["1", "2", "3"]),
    ("{Type: CommaDelimitedList}", "a", ["a"]),
    ("{Type: String}", "a,b", "a,b"),
    ("{Type: String, AllowedValues: [True, off]}", "TRUE", "true"),
    ("{Type: String, AllowedValues: [Red, blue]}", "Red", "Red"),
]


@pytest.mark.parametrize(("said", "value", "expected"), TAKEN)
def test_what_a_template_just_allows_is_taken(tmp_path, said, value, expected):
    assert given(tmp_path, said, value) == expected


REFUSED = [
    ("{Type: String, AllowedValues: [red]}", "RED", "'RED'; expected one of red"),
    ("{Type: String, AllowedValues: [red]}", "True", "'True'; expected one of red"),
    ("{Type: String, AllowedValues: [b], ConstraintDescription: ' be b '}", "a", r"--parameter It=… \(be b\)$"),
    ("{Type: String, AllowedValues: [b]}", "a", "--parameter It=…$"),
    ("{Type: String, AllowedValues: [b], NoEcho: false}", "a", "'a'; expected"),
]


@pytest.mark.parametrize(("said", "value", "letter"), REFUSED)
def test_what_lies_just_beyond_is_refused(tmp_path, said, value, letter):
    with pytest.raises(ParameterError, match=letter):
        given(tmp_path, said, value)
