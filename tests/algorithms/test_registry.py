"""Algorithms by name: built in, registered, installed, and a user's own; and what is said of those that do not fit."""

import importlib.metadata
import sys
import textwrap

import pytest

from racecraft.algorithms import registry
from racecraft.algorithms.registry import (
    ALGORITHMS,
    EVERYTHING,
    Algorithm,
    algorithm_of,
    all_algorithms,
    find_algorithm,
    register_algorithm,
    require_fit,
)
from racecraft.algorithms.reinforce import ReinforceLearner
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ContinuousActions, DiscreteActions


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder that is the present one; what is imported from it is forgotten afterwards."""
    before, path = set(sys.modules), list(sys.path)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    sys.path[:] = path
    for name in set(sys.modules) - before:
        if not name.startswith(("torch", "racecraft")):
            del sys.modules[name]


@pytest.fixture(autouse=True)
def _nothing_registered(monkeypatch):
    monkeypatch.setattr(registry, "_registered", {})


def write(path, text):
    path.write_text(textwrap.dedent(text))


def test_every_built_in_algorithm_keeps_what_its_entry_says():
    for one in ALGORITHMS.values():
        learner, config = one.learner_class(), one.config_class()
        assert all(hasattr(learner, part) for part in registry.PROMISED), one.name
        assert one.group == config.__name__.removesuffix("Config").lower() == one.name
        assert config() == config(), "its settings stand by themselves"
        assert learner.figures, one.name


def test_a_module_in_the_present_folder_is_found(folder):
    write(folder / "fresh_module.py", """
        from racecraft.algorithms.reinforce import ReinforceConfig, ReinforceLearner

        class Mine(ReinforceLearner):
            '''Learns my way.'''
            Config = ReinforceConfig
    """)  # fmt: skip
    found = find_algorithm("fresh_module:Mine")
    assert (found.name, found.title, found.group) == ("fresh_module:Mine", "Learns my way.", "mine")
    assert found.learner_class().__name__ == "Mine"
    assert found.config_class().__name__ == "ReinforceConfig"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("no_such_module:Mine", "no module 'no_such_module'"),
        ("half_module:Mind", "Did you mean 'Mine'"),
        ("half_module:Mine", "lacks eats, figures, build"),
        ("half_module:number", "lacks"),
        ("half_module:", "module:Class"),
        ("broken_module:Mine", "ZeroDivisionError"),
        ("needs_more:Mine", "no module 'not_installed_here'"),
        ("reinforced", "reinforce"),
    ],
)
def test_what_cannot_be_an_algorithm_is_named(folder, name, said):
    write(folder / "half_module.py", "class Mine: ...\nnumber = 3\n")
    write(folder / "broken_module.py", "1 / 0\n")
    write(folder / "needs_more.py", "import not_installed_here\n")
    with pytest.raises(SettingError) as caught:
        find_algorithm(name)
    assert said in str(caught.value)


class Registered(ReinforceLearner):
    """Registered by a script."""


def test_a_script_registers_its_own_but_takes_no_built_in_name():
    register_algorithm("mine", Registered)
    assert find_algorithm("mine").own is Registered
    assert [one.name for one in all_algorithms()][-1] == "mine"
    with pytest.raises(SettingError, match="built in"):
        register_algorithm("ppo", Registered)


def test_an_installed_package_offers_one(monkeypatch):
    point = importlib.metadata.EntryPoint("offered", f"{__name__}:Registered", registry.ENTRY_POINTS)
    monkeypatch.setattr(registry, "entry_points", lambda group: [point] if group == registry.ENTRY_POINTS else [])
    monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
    assert find_algorithm("offered").title == "Registered by a script."
    assert "offered" in [one.name for one in all_algorithms()]


def test_an_algorithm_that_does_not_fit_names_those_that_do():
    picky = Algorithm("picky", "", "", "", "", acts=(registry.CHOICES,))
    require_fit(picky, DiscreteActions(2), "a world")
    with pytest.raises(SettingError, match="numbers.*ppo, sac, reinforce, es"):
        require_fit(picky, ContinuousActions((0.0,), (1.0,)), "a world")


def test_settings_of_a_users_own_algorithm_are_composed():
    from racecraft.training.worlds import kind_named

    class Own(ReinforceLearner):
        from racecraft.algorithms.reinforce import ReinforceConfig as Config

    settings = kind_named("gymnasium").default_settings(algorithm_of(Own, "x:Own"))
    assert settings.own.discount == 0.99


@pytest.mark.parametrize("kind", ["gymnasium", "deepracer", "unity"])
@pytest.mark.parametrize("algorithm", ["reinforce", "es"])
def test_what_learns_from_whole_episodes_is_given_one_of_every_world(kind, algorithm):
    from racecraft.training.worlds import kind_named

    rollout = kind_named(kind).default_settings(find_algorithm(algorithm)).rollout
    assert rollout.episodes_per_iteration == rollout.num_worlds
    assert kind_named(kind).default_settings(find_algorithm("ppo")).rollout.episodes_per_iteration is None


def test_snakes_are_not_taught_by_whole_games():
    from racecraft.envs.battlesnake.settings import GameSettings
    from racecraft.training.battlesnake.trainer import SnakeRequest, plan

    with pytest.raises(SettingError, match=r"--algorithm es learns from whole episodes.*Use ppo"):
        plan(SnakeRequest(GameSettings(), algorithm="es"))


def test_who_learns_by_search_fits_only_where_one_is_brought_along():
    with pytest.raises(SettingError, match="brings none along; expected `racecraft snakes train`") as caught:
        require_fit(find_algorithm("alphazero"), DiscreteActions(2), "CartPole-v1")
    assert str(caught.value).endswith("Algorithms that fit: ppo, dqn, apex, reinforce, es, bc.")
    with pytest.raises(SettingError, match="Algorithms that fit: ppo, dqn, apex, reinforce, es, bc.$"):
        require_fit(find_algorithm("sac"), DiscreteActions(2), "CartPole-v1")
    require_fit(find_algorithm("alphazero"), DiscreteActions(4), "snakes", is_searched=True)
    with pytest.raises(SettingError, match="Algorithms that fit: .*, alphazero, bc.$"):
        require_fit(find_algorithm("sac"), DiscreteActions(4), "snakes", is_searched=True)


def test_an_algorithm_says_in_words_what_it_decides():
    some, every = find_algorithm("dqn"), find_algorithm("ppo")
    assert some.acts_text == ", ".join(some.acts)
    assert set(every.acts) == set(EVERYTHING)
    assert every.acts_text == "any action"
