"""Parameters at the borders of what a template allows."""

import pytest

from racecraft.sagemaker.cloudformation.parameters import ParameterError, settled
from racecraft.sagemaker.cloudformation.source import TemplateError
from racecraft.sagemaker.cloudformation.template import read_template

pytest.importorskip("yaml", reason="pyyaml is not installed")


def given(tmp_path, said, value):
    """Return what a parameter comes to that the template declares so."""
    path = tmp_path / "t.yaml"
    path.write_text(f"Resources: {{A: {{Type: T}}}}\nParameters:\n  It: {said}\n", encoding="utf-8")
    return settled(read_template(path), {} if value is None else {"It": value})["It"]


TAKEN = [
    ("{Type: String, MinLength: 3}", "abc", "abc"),
    ("{Type: String, MaxLength: 3}", "abc", "abc"),
    ("{Type: String, Default: ''}", None, ""),
    ("{Type: String, Default: a}", "b", "b"),
    ("{Type: Number, MinValue: 2, MaxValue: 2.5}", "2", "2"),
    ("{Type: Number, MinValue: 2, MaxValue: 2.5}", "2.5", "2.5"),
    ("{Type: List<Number>, MinValue: 1}", "1, 2 ,3", ["1", "2", "3"]),
    ("{Type: CommaDelimitedList}", "a", ["a"]),
    ("{Type: String}", "a,b", "a,b"),
    ("{Type: String, AllowedValues: [True, off]}", "TRUE", "true"),
    ("{Type: String, AllowedValues: [Red, blue]}", "Red", "Red"),
    ("{Type: String, AllowedPattern: 'a|ab'}", "ab", "ab"),
]


@pytest.mark.parametrize(("said", "value", "expected"), TAKEN)
def test_what_a_template_just_allows_is_taken(tmp_path, said, value, expected):
    assert given(tmp_path, said, value) == expected


REFUSED = [
    ("{Type: String, MinLength: 3}", "ab", "'ab'; expected MinLength 3"),
    ("{Type: String, MaxLength: 3}", "abcd", "'abcd'; expected MaxLength 3"),
    ("{Type: Number, MinValue: 2}", "1.9", "'1.9'; expected at least 2"),
    ("{Type: Number, MaxValue: 2}", "2.1", "'2.1'; expected at most 2"),
    ("{Type: List<Number>, MinValue: 2}", "2, 1", "'1'; expected at least 2"),
    ("{Type: List<Number>}", "1, b", "'b'; expected a number"),
    ("{Type: String, AllowedValues: [red]}", "RED", "'RED'; expected one of red"),
    ("{Type: String, AllowedValues: [red]}", "True", "'True'; expected one of red"),
    ("{Type: String, AllowedPattern: 'a'}", "ab", "'ab'; expected something like a"),
    ("{Type: String, MinLength: 3, ConstraintDescription: ' be long '}", "ab", r"--parameter It=… \(be long\)$"),
    ("{Type: String, MinLength: 3}", "ab", "--parameter It=…$"),
    ("{Type: String, MinLength: 3, NoEcho: false}", "ab", "'ab'; expected"),
]


@pytest.mark.parametrize(("said", "value", "letter"), REFUSED)
def test_what_lies_just_beyond_is_refused(tmp_path, said, value, letter):
    with pytest.raises(ParameterError, match=letter):
        given(tmp_path, said, value)


@pytest.mark.parametrize(
    ("said", "letter"),
    [
        ("\n    Type: Number\n    MinValue: few", r"t\.yaml:5: Parameters\.It\.MinValue: 'few'; expected a number"),
        ("\n    Type: String\n    MaxLength: [1]", r"t\.yaml:5: Parameters\.It\.MaxLength: \['1'\]; expected a number"),
        ("\n    Type: String\n    AllowedPattern: '('", r"t\.yaml:5: Parameters\.It\.AllowedPattern: '\('.*a regular"),
    ],
)
def test_a_limit_that_is_none_is_the_templates_own_fault(tmp_path, said, letter):
    with pytest.raises(TemplateError, match=letter):
        given(tmp_path, said, "1")
