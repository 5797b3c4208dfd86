"""Params files: what we write we read, and so does a YAML library."""

import pytest
import yaml

from racecraft.worlds.deepracer.files.training_params import ParamsFileError, read_params, write_params

PARAMS = {
    "WORLD_NAME": "reinvent_base",
    "NUM_WORKERS": 1,
    "REVERSE_DIR": False,
    "DISPLAY_NAME": 'O\'Brien: #1, "fast"',
    "EMPTY": "",
    "OBJECT_POSITIONS": ["0.23,-1", "0.46,1"],
    "NONE": [],
}
AS_TEXT = {**PARAMS, "NUM_WORKERS": "1", "REVERSE_DIR": "False"}


def test_what_is_written_comes_back_as_text(tmp_path):
    write_params(tmp_path / "p.yaml", PARAMS)
    assert (tmp_path / "p.yaml").read_text().startswith("---\nWORLD_NAME: 'reinvent_base'\nNUM_WORKERS: '1'\n")
    assert read_params(tmp_path / "p.yaml") == AS_TEXT


def test_a_yaml_library_reads_the_same(tmp_path):
    write_params(tmp_path / "p.yaml", PARAMS)
    assert yaml.safe_load((tmp_path / "p.yaml").read_text()) == AS_TEXT


def test_what_others_write_is_read(tmp_path):
    text = (
        "\ufeff# made by hand\nA: plain # said aside\r\nB: \"two \\\"words\\\"\"\nC:\n  - x\n  - 'y'\nD: ['1,2', z]\n"
    )
    (tmp_path / "p.yaml").write_text(text, encoding="utf-8", newline="")
    assert read_params(tmp_path / "p.yaml") == {"A": "plain", "B": 'two "words"', "C": ["x", "y"], "D": ["1,2", "z"]}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("A: 1\nhello\n", ":3: could not find expected ':'"),
        ("- x\n", ": a YAML list"),
        ("A: {b: c}\n", ": A: a nested value"),
    ],
)
def test_what_is_no_params_file_gets_a_letter(tmp_path, text, found):
    (tmp_path / "p.yaml").write_text(text)
    with pytest.raises(ParamsFileError) as caught:
        read_params(tmp_path / "p.yaml")
    assert str(caught.value).startswith(f"{tmp_path / 'p.yaml'}{found}; expected lines of KEY: 'value'")
    with pytest.raises(ParamsFileError, match="no such file"):
        read_params(tmp_path / "q.yaml")


READ = [  # text, what it says
    ("A: 'it''s'\nB: ''\n", {"A": "it's", "B": ""}),
    ("A: []\nB: [ 'x, y' , \"z\",w ]\n", {"A": [], "B": ["x, y", "z", "w"]}),
    ("---\n# said\n\nA:\nB.c: d\n", {"A": "", "B.c": "d"}),
    ("A: b#c\nC: True\nD: 0x10\n", {"A": "b#c", "C": "True", "D": "0x10"}),
    ("", {}),
    ("A: [x\nB: y]\n", None),
    ("A: &a [x]\nB: [*a, *a]\n", None),
    ("[" * 500, None),
]


@pytest.mark.parametrize(("text", "params"), READ)
def test_values_are_texts_and_lists_of_texts(tmp_path, text, params):
    (tmp_path / "p.yaml").write_text(text)
    if params is None:
        with pytest.raises(ParamsFileError, match="p.yaml"):
            read_params(tmp_path / "p.yaml")
    else:
        assert read_params(tmp_path / "p.yaml") == params


def test_what_is_no_text_gets_a_letter(tmp_path):
    (tmp_path / "p.yaml").write_bytes(b"\xff\xfe\xfd")
    for path, words in ((tmp_path / "p.yaml", "text in UTF-16"), (tmp_path, "a folder")):
        with pytest.raises(ParamsFileError, match=words):
            read_params(path)
