"""The glossary: its names are real ones, and a word is found under any of them."""

import pytest

from racecraft.algorithms.registry import find_algorithm
from racecraft.contract.errors import UserInputError
from racecraft.settings.overrides import find_setting
from racecraft.worlds.deepracer.actions.explain import ExplainRequest, explain
from racecraft.worlds.deepracer.files.hyperparameters import Hyperparameters
from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME
from racecraft.worlds.deepracer.training.glossary import GLOSSARY, find_terms, nearest_names
from racecraft.worlds.deepracer.training.presets import default_settings


def test_every_variable_and_every_setting_in_it_is_one():
    settings = {name: default_settings(find_algorithm(name)) for name in ("ppo", "sac")}
    for term in GLOSSARY:
        assert term.meaning.endswith("."), term
        for name in filter(None, (name.strip() for name in term.variable.split(","))):
            assert name in BY_NAME
        for name in filter(None, (name.strip() for name in term.ours.split(","))):
            if "." in name and " " not in name and not name.endswith(".json"):
                find_setting(settings["sac" if name.startswith("sac.") else "ppo"], name)


def test_every_hyperparameter_of_aws_is_explained():
    """Known from outside: the keys of the original's file."""
    keys = {name for name in Hyperparameters.__dataclass_fields__ if name not in ("unknown", "notes")}
    missing = {key for key in keys if not any(key in term.names for term in GLOSSARY)}
    assert missing == set()


def test_every_variable_is_explained():
    assert all(find_terms(name) for name in BY_NAME)


@pytest.mark.parametrize(
    ("word", "name"),
    [("learning RATE", "Learning rate"), ("ppo.discount", "Discount factor"), ("DR_WORLD_NAME", "Track")],
)
def test_a_word_is_found_under_any_of_its_names(word, name):
    assert [name in term.names for term in find_terms(word)] == [True]


def test_part_of_a_name_finds_all_that_hold_it_and_a_slip_the_nearest():
    assert {name for term in find_terms("epsilon") for name in term.names} >= {"epsilon_steps", "e_greedy_value"}
    assert nearest_names("beta_entrpy")[0] == "beta_entropy"
    assert find_terms("beta_entrpy") == []


def test_a_word_that_is_in_no_table_is_refused_with_the_nearest():
    with pytest.raises(UserInputError, match="exploration"):
        explain(ExplainRequest(word=("exploratoin",)))
