"""What is shown of work under way: a bar on a terminal, nothing in a pipe."""

import re

from rich.console import Console

from racecraft.cli import output


def test_a_pipe_is_told_nothing_and_a_terminal_how_much_is_done(monkeypatch, capsys):
    with output.counting("pictures", quiet_stdout=True) as count:
        count(3, 7)
    said = capsys.readouterr()
    assert (said.out, said.err) == ("", "")
    monkeypatch.setattr("rich.console.Console", lambda stderr: Console(stderr=stderr, force_terminal=True, width=80))
    with output.counting("pictures", quiet_stdout=True) as count:
        count(3, 7)
    said = capsys.readouterr()
    assert said.out == ""
    assert "3/7 pictures" in re.sub(r"\x1b\[[\d;?]*\w", "", said.err)
