"""Unity players as a World."""

import contextlib
import os
import signal
import socket
import struct
import sys
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import UserInputError
from racecraft.contract.world import (
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
    World,
    allocate,
)
from racecraft.worlds.unity.env.errors import BuildError, PlayerDiedError, UnityError
from racecraft.worlds.unity.env.process import wait_until_gone
from racecraft.worlds.unity.env.session import Session
from racecraft.worlds.unity.env.side_channels import STATISTICS, SideChannels, Statistic, Uniform, pack_string
from racecraft.worlds.unity.env.world import ENGINE_FOR_INFERENCE, ENGINE_FOR_TRAINING, UnityWorld


@pytest.fixture
def opened():
    worlds = []

    def open_world(build, **words):
        world = UnityWorld(build, **words)
        worlds.append(world)
        return world, allocate(world.spec)

    yield open_world
    for world in worlds:
        world.close()


def story(world, buffers, seed, actions):
    moments = []
    world.reset(buffers, seed)
    for row in actions:
        world.step(row, buffers)
        moments.append((buffers.observations["Basic"].copy(), buffers.reward.copy(), buffers.ended.copy()))
    return moments


def test_where_one_of_several_players_does_not_start_the_others_are_ended(monkeypatch):
    ended = []

    def opening(self, index, seed):
        if index == 1:
            raise BuildError("it does not start")
        return SimpleNamespace(session=SimpleNamespace(close=lambda: ended.append(index)))

    monkeypatch.setattr(UnityWorld, "_open", opening)
    with pytest.raises(BuildError, match="it does not start"):
        UnityWorld("builtin:Basic", num_players=3)
    assert ended == [0, 2]


def test_agents_of_several_processes_are_one_batch(opened):
    world, buffers = opened("builtin:Basic", num_players=2, args=["--agents", "3"])
    assert isinstance(world, World)
    assert (world.spec.num_worlds, world.spec.num_agents) == (6, 1)
    assert world.spec.actions == DiscreteActions(3)
    world.reset(buffers, 0)
    actions = np.array([2, 1, 0, 2, 2, 1]).reshape(6, 1)
    world.step(actions, buffers)
    assert buffers.observations["Basic"].argmax(-1).ravel().tolist() == [11, 9, 10, 11, 11, 9]
    np.testing.assert_allclose(buffers.reward, -0.01)
    assert buffers.active.all()
    assert buffers.action_mask.all()


def test_an_end_shows_its_last_observation_and_the_next_start_in_one_step(opened):
    world, buffers = opened("builtin:Basic")
    world.reset(buffers, 0)
    for _ in range(7):
        assert not buffers.ended.any()
        world.step(np.array([[2]]), buffers)
    assert buffers.terminated.all()
    assert not buffers.truncated.any()
    assert buffers.final_observations["Basic"].argmax() == 17
    assert buffers.observations["Basic"].argmax() == 10
    (episode,) = world.pop_episodes()
    assert (episode.steps, episode.status) == (7, "terminated")
    assert episode.reward == pytest.approx(0.93)
    assert world.pop_episodes() == []


@pytest.mark.parametrize("args", [(), ("--late-start",), ("--agents", "2", "--late-start")])
def test_an_episode_that_begins_a_message_late_is_the_same_story(opened, args):
    """With one agent the empty message is passed over; with more, nobody ends alone here, so rows stay in step."""
    world, buffers = opened("builtin:Basic", args=args)
    rows = world.spec.num_worlds
    story_told = story(world, buffers, 0, np.full((14, rows, 1), 2))
    assert [told[2].all() for told in story_told] == [False] * 6 + [True] + [False] * 6 + [True]
    assert [told[0][0].argmax() for told in story_told][6:9] == [10, 11, 12]
    np.testing.assert_allclose(story_told[7][1], np.full((rows, 1), -0.01), rtol=1e-6)


def test_rows_wait_while_others_act(opened):
    """Agent 0 ends at once at place 7 and its next episode begins a message late; agent 1 goes on meanwhile."""
    world, buffers = opened("builtin:Basic", args=["--agents", "2", "--late-start"])
    world.reset(buffers, 0)
    for _ in range(3):
        world.step(np.array([[1], [2]]), buffers)
    assert buffers.terminated.ravel().tolist() == [True, False]
    assert buffers.active.ravel().tolist() == [False, True]
    world.step(np.array([[1], [2]]), buffers)
    assert buffers.active.all()
    assert buffers.observations["Basic"].argmax(-1).ravel().tolist() == [10, 14]
    assert buffers.reward.ravel().tolist() == pytest.approx([0.0, -0.01])


