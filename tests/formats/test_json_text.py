"""JSON that is none: the comma after a last entry is found wherever a Python points."""

import json

import pytest

from racecraft.contract.errors import InputFileError
from racecraft.formats.json_text import _trailing_comma, as_number, key_text, kind_of, read_json


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


def read(tmp_path, content):
    path = tmp_path / "t.json"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_json(path, InputFileError, "an object")


def test_every_value_stands_on_a_line(tmp_path):
    document = read(tmp_path, '\n{\n "a": [1,\n  {"b" : "x, ]"}, []],\n "c": {}, "d"\n:\n-2.5 }\n')
    assert document.value == {"a": [1, {"b": "x, ]"}, []], "c": {}, "d": -2.5}
    assert document.lines == {
        (): 2, ("a",): 3, ("a", 0): 3, ("a", 1): 4, ("a", 1, "b"): 4, ("a", 2): 4, ("c",): 5, ("d",): 7,
    }  # fmt: skip
    asked = (("a", 1, "b"), ("a", 1, "z"), ("a", 9, "z"), ("z",), ())
    assert [document.line_of(*steps) for steps in asked] == [4, 4, 3, 2, 2]
    assert read(tmp_path, " 7").lines == {(): 1}


def test_a_letter_names_file_line_and_key(tmp_path):
    document = read(tmp_path, '{\n"a": [1,\n2]}')
    letter = str(document.error_at("a", 1, found="2", expected="3", hint="Write 3."))
    assert letter == f"{tmp_path / 't.json'}:3: a[1]: 2; expected 3. Write 3."
    assert f"{tmp_path / 't.json'}:1: 2; expected 3" in str(document.error_at(found="2", expected="3"))


def test_comments_are_passed_over_with_a_note_and_move_no_line(tmp_path):
    document = read(tmp_path, '// one\n{"a": 1, /* two\n lines */ # three\n"b": "//#/* none */", "c": "\\"//"}')
    assert document.value == {"a": 1, "b": "//#/* none */", "c": '"//'}
    assert document.notes == ("comments were passed over; take them out for AWS, which reads none",)
    assert document.lines == {(): 2, ("a",): 2, ("b",): 4, ("c",): 4}
    assert read(tmp_path, '{"a": "# none"}').notes == ()


def test_a_key_that_stands_twice_is_told_once_and_the_last_one_counts(tmp_path):
    document = read(tmp_path, '{"a": 1, "b": {"c": 1, "c": 2, "c": 3, "d": 4}, "a": 5}')
    assert document.value == {"a": 5, "b": {"c": 3, "d": 4}}
    assert document.notes == ("'c' is given twice; the last one counts", "'a' is given twice; the last one counts")


@pytest.mark.parametrize("encoded", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_any_line_end_and_any_mark_at_the_beginning_is_read(tmp_path, encoded, end):
    document = read(tmp_path, f'{{"ä": 1,{end}{end}"b": 2}}'.encode(encoded))
    assert document.value == {"ä": 1, "b": 2}
    assert document.line_of("b") == 3


@pytest.mark.parametrize(
    ("content", "letter"),
    [
        ("", r"t\.json: the file is empty; expected an object"),
        ('{"a":\n1,\n\n}', r"t\.json:2: no valid JSON, a comma stands after the last entry"),
        ("[1,\n 2\n,\n]", r"t\.json:3: no valid JSON, a comma stands after the last entry"),
        ("{\n'a': 1}", r"t\.json:2: no valid JSON, quoted with ' where JSON wants \""),
        ("{\u201ca\u201d: 1}", "the typographic quote \u201c where JSON wants"),
        ('{"a": ', r"it ends too early \(a bracket or quote is not closed\)"),
        ('{"a": 1,\n "b" 2}', r"t\.json:2: no valid JSON, expecting ':' delimiter at column 6, before '2}'"),
        ('{"a": 1 ' + "b" * 50 + "\nc}", "at column 9, before '" + "b" * 40 + "'"),
        ('{"a": 1 bc\nd}', "at column 9, before 'bc'"),
        (
            b'{"a":\n\n"\xff"}',
            r"t\.json:3: byte 0xff \(byte 8 of the file\) is not UTF-8; expected a text file in UTF-8",
        ),
        (b"\xff\xfe{", r"t\.json: text in UTF-16"),
        ("1" * 5000, "nested too deeply, or a number too long"),
    ],
)
def test_what_cannot_be_read_is_said_with_its_line(tmp_path, content, letter):
    with pytest.raises(InputFileError, match=letter):
        read(tmp_path, content)


def test_a_file_that_is_none_or_a_folder_is_said_to_be_so(tmp_path):
    with pytest.raises(InputFileError, match="there is no such file; expected an object"):
        read_json(tmp_path / "gone.json", InputFileError, "an object")
    with pytest.raises(InputFileError, match="a folder; expected a file with an object"):
        read_json(tmp_path, InputFileError, "an object")


def test_numbers_and_kinds_are_called_by_their_names():
    assert [as_number(value) for value in (" 4 ", "-1e3", 2.5, False, None, [], "", "4m")] == [
        4.0, -1000.0, 2.5, None, None, None, None, None,
    ]  # fmt: skip
    assert [kind_of(value) for value in ({}, [], "", True, None, 3, 2.5)] == [
        "an object", "a list", "a word", "true or false", "nothing (null)", "a number", "a number",
    ]  # fmt: skip
    assert [key_text(), key_text("a"), key_text(0, 1), key_text("a", "b", 0)] == ["", "a", "[0][1]", "a.b[0]"]
