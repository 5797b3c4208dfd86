"""A reward file before it is run: read, written again, refused."""

import pytest

from racecraft.contract.errors import RewardFileError
from racecraft.worlds.deepracer.files.reward_source import how_to_install, read_reward_source, write_reward


def test_a_file_and_what_it_needs_are_written_as_they_were(tmp_path):
    (tmp_path / "helpers").mkdir()
    (tmp_path / "helpers" / "inner.py").write_text("PAY = 2\n")
    (tmp_path / "mine.py").write_text("from helpers.inner import PAY\ndef reward_function(p):\n    return PAY\n")
    source = read_reward_source(tmp_path / "mine.py")
    (tmp_path / "again").mkdir()
    write_reward(source, tmp_path / "again")
    again = read_reward_source(tmp_path / "again" / "reward_function.py")
    assert (again.text, again.modules) == (source.text, {"helpers/inner.py": "PAY = 2\n"})


def test_a_missing_module_is_named_as_it_is_installed(tmp_path):
    assert how_to_install("PIL.Image", tmp_path / "r.py") == (
        "Install 'PIL' into this environment with `python -m pip install pillow`, or put PIL.py beside r.py."
    )


def test_a_remark_is_told_with_file_and_line(tmp_path):
    (tmp_path / "r.py").write_text("def reward_function(p):\n    return float(p['steps'] == 1)\n")
    (remark,) = read_reward_source(tmp_path / "r.py").remarks
    assert remark.startswith("r.py:2: `p['steps'] == 1` never holds")


def test_a_module_beside_it_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "helper.py").write_bytes(b"\xff\xfe\xfd")
    (tmp_path / "r.py").write_text("import helper\ndef reward_function(p):\n    return 1\n")
    with pytest.raises(RewardFileError, match=r"r\.py: a module beside it cannot be read"):
        read_reward_source(tmp_path / "r.py")


def test_annotations_are_what_python_makes_of_them(tmp_path):
    """Python compiles a text with the future imports of whoever compiles it, unless it is told not to."""
    (tmp_path / "r.py").write_text("def reward_function(p: int): ...\n")
    names = {}
    exec(read_reward_source(tmp_path / "r.py").code, names)
    assert names["reward_function"].__annotations__ == {"p": int}