def test_a_reset_in_place_keeps_the_process_and_the_place(opened):
    world, buffers = opened("builtin:Basic", restart_on_reset=False)
    pid = world.sessions[0].pid
    world.reset(buffers, 0)
    world.step(np.array([[2]]), buffers)
    world.reset(buffers, 0)
    assert world.sessions[0].pid == pid
    assert buffers.observations["Basic"].argmax() == 11
    world.step(np.array([[2]]), buffers)
    np.testing.assert_allclose(buffers.reward, -0.01)


def test_a_first_reset_with_the_seed_of_the_start_needs_no_new_start(opened):
    world, buffers = opened("builtin:Basic", seed=5)
    pid = world.sessions[0].pid
    world.reset(buffers, 5)
    assert world.sessions[0].pid == pid
    world.reset(buffers, 6)
    assert world.sessions[0].pid != pid
    assert wait_until_gone(pid)


def test_what_a_scene_recorded_is_told_though_its_player_has_ended_since(opened):
    world, buffers = opened("builtin:Basic", seed=5)
    told = pack_string("score") + struct.pack("<fi", 2.5, 2)
    world.sessions[0].channels.receive(STATISTICS.bytes_le + struct.pack("<i", len(told)) + told)
    world.reset(buffers, 6)  # in a new player
    assert world.take_statistics() == [Statistic("score", 2.5, "sum")]
    assert world.take_statistics() == []


def test_going_on_from_a_saved_state_begins_new_episodes(opened):
    world, buffers = opened("builtin:Basic")
    world.reset(buffers, 1)
    world.step(np.array([[2]]), buffers)
    state = world.save_state()
    world.load_state(state, buffers)
    assert buffers.observations["Basic"].argmax() == 10


def test_hybrid_actions_and_seeds_reach_the_scene(opened, program):
    """The scene pays 1 for its bit and takes the distance to its number: the right answer earns 1 each step."""
    world, buffers = opened(program("copy"), seed=11)
    assert world.spec.actions == HybridActions(ContinuousActions((-1.0,), (1.0,)), MultiDiscreteActions((2,)))
    assert buffers.action_mask.shape == (4, 1, 2)
    world.reset(buffers, 11)
    expected = np.random.default_rng(11)
    expected.uniform(-1, 1, 4), expected.integers(0, 2, 4)  # drawn when the scene began, again at the reset
    np.testing.assert_allclose(buffers.observations["sight"][:, 0, 0], expected.uniform(-1, 1, 4), rtol=1e-6)
    for _ in range(5):
        number, bit = np.moveaxis(buffers.observations["sight"], -1, 0)
        world.step(np.stack([number, bit], axis=-1), buffers)
        np.testing.assert_allclose(buffers.reward, 1.0, atol=1e-5)


def test_teams_of_one_behavior_are_acted_for_together(opened, program):
    world, buffers = opened(program("game"), behavior="Striker", together=True)
    assert (world.spec.num_worlds, world.spec.num_agents) == (1, 4)
    world.reset(buffers, 0)
    for _ in range(3):
        world.step(np.zeros((1, 4, 2), np.float32), buffers)
    # at the third tick agent 0 of each team ends: with 1.0, team 1's was interrupted; the others earn 0.25 + 0.5
    assert buffers.terminated.tolist() == [[True, False, False, False]]
    assert buffers.truncated.tolist() == [[False, False, True, False]]
    np.testing.assert_allclose(buffers.reward, [[1.0, 0.75, 1.0, 0.75]])
    assert buffers.active.all()


def test_one_behavior_of_several_is_chosen_and_the_others_do_what_is_allowed(opened, program):
    world, buffers = opened(program("game"), behavior="Striker?team=1")
    assert world.spec.num_worlds == 2
    world.reset(buffers, 0)
    world.step(np.zeros((2, 1, 2), np.float32), buffers)
    world, buffers = opened(program("game"), behavior="Referee")
    assert world.spec.actions == MultiDiscreteActions((2, 2))
    world.reset(buffers, 0)
    assert buffers.action_mask.ravel().tolist() == [False, True, True, True], "a column for each choice of each branch"
    with pytest.raises(BuildError, match="Choose one with behavior="):
        opened(program("game"))
    with pytest.raises(BuildError, match="no behavior is named 'Goalie'"):
        opened(program("game"), behavior="Goalie")


def test_more_agents_than_rows_is_told_with_the_cure(opened):
    world, buffers = opened("builtin:Basic", args=["--agents", "2"], max_agents=1)
    with pytest.raises(UnityError, match="max_agents"):
        world.reset(buffers, 0)


def test_spare_rows_stay_inactive(opened):
    world, buffers = opened("builtin:Basic", max_agents=3)
    world.reset(buffers, 0)
    assert buffers.active.ravel().tolist() == [True, False, False]


