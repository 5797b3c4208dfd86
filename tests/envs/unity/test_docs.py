"""The pages are read by a machine: their code runs, and what they name is there."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[3] / "docs" / "unity"


def blocks():
    return re.findall(r"```python\n(.*?)```", (DOCS / "index.md").read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize("number", range(3))
def test_the_code_of_unity_in_five_minutes_runs(number, capsys):
    exec(compile(blocks()[number], f"index.md, block {number}", "exec"), {})
    if number == 0:
        assert capsys.readouterr().out == "[0.99]\n"


def test_every_test_file_the_protocol_page_names_is_there():
    named = set(re.findall(r"`(test_\w+)`", (DOCS / "protocol.md").read_text(encoding="utf-8")))
    assert named
    assert all((Path(__file__).parent / f"{name}.py").exists() for name in named)
