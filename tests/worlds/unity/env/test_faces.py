"""Unity scenes as Gymnasium and PettingZoo see them."""

import warnings

import numpy as np
import pytest

from racecraft.worlds.unity.env.errors import BuildError, SessionClosedError
from racecraft.worlds.unity.env.gymnasium_env import unity_env, unity_vector_env


@pytest.mark.long
def test_gymnasiums_checker_is_content():
    """It resets with a seed time and again, which starts the player anew each time."""
    from gymnasium.utils.env_checker import check_env

    env = unity_env("builtin:Basic")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the checker has opinions on infinite bounds
        check_env(env, skip_render_check=True)
    env.close()


def test_gymnasium_makes_a_scene_by_name():
    import gymnasium

    env = gymnasium.make("racecraft.adapters:racecraft/Unity-v0", build="builtin:Basic", disable_env_checker=True)
    _, info = env.reset(seed=1)
    assert info["action_mask"].tolist() == [True] * 3
    earned, over = 0.0, False
    while not over:
        _, reward, terminated, truncated, _ = env.step(2)
        earned, over = earned + reward, terminated or truncated
    assert earned == pytest.approx(0.93)
    assert (terminated, truncated) == (True, False)
    env.close()


def test_several_agents_are_a_vector_env_and_no_env():
    with pytest.raises(BuildError, match="unity_vector_env"):
        unity_env("builtin:Basic", args=["--agents", "2"])
    envs = unity_vector_env("builtin:Basic", args=["--agents", "2"])
    seen, _ = envs.reset(seed=0)
    assert seen.shape == (2, 20)
    envs.close()


def test_every_behavior_of_a_scene_plays_in_a_parallel_env(program):
    pytest.importorskip("pettingzoo")
    from racecraft.worlds.unity.env.parallel import unity_parallel

    env = unity_parallel(program("game"))
    seen, infos = env.reset()
    strikers = [f"Striker?team={team}?agent_id={i}" for team in (0, 1) for i in (0, 1)]
    referee = "Referee?team=0?agent_id=0"
    assert env.agents == env.possible_agents == [*strikers, referee]
    assert seen[strikers[2]].tolist() == [1.0, 0.0, 0.5]
    assert infos[referee]["action_mask"].tolist() == [False, True, True, True]
    assert env.action_space(referee).nvec.tolist() == [2, 2]
    steers = env.action_space(strikers[0])
    assert (steers.low.tolist(), steers.high.tolist()) == ([-1.0, -1.0], [1.0, 1.0])
    for _ in range(3):
        actions = {name: env.action_space(name).sample() for name in env.agents}
        actions[referee] = np.array([1, 0])
        seen, rewards, terminated, truncated, _ = env.step(actions)
    assert [name for name in terminated if terminated[name]] == [strikers[0]]
    assert [name for name in truncated if truncated[name]] == [strikers[2]]
    assert rewards[strikers[0]] == 1.0
    assert rewards[strikers[1]] == 0.75
    assert env.agents == [strikers[1], strikers[3], referee]
    seen, *_ = env.step({name: env.action_space(name).sample() if name != referee else [1, 1] for name in env.agents})
    assert list(seen) == env.agents
    assert all(env.observation_space(name).contains(seen[name]) for name in seen)
    env.reset(seed=3)
    assert len(env.agents) == 5
    env.close()


def test_a_game_of_one_behavior_ends_when_everybody_has_left():
    pytest.importorskip("pettingzoo")
    from racecraft.worlds.unity.env.parallel import unity_parallel

    env = unity_parallel("builtin:Basic", args=["--agents", "2"])
    env.reset()
    a, b = env.agents
    for _ in range(3):
        *_, terminated, _, _ = env.step({a: 1, b: 2})
    assert terminated == {a: True, b: False}
    assert env.agents == [b]
    for _ in range(4):
        _, rewards, terminated, _, _ = env.step({b: 2})
    assert rewards == {b: pytest.approx(0.99)}
    assert terminated == {b: True}
    assert env.agents == []
    env.reset()
    assert env.agents == [a, b]
    env.close()
    with pytest.raises(SessionClosedError):
        env.reset()
