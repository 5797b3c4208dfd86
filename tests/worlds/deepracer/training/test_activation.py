"""The files that shells read: both know the same commands, and PowerShell's grammar accepts its own."""

import re

import pytest

from racecraft.worlds.deepracer.training.activation import VERBS, shell_file


def test_both_shells_know_the_same_commands_and_hand_all_words_on():
    sh, powershell = shell_file("sh"), shell_file("powershell")
    in_sh = re.search(r"for _dr_verb in (.*); do", sh)[1].split()
    in_powershell = re.findall(r"^function global:dr-(\S+) { racecraft dr \1 @args }$", powershell, re.M)
    assert in_sh == in_powershell == list(VERBS)
    assert 'racecraft dr $_dr_verb \\"\\$@\\"' in sh
    assert "dr-update-env()" in sh
    assert "function global:dr-update-env" in powershell


def test_powershell_finds_nothing_in_its_file_that_it_does_otherwise_than_a_reader_thinks():
    """What can be checked where no PowerShell is: letters, paths, words that a strict mode or a policy refuses."""
    text = shell_file("powershell")
    assert text.isascii(), "Windows PowerShell reads a file without a mark in the alphabet of its country"
    assert "Resolve-Path" not in text, "its answer for a share or a drive of PowerShell's own is no path to others"
    assert "Out-String" not in text, "it lays out for the width of a window"
    assert not re.search(r"\[\w+\]::|Add-Type|New-Object", text), "a locked-down machine refuses methods of .NET"
    assert set(re.findall(r"\$(\w+)", text)) == {"Config", "Experiment", "PSScriptRoot", "LASTEXITCODE", "lines", "env"}
    first = next(line for line in text.splitlines() if line and not line.startswith("#"))
    assert first.startswith("param("), "parameters stand before anything else"
    took = text.index("racecraft dr env")
    assert took < text.index("$LASTEXITCODE"), "a strict mode refuses it before a program has run"


def test_powershells_own_grammar_accepts_its_file():
    """Optional: no PowerShell is asked for, only its grammar, `pip install tree-sitter tree-sitter-powershell`."""
    tree_sitter = pytest.importorskip("tree_sitter")
    grammar = pytest.importorskip("tree_sitter_powershell")
    parser = tree_sitter.Parser(tree_sitter.Language(grammar.language()))
    text = shell_file("powershell")
    tree = parser.parse(text.encode())
    assert not tree.root_node.has_error
    assert parser.parse(text.replace("@args }", "@args").encode()).root_node.has_error, "it can see an error"
