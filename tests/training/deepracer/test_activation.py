"""The files that shells read: both know the same commands, and PowerShell's grammar accepts its own."""

import re

import pytest

from racecraft.training.deepracer.activation import VERBS, shell_file


def test_both_shells_know_the_same_commands_and_hand_all_words_on():
    sh, powershell = shell_file("sh"), shell_file("powershell")
    in_sh = re.search(r"for _dr_verb in (.*); do", sh)[1].split()
    in_powershell = re.search(r'foreach \(\$verb in "(.*)"\.Split', powershell)[1].split()
    assert in_sh == in_powershell == list(VERBS)
    assert 'racecraft dr $_dr_verb \\"\\$@\\"' in sh
    assert '"racecraft dr $verb @args"' in powershell
    assert "dr-update-env()" in sh
    assert "function global:dr-update-env" in powershell


def test_both_shells_take_an_experiment_or_a_run_env_and_forget_those_of_before():
    sh, powershell = shell_file("sh"), shell_file("powershell")
    for variable in ("DR_CONFIG", "RACECRAFT_DR_EXPERIMENT"):
        assert re.search(f"^unset .*{variable}", sh, re.M)
        assert re.search(f"^Remove-Item .*Env:{variable}", powershell, re.M)
        assert f"export {variable}" in sh
        assert f"$env:{variable} = " in powershell


def test_powershells_own_grammar_accepts_its_file():
    """Optional: no PowerShell is asked for, only its grammar, `pip install tree-sitter tree-sitter-powershell`."""
    tree_sitter = pytest.importorskip("tree_sitter")
    grammar = pytest.importorskip("tree_sitter_powershell")
    parser = tree_sitter.Parser(tree_sitter.Language(grammar.language()))
    text = shell_file("powershell")
    tree = parser.parse(text.encode())
    assert not tree.root_node.has_error
    assert parser.parse(text.replace('@args"))', '@args")').encode()).root_node.has_error, "it can see an error"