def lose(world, index=0):
    os.kill(world.sessions[index].pid, signal.SIGKILL)


def test_a_lost_player_costs_its_episodes_and_a_new_start_not_the_world(opened, caplog):
    world, buffers = opened("builtin:Basic", args=["--agents", "2"], num_players=2)
    world.reset(buffers, 0)
    right = np.full((4, 1), 2)
    world.step(right, buffers)
    other = world.sessions[1].pid
    lose(world)
    world.step(right, buffers)
    assert buffers.truncated.ravel().tolist() == [True, True, False, False]
    assert buffers.final_observations["Basic"].argmax(-1).ravel().tolist()[:2] == [11, 11]
    assert buffers.observations["Basic"].argmax(-1).ravel().tolist() == [10, 10, 12, 12]
    assert [episode.status for episode in world.pop_episodes()] == ["truncated"] * 2
    assert (world.restarts, world.sessions[1].pid) == (1, other)
    assert "started anew; its episodes under way are cut" in caplog.text
    world.step(right, buffers)
    assert buffers.observations["Basic"].argmax(-1).ravel().tolist() == [11, 11, 13, 13]


def test_players_that_are_lost_too_often_are_an_error_that_names_the_limit(opened):
    """ML-Agents' defaults: ten new starts each player, one a minute."""
    world, buffers = opened("builtin:Basic")
    world.reset(buffers, 0)
    right = np.full((1, 1), 2)
    lose(world)
    world.step(right, buffers)
    lose(world)
    with pytest.raises(PlayerDiedError, match="1 times in the last 60 s, and restarts_rate_limit_n is 1"):
        world.step(right, buffers)
    world, buffers = opened("builtin:Basic", max_lifetime_restarts=0)
    world.reset(buffers, 0)
    lose(world)
    with pytest.raises(PlayerDiedError, match="max_lifetime_restarts is 0; give more, or -1"):
        world.step(right, buffers)


def test_a_player_lost_between_episodes_is_started_anew_too(opened):
    world, buffers = opened("builtin:Basic", restart_on_reset=False)
    world.reset(buffers, 0)
    world.step(np.full((1, 1), 2), buffers)
    lose(world)
    world.reset(buffers, 0)
    assert buffers.observations["Basic"].argmax() == 10
    assert world.restarts == 1


def test_ports_count_up_from_the_first_where_one_is_wished_for(opened):
    first = free_ports(2)
    world, buffers = opened("builtin:Basic", num_players=2, base_port=first)
    assert [session.port for session in world.sessions] == [first, first + 1]
    world.reset(buffers, 9)  # another seed: new players, on the same ports
    assert [session.port for session in world.sessions] == [first, first + 1]


def free_ports(count):
    """Return the first of so many free ports in a row."""
    while True:
        with contextlib.ExitStack() as held, contextlib.suppress(OSError):
            probes = [held.enter_context(socket.socket()) for _ in range(count)]
            probes[0].bind(("127.0.0.1", 0))
            first = probes[0].getsockname()[1]
            for offset, probe in enumerate(probes[1:], 1):
                probe.bind(("127.0.0.1", first + offset))
            return first


@pytest.mark.parametrize(
    ("words", "time_scale", "width"),
    [
        ({}, 20.0, 84),
        ({"time_scale": 3.0}, 3.0, 84),
        ({"inference": True}, 1.0, 1280),
        ({"engine": {"time_scale": 7.0}}, 7.0, None),
    ],
)
def test_the_engine_runs_as_fast_as_asked(opened, monkeypatch, words, time_scale, width):
    sent = []
    monkeypatch.setattr(SideChannels, "set_engine", lambda self, **engine: sent.append(engine))
    opened("builtin:Basic", **words)
    assert (sent[0]["time_scale"], sent[0].get("width")) == (time_scale, width)


def test_samplers_have_seeds_of_their_own(opened, monkeypatch):
    seeds = {}

    def note(self, key, value, seed=0):
        seeds.setdefault(key, []).append(seed)

    monkeypatch.setattr(SideChannels, "set_parameter", note)
    world, _ = opened(
        "builtin:Basic", num_players=2, seed=3, parameters={"wind": Uniform(0.0, 1.0), "mass": Uniform(0.0, 1.0)}
    )
    assert len({*seeds["wind"], *seeds["mass"]}) == 4
    assert all(0 <= seed < 2**31 for told in seeds.values() for seed in told)
    before = sorted(seeds["wind"])
    world.set_parameter("wind", Uniform(1.0, 2.0))
    assert sorted(seeds["wind"][2:]) == before


