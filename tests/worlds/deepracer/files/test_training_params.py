"""Params files: what we write we read, and so does a YAML library."""

import pytest

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
    yaml = pytest.importorskip("yaml", reason="no YAML library is installed")
    write_params(tmp_path / "p.yaml", PARAMS)
    assert yaml.safe_load((tmp_path / "p.yaml").read_text()) == AS_TEXT


def test_what_others_write_is_read(tmp_path):
    text = (
        "\ufeff# made by hand\nA: plain # said aside\r\nB: \"two \\\"words\\\"\"\nC:\n  - x\n  - 'y'\nD: ['1,2', z]\n"
    )
    (tmp_path / "p.yaml").write_text(text, encoding="utf-8", newline="")
    assert read_params(tmp_path / "p.yaml") == {"A": "plain", "B": 'two "words"', "C": ["x", "y"], "D": ["1,2", "z"]}


@pytest.mark.parametrize(("text", "found"), [("A: 1\nhello\n", ":2: 'hello'"), ("- x\n", ":1: '- x'")])
def test_what_is_no_params_file_gets_a_letter(tmp_path, text, found):
    (tmp_path / "p.yaml").write_text(text)
    with pytest.raises(ParamsFileError) as caught:
        read_params(tmp_path / "p.yaml")
    assert str(caught.value).startswith(f"{tmp_path / 'p.yaml'}{found}; expected lines of KEY: 'value'")
    with pytest.raises(ParamsFileError, match="no such file"):
        read_params(tmp_path / "q.yaml")


READ = [  # text, what it says
    ("A: '\nB: \"\n", {"A": "'", "B": '"'}),
    ("A: 'it''s'\nB: ''\n", {"A": "it's", "B": ""}),
    ('A: "a\\\\b"\n', {"A": "a\\b"}),
    ('A: ""\n', {"A": ""}),
    ("A:\n- 1\n- 2\n", {"A": ["1", "2"]}),
    ("A: [1, 2]\n- 3\n", {"A": ["1", "2", "3"]}),
    ("A: []\nB: [ 'x, y' , \"z\",w ]\n", {"A": [], "B": ["x, y", "z", "w"]}),
    ("---\n# said\n\nA:\nB.c: d\n", {"A": "", "B.c": "d"}),
    ("A: b#c\n", {"A": "b#c"}),
    ("A: [x\nB: y]\n", {"A": "[x", "B": "y]"}),
    ("- x: 1\n", None),
    ("A: x\n- y\n", None),
    ("A:b\n", None),
    ("A:\n-x\n", None),
]


@pytest.mark.parametrize(("text", "params"), READ)
def test_a_line_says_what_yaml_makes_of_it_or_is_refused(tmp_path, text, params):
    (tmp_path / "p.yaml").write_text(text)
    if params is None:
        with pytest.raises(ParamsFileError, match=f"p.yaml:{text.count(chr(10))}: "):
            read_params(tmp_path / "p.yaml")
    else:
        assert read_params(tmp_path / "p.yaml") == params


def test_of_a_line_that_is_none_sixty_letters_are_shown(tmp_path):
    (tmp_path / "p.yaml").write_text("A: b\n" + "x" * 99)
    with pytest.raises(ParamsFileError) as caught:
        read_params(tmp_path / "p.yaml")
    assert (caught.value.found, caught.value.line) == (repr("x" * 60), 2)


def test_lists_of_any_kind_are_written_as_lists(tmp_path):
    write_params(tmp_path / "p.yaml", {"A": (1, "b'c"), "B": (), "C": [], "D": "text"})
    assert (tmp_path / "p.yaml").read_text() == "---\nA:\n- '1'\n- 'b''c'\nB: []\nC: []\nD: 'text'\n"


def test_what_is_no_text_gets_a_letter(tmp_path):
    (tmp_path / "p.yaml").write_bytes(b"\xff\xfe\xfd")
    for path, words in ((tmp_path / "p.yaml", "no UTF-8 text"), (tmp_path, "cannot be read")):
        with pytest.raises(ParamsFileError, match=words):
            read_params(path)
