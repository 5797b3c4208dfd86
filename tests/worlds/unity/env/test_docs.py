"""The pages are read by a machine: their code runs, and what they name is there."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[4] / "docs" / "unity"


def blocks():
    return re.findall(r"```python\n(.*?)```", (DOCS / "index.md").read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize("number", range(3))
def test_the_code_of_unity_in_five_minutes_runs(number, capsys):
    exec(compile(blocks()[number], f"index.md, block {number}", "exec"), {})
    if number == 0:
        assert capsys.readouterr().out == "[0.99]\n"


def test_the_code_on_demonstrations_runs(tmp_path, monkeypatch, capsys):
    """Two records of a behavior A that sees one number and chose 2 of 3, by hand."""
    record = "190a123d0000003f6a0b0a010122060a040000803f12033a0102"
    (tmp_path / "Demos").mkdir()
    whole = "0408011802".ljust(66, "0") + "061a01033a0141" + 2 * record
    (tmp_path / "Demos" / "a.demo").write_bytes(bytes.fromhex(whole))
    monkeypatch.chdir(tmp_path)
    (block,) = (block for block in blocks() if "read_demonstrations" in block)
    exec(compile(block, "index.md, demonstrations", "exec"), {})
    assert capsys.readouterr().out == "A 1 {'obs_0': (1, 1)}\n"


def test_every_test_file_the_protocol_page_names_is_there():
    named = set(re.findall(r"`(test_\w+)`", (DOCS / "protocol.md").read_text(encoding="utf-8")))
    assert named
    assert all((Path(__file__).parent / f"{name}.py").exists() for name in named)