def test_rows_may_be_strided_views_of_the_callers_storage(opened):
    world, buffers = opened("builtin:Basic", args=["--agents", "3"])
    storage = np.zeros((3, 5, 1, 20), np.float32)
    buffers.observations["Basic"] = storage[:, 2]
    buffers.reward = np.zeros((3, 4), np.float32)[:, 1:2]
    world.reset(buffers, 0)
    world.step(np.full((3, 1), 2), buffers)
    assert storage[:, 2].argmax(-1).ravel().tolist() == [11] * 3
    np.testing.assert_allclose(buffers.reward, -0.01)


def test_agents_of_one_process_cost_few_calls_each_and_share_their_messages(opened, monkeypatch):
    """What makes many agents fast, counted: seconds hang on who else is busy, benchmarks/unity.py has those."""
    send, sent = Session.send_step, []
    monkeypatch.setattr(Session, "send_step", lambda self, choices: sent.append(send(self, choices)))
    calls, messages = {}, {}
    for agents in (8, 64):
        world, buffers = opened("builtin:Basic", args=["--agents", str(agents)])
        world.reset(buffers, 0)
        actions, made = np.full((agents, 1), 2), Counter()
        sent.clear()
        sys.setprofile(lambda frame, event, _, made=made: made.update((event,)))
        for _ in range(12):  # past the end of an episode
            world.step(actions, buffers)
        sys.setprofile(None)
        calls[agents], messages[agents] = made["call"] + made["c_call"], len(sent)
    assert messages[64] == messages[8] <= 2 * 12
    assert (calls[64] - calls[8]) / (64 - 8) / 12 < 40, "calls that one more agent costs at each tick"


@pytest.fixture
def unopened(monkeypatch):
    """Open worlds whose players do not start; return the index and the seed of each that was to."""

    def open_world(**words):
        opened = []

        def opening(self, index, seed):
            opened.append((index, seed))
            raise BuildError("it does not start")

        monkeypatch.setattr(UnityWorld, "_open", opening)
        with pytest.raises(BuildError, match="it does not start"):
            UnityWorld("builtin:Basic", **words)
        return sorted(opened)

    return open_world


def test_players_have_seeds_of_their_own_that_the_protocol_can_carry(unopened):
    players = unopened(num_players=24, seed=7)
    assert [index for index, _ in players] == list(range(24))
    assert players[0][1] == 7
    seeds = {seed for _, seed in players}
    assert len(seeds) == 24
    assert all(0 <= seed < 2**31 for seed in seeds)
    assert players == unopened(num_players=24, seed=7)
    assert unopened() == [(0, 0)], "one player, with the first seed"


@pytest.mark.parametrize(("port", "players", "last"), [(0, 1, 65535), (65535, 2, 65534)])
def test_ports_that_there_are_not_are_refused(port, players, last):
    with pytest.raises(UserInputError, match=f"base_port is {port}; expected 1 to {last} for {players} players"):
        UnityWorld("builtin:Basic", base_port=port, num_players=players)


def test_the_editor_is_one_player():
    with pytest.raises(BuildError, match="the Editor is one player"):
        UnityWorld("editor", num_players=2)


def test_players_run_as_those_of_mlagents_learn():
    """The defaults of its engine_settings; and those of a clock on the wall where somebody watches."""
    assert ENGINE_FOR_TRAINING == {
        "width": 84, "height": 84, "quality_level": 5, "time_scale": 20.0, "target_frame_rate": -1,
        "capture_frame_rate": 60,
    }  # fmt: skip
    assert ENGINE_FOR_INFERENCE == {
        "width": 1280, "height": 720, "quality_level": 5, "time_scale": 1.0, "target_frame_rate": 60,
        "capture_frame_rate": 0,
    }  # fmt: skip


def test_a_new_start_that_is_lost_as_well_is_followed_by_another(opened, monkeypatch):
    world, buffers = opened("builtin:Basic", restarts_rate_limit_n=-1)
    world.reset(buffers, 0)
    start, tried = world._open, []

    def again(index, seed):
        tried.append(seed)
        if len(tried) == 1:
            raise PlayerDiedError("it fell over at once")
        return start(index, seed)

    monkeypatch.setattr(world, "_open", again)
    lose(world)
    world.step(np.array([[2]]), buffers)
    assert (tried, world.restarts) == ([0, 0], 2)
    assert (buffers.truncated.all(), buffers.observations["Basic"].argmax()) == (True, 10)


class TestBasicSitsTheExam(WorldConformance):
    """Worlds are agents of one process; N worlds are a process with N agents."""

    ticks = 60

    def make_world(self, num_worlds):
        return UnityWorld("builtin:Basic", args=["--agents", str(num_worlds)], seed=self.seed)

    def test_a_saved_world_goes_on_as_if_nothing_had_happened(self):
        pytest.skip("a Unity player cannot be frozen; load_state begins new episodes, see its docstring")
