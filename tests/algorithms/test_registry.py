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
from racecraft.contract import loading
from racecraft.contract.errors import SettingError
from racecraft.contract.world import (
    ContinuousActions,
    DiscreteActions,
    GroupedActions,
    HybridActions,
    MultiDiscreteActions,
)


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
        ("half_module:Mine", "lacks experience, figures, build"),
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


def test_settings_of_a_users_own_algorithm_are_composed():
    from racecraft.training.worlds import training_in

    class Own(ReinforceLearner):
        from racecraft.algorithms.reinforce import ReinforceConfig as Config

    settings = training_in("gymnasium").default_settings(algorithm_of(Own, "x:Own"))
    assert settings.own.discount == 0.99


@pytest.mark.parametrize("kind", ["gymnasium", "deepracer", "unity"])
@pytest.mark.parametrize("algorithm", ["reinforce", "es"])
def test_what_learns_from_whole_episodes_is_given_one_of_every_world(kind, algorithm):
    from racecraft.training.worlds import training_in

    rollout = training_in(kind).default_settings(find_algorithm(algorithm)).rollout
    assert rollout.episodes_per_iteration == rollout.num_worlds
    assert training_in(kind).default_settings(find_algorithm("ppo")).rollout.episodes_per_iteration is None


def test_snakes_are_not_taught_by_whole_games():
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.training.trainer import SnakeRequest, plan

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


def test_what_an_entry_says_of_whole_episodes_and_replays_is_what_its_learner_eats():
    for one in ALGORITHMS.values():
        if one.name != "bc":  # it collects nothing
            experience = one.learner_class().experience
            assert (one.replay, one.whole_episodes) == (experience == "replay", experience == "episodes"), one.name
    assert dict(find_algorithm("apex").replay_values) == {"prioritised": True}
    assert dict(find_algorithm("dqn").replay_values) == {}


@pytest.mark.parametrize("experience", ["rollout", "episodes", "replay"])
def test_a_users_own_algorithm_is_what_its_class_says(experience):
    class Own(ReinforceLearner):
        """Learns my way.

        And more of it.
        """

        acts = [registry.NUMBERS]

    Own.experience = experience
    one = algorithm_of(Own, "mine")
    assert (one.name, one.learner, one.title, one.own) == ("mine", "Own", "Learns my way.", Own)
    assert one.acts == (registry.NUMBERS,)
    assert one.learner_class() is Own
    assert (one.config, one.group, one.config_class()) == ("", "", None)
    told = one.replay, one.whole_episodes, one.reward_signals
    assert told == (experience == "replay", experience == "episodes", experience != "replay")
    assert (one.critic, one.several_groups, one.searches, one.stays) == (True, False, False, "")


class Undescribed(ReinforceLearner):
    pass


@pytest.mark.parametrize(
    ("actions", "kind"),
    [
        (DiscreteActions(3), registry.CHOICES),
        (MultiDiscreteActions((3, 2)), registry.BRANCHES),
        (ContinuousActions((0.0,), (1.0,)), registry.NUMBERS),
        (HybridActions(ContinuousActions((0.0,), (1.0,)), MultiDiscreteActions((2,))), registry.BOTH),
    ],
)
def test_kinds_of_actions_in_words(actions, kind):
    assert registry.kind_of(actions) == kind
    only = Algorithm("only", "", "", "", "", acts=(kind,))
    require_fit(only, actions, "a world")
    for other in set(EVERYTHING) - {kind}:
        with pytest.raises(SettingError, match=f"decides {other}; an action of a world is {kind}"):
            require_fit(Algorithm("other", "", "", "", "", acts=(other,)), actions, "a world")


def test_agents_of_several_kinds_are_taught_by_who_may_alone():
    require_fit(find_algorithm("ppo"), GroupedActions(3), "a world")
    with pytest.raises(SettingError, match="--algorithm dqn teaches one policy; a world has agents of several kinds"):
        require_fit(find_algorithm("dqn"), GroupedActions(3), "a world")


def test_every_name_is_offered_once_the_registered_before_the_installed(monkeypatch):
    points = [
        importlib.metadata.EntryPoint(name, f"{__name__}:Registered", "racecraft.algorithms")
        for name in ("offered", "mine", "ppo")
    ]
    monkeypatch.setattr("racecraft.contract.extensions.entry_points", lambda group: points)
    register_algorithm("mine", Undescribed)
    found = all_algorithms()
    assert [one.name for one in found] == [*ALGORITHMS, "mine", "offered"]
    assert found[-2].own is Undescribed
    assert find_algorithm("mine").own is Undescribed
    assert find_algorithm("ppo").own is None
    with pytest.raises(SettingError, match="Did you mean 'offered'"):
        find_algorithm("offerd")


def test_the_present_folder_is_looked_in_first_and_once(monkeypatch):
    monkeypatch.setattr(sys, "path", ["elsewhere"])
    loading.add_cwd_to_path()
    loading.add_cwd_to_path()
    assert sys.path == ["", "elsewhere"]
