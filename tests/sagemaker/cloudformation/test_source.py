"""A template's text: what YAML's scalars become, on which line each thing stands, and how much is read."""

import pytest

from racecraft.sagemaker.cloudformation import source
from racecraft.sagemaker.cloudformation.source import TemplateError, read_source


def read(tmp_path, text):
    path = tmp_path / "t.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_source(path)


def test_scalars_stay_words_and_what_yaml_calls_true_is_true(tmp_path):
    """YAML 1.1, which CloudFormation reads, knows six words for the two truths, in any case."""
    told = read(tmp_path, "[yes, No, on, OFF, True, false, 'yes', null, ~, '', 1e3, 0x1F, 010, 2012-10-17, 1.50]")
    assert told.values == [
        "true", "false", "true", "false", "true", "false", "yes", None, None, "", "1e3", "0x1F", "010", "2012-10-17",
        "1.50",
    ]  # fmt: skip


def test_a_short_tag_becomes_its_long_form_whatever_it_holds(tmp_path):
    tags = ("!Ref A", "!Condition B", "!GetAtt C.D.E", "!GetAtt [C, D]", "!Join ['-', [a]]", "!Sub {a: b}")
    told = read(tmp_path, "\n".join(f"- {tag}" for tag in tags))
    assert told.values == [
        {"Ref": "A"}, {"Condition": "B"}, {"Fn::GetAtt": ["C", "D.E"]}, {"Fn::GetAtt": ["C", "D"]},
        {"Fn::Join": ["-", ["a"]]}, {"Fn::Sub": {"a": "b"}},
    ]  # fmt: skip


def test_every_key_and_every_place_of_a_list_knows_its_line(tmp_path):
    told = read(tmp_path, "a:\n  b:\n    - c\n    - d: e\n      f:\n        !Ref g\nh: i\n")
    assert told.lines == {
        (): 1, ("a",): 1, ("a", "b"): 2, ("a", "b", "0"): 3, ("a", "b", "1"): 4, ("a", "b", "1", "d"): 4,
        ("a", "b", "1", "f"): 5, ("a", "b", "1", "f", "Ref"): 6, ("h",): 7,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "letter"),
    [
        ("a: 1\nb: 2\nc: }", r"t\.yaml:3: not YAML"),
        (b"a: \xff", r"t\.yaml: cannot be read \('utf-8' codec"),
        ("a:\n  b: c\n  <<: {d: e}", r"t\.yaml:3: a: a key that is no word"),
        ("a:\n  - b\n  - !Reff c", r"t\.yaml:3: a\.1: the tag !Reff"),
        ("a: &x b\nc: *x", r"t\.yaml:2: c: an alias"),
        ("a: 1\n\na: 2", r"t\.yaml:3: a: the key stands twice \(first in line 1\)"),
        ("x" * 1_048_577, "1048577 letters; expected a template of at most 1048576"),
    ],
)
def test_a_text_that_is_not_read_is_refused_with_the_line_where_there_is_one(tmp_path, text, letter):
    with pytest.raises(TemplateError, match=letter):
        read(tmp_path, text)


def test_as_many_letters_and_levels_are_read_as_there_may_be_and_no_more(tmp_path, monkeypatch):
    monkeypatch.setattr(source, "MAX_SOURCE_CHARACTERS", 200)
    assert read(tmp_path, "a".ljust(200)).values == "a"
    with pytest.raises(TemplateError, match="201 letters"):
        read(tmp_path, "a".ljust(201))
    assert read(tmp_path, "[" * 61 + "]" * 61).values, "the innermost list stands in 60 others"
    with pytest.raises(TemplateError, match="more than 60 levels"):
        read(tmp_path, "[" * 62 + "]" * 62)
