"""The conversation: order, positions, endings, versions, and players that lie."""

import numpy as np
import pytest

from racecraft.worlds.unity.env.behaviors import UnityActions
from racecraft.worlds.unity.env.errors import (
    PlayerDiedError,
    PlayerLeftError,
    PlayerTimeoutError,
    SessionClosedError,
    UnityError,
    WireError,
    WireVersionError,
)
from racecraft.worlds.unity.env.player import Info, ObservationMessage, Player, UnityActionSpec
from racecraft.worlds.unity.env.session import Choice, Session
from racecraft.worlds.unity.files import messages

BASIC = "Basic?team=0"


def sight(*numbers):
    return [ObservationMessage(np.array(numbers, np.float32))]


def test_seven_steps_to_the_right_earn_the_best_return():
    """7 * -0.01 + 1.0 = 0.93, over a real process."""
    with Session("builtin:Basic") as session:
        moment = session.reset()[BASIC]
        assert moment.decisions.observations[0].argmax() == 10
        earned = 0.0
        for _ in range(7):
            moment = session.step({BASIC: Choice(discrete=[[2]])})[BASIC]
            earned += float(moment.ended.reward.sum() or moment.decisions.reward.sum())
        assert earned == pytest.approx(0.93)
        assert moment.ended.observations[0].argmax() == 17
        assert not moment.ended.interrupted[0]
        # the next episode's first decision stands in the same message, with another id
        assert moment.decisions.observations[0].argmax() == 10
        assert moment.decisions.agent_id[0] != moment.ended.agent_id[0]


def test_a_reset_moves_nobody_and_brings_no_reward(talk, scenes):
    """The scene itself tells -0.01 of a zero action that nobody chose."""
    session = talk(scenes.BasicScene())
    session.reset()
    session.step({BASIC: Choice(discrete=[[2]])})
    moment = session.reset()[BASIC]
    assert moment.decisions.observations[0].argmax() == 11
    assert moment.decisions.reward.tolist() == [0.0]


def test_ends_that_ride_with_a_reset_are_left_out(talk, scenes):
    scene = scenes.Recorder(
        {"A": UnityActionSpec(continuous=1)}, [{"A": [Info(0, sight(1), 3.0, done=True), Info(1, sight(2))]}]
    )
    moment = talk(scene).reset()["A"]
    assert len(moment.ended) == 0
    assert moment.decisions.agent_id.tolist() == [1]


def test_actions_go_back_by_position_and_ends_take_no_place(talk, scenes):
    infos = [Info(7, sight(1)), Info(3, sight(2), done=True), Info(5, sight(3))]
    scene = scenes.Recorder({"A": UnityActionSpec(continuous=2)}, [{"A": infos}])
    session = talk(scene, seed=41)
    session.reset()
    session.step({"A": Choice(continuous=[[0.25, 0.5], [-1.0, 1.0]])})
    assert scene.seed == 41
    assert scene.told == [{"A": [([0.25, 0.5], []), ([-1.0, 1.0], [])]}]


def test_a_message_may_hold_ends_alone(talk, scenes):
    moments = [{"A": [Info(0, sight(1))]}, {"A": [Info(0, sight(2), 1.0, done=True)]}, {"A": [Info(1, sight(3))]}]
    session = talk(scenes.Recorder({"A": UnityActionSpec(branches=(2,))}, moments))
    session.reset()
    moment = session.step({"A": Choice(discrete=[[1]])})["A"]
    assert (len(moment.decisions), len(moment.ended)) == (0, 1)
    moment = session.step({"A": Choice()})["A"]
    assert (len(moment.decisions), len(moment.ended)) == (1, 0)


def test_an_interruption_is_told_apart_from_an_end(talk, scenes):
    ended = [Info(0, sight(1), done=True, interrupted=True), Info(1, sight(1), done=True)]
    scene = scenes.Recorder({"A": UnityActionSpec(branches=(2,))}, [{"A": [Info(0, sight(1))]}, {"A": ended}])
    session = talk(scene)
    session.reset()
    assert session.step({"A": Choice(discrete=[[0]])})["A"].ended.interrupted.tolist() == [True, False]


def test_masks_are_turned_round(talk, scenes):
    """The wire says True where an action is forbidden; we say True where it is allowed."""
    infos = [Info(0, sight(1), forbidden=[True, False, False, True, False]), Info(1, sight(1))]
    session = talk(scenes.Recorder({"A": UnityActionSpec(branches=(2, 3))}, [{"A": infos}]))
    allowed = session.reset()["A"].decisions.allowed
    assert allowed.tolist() == [[False, True, True, False, True], [True] * 5]


def test_teams_groups_and_behaviors_come_with_their_names(talk, scenes):
    session = talk(scenes.GameScene())
    moments = session.reset()
    assert list(moments) == list(scenes.GameScene.behaviors)
    striker = moments["Striker?team=1"].decisions
    assert striker.agent_id.tolist() == [10, 11]
    assert striker.group_id.tolist() == [2, 2]
    striker = session.step({})["Striker?team=1"].decisions
    assert striker.group_reward.tolist() == [0.5, 0.5]
    assert session.behaviors["Referee?team=0"].actions == UnityActions(0, (2, 2))


def test_a_behavior_left_out_does_nothing(talk, scenes):
    scene = scenes.GameScene()
    session = talk(scene)
    session.reset()
    session.step({"Referee?team=0": Choice(discrete=[[1, 0]])})
    assert list(scene.heard[0]) == ["Referee?team=0"]


def test_wrong_actions_are_refused_before_they_are_sent(talk, scenes):
    session = talk(scenes.BasicScene())
    session.reset()
    for choice in (
        Choice(discrete=[[3]]),
        Choice(discrete=[[0], [1]]),
        Choice(continuous=[[0.0]]),
        Choice(discrete=[[0]], continuous=[[1.0]]),
    ):
        with pytest.raises(ValueError, match="Basic"):
            session.step({BASIC: choice})
    with pytest.raises(ValueError, match="no behavior 'Advanced'"):
        session.step({"Advanced": Choice(discrete=[[0]])})
    session.step({BASIC: Choice(discrete=[[0]])})  # and the session still stands


@pytest.mark.parametrize("version", ["0.15.0", "2.0.0", "", "1.x"])
def test_another_major_version_is_refused_by_name(talk, scenes, version):
    with pytest.raises(WireVersionError, match=r"expected"):
        talk(scenes.BasicScene(), claims={"communication_version": version})


@pytest.mark.parametrize("version", ["1.0.0", "1.9.0", "1.5.0-preview"])
def test_other_minor_versions_are_welcome(talk, scenes, version):
    assert talk(scenes.BasicScene(), claims={"communication_version": version}).reset()[BASIC]


def test_action_specs_of_old_packages_are_read(talk, scenes):
    class Old(Player):
        kind, sizes = 0, [2, 4]

        def _announce(self, introduction, name):
            told = introduction.brain_parameters.add(brain_name=name)
            told.vector_action_space_type_deprecated = self.kind
            told.vector_action_size_deprecated.extend(self.sizes)

    class OldContinuous(Old):
        kind, sizes = 1, [3]

    for player, expected in ((Old, UnityActions(0, (2, 4))), (OldContinuous, UnityActions(3, ()))):
        session = talk(scenes.Recorder({"A": UnityActionSpec()}, [{"A": [Info(0, sight(1))]}]), player=player)
        session.reset()
        assert session.behaviors["A"].actions == expected


def test_old_players_find_their_actions_in_the_old_field(talk, scenes):
    heard = []

    class Old(Player):
        def _apply_actions(self, order):
            for listed in order.agent_actions.values():
                heard.extend(list(one.vector_actions_deprecated) for one in listed.value)
            super()._apply_actions(order)

    session = talk(scenes.BasicScene(), player=Old)
    session.reset()
    session.step({BASIC: Choice(discrete=[[2]])})
    assert heard == [[2.0]]


def test_a_player_that_says_goodbye_has_left(talk, scenes):
    class Leaver(scenes.Liar):
        @staticmethod
        def lie(number, message):
            if number == 3:
                message.header.status = messages.STATUS_GOODBYE
            return message

    session = talk(scenes.BasicScene(), player=Leaver)
    session.reset()
    with pytest.raises(PlayerLeftError, match="by itself"):
        session.step({BASIC: Choice(discrete=[[2]])})
    with pytest.raises(SessionClosedError):
        session.reset()


def test_a_silent_editor_is_named_with_what_to_do(talk, scenes):
    class Mute(Player):
        def live(self):
            return 0

    with pytest.raises(PlayerTimeoutError, match="Press Play"):
        talk(scenes.BasicScene(), player=Mute, timeout_seconds=0.3)


def _infos(message):
    return message.unity_output.rl_output.agentInfos[BASIC].value[0]


def _observation(message):
    return _infos(message).observations[0]


LIES = {
    "bytes that are no message": lambda m: b"\xff\xff\xff\xff\x07",
    "a cut message": lambda m: m.SerializeToString()[:-7],
    "no bytes at all": lambda m: b"",
    "a strange status": lambda m: setattr(m.header, "status", 777),
    "too few numbers": lambda m: _observation(m).float_data.data.pop(),
    "a huge shape": lambda m: _observation(m).shape.__setitem__(0, 2**31 - 1),
    "a negative shape": lambda m: _observation(m).shape.__setitem__(0, -20),
    "no shape": lambda m: _observation(m).ClearField("shape"),
    "a PNG of rank one": lambda m: setattr(_observation(m), "compression_type", 1),
    "an unknown compression": lambda m: setattr(_observation(m), "compression_type", 9),
    "data of another kind": lambda m: setattr(_observation(m), "compressed_data", b"abc"),
    "NaN seen": lambda m: _observation(m).float_data.data.__setitem__(0, float("nan")),
    "infinity seen": lambda m: _observation(m).float_data.data.__setitem__(3, float("inf")),
    "NaN earned": lambda m: setattr(_infos(m), "reward", float("nan")),
    "one more observation": lambda m: _infos(m).observations.add(),
    "no observation": lambda m: _infos(m).ClearField("observations"),
    "a mask too short": lambda m: _infos(m).action_mask.append(True),
    "everything forbidden": lambda m: _infos(m).action_mask.extend([True] * 3),
    "an unannounced behavior": lambda m: m.unity_output.rl_output.agentInfos["Ghost"].value.add(),
    "cut side channel": lambda m: setattr(m.unity_output.rl_output, "side_channel", b"\x01" * 19),
    "lying side channel": lambda m: setattr(m.unity_output.rl_output, "side_channel", b"\x01" * 20 + b"ab"),
    "negative side channel": lambda m: setattr(m.unity_output.rl_output, "side_channel", b"\xff" * 30),
}


def reset_and_step(session, times):
    session.reset()
    for _ in range(times):
        session.step({BASIC: Choice(discrete=[[2]])})


@pytest.mark.parametrize("when", [2, 4], ids=["at first", "later"])
@pytest.mark.parametrize("lie", LIES)
def test_every_lie_is_a_named_error_and_no_hang(talk, scenes, lie, when):
    class Bent(scenes.Liar):
        @staticmethod
        def lie(number, message):
            if number != when:
                return message
            bent = LIES[lie](message)
            return bent if isinstance(bent, bytes) else message

    session = talk(scenes.BasicScene(), player=Bent)
    with pytest.raises(WireError):
        reset_and_step(session, 3)


def test_an_editor_that_hangs_up_is_told_though_there_is_no_process_to_ask(talk, scenes, monkeypatch):
    def broken(*_):
        raise PlayerDiedError("the player hung up")

    session = talk(scenes.BasicScene())
    session.reset()
    monkeypatch.setattr(session._wire, "receive", broken)
    with pytest.raises(PlayerDiedError, match="hung up"):
        session.step({BASIC: Choice(discrete=[[2]])})


@pytest.mark.parametrize("scene", ["BasicScene", "PictureScene", "GameScene"])
def test_random_damage_is_never_worse_than_a_named_error(talk, scenes, scene):
    """Bytes are flipped, cut and moved all over; the session goes on or raises one of ours, and never hangs."""
    rng = np.random.default_rng(3)

    class Noisy(scenes.Liar):
        @staticmethod
        def lie(number, message):
            data = bytearray(message.SerializeToString())
            first, second = sorted(rng.integers(0, len(data), 2))
            match rng.integers(6) if number >= 2 else None:
                case 0:
                    return bytes(data[:first])
                case 1:
                    return bytes(data[:first] + data[second:] + data[first:second])
                case 2 | 3:
                    data[first] = rng.integers(0, 256)
            return bytes(data)

    raised = 0
    for _ in range(25):
        session = talk(getattr(scenes, scene)(), player=Noisy)
        try:
            session.reset()
            for _ in range(5):
                session.step({})
        except UnityError:
            raised += 1
    assert raised


def heard_by(player):
    """A player that keeps what it is told."""

    class Hearing(player):
        def exchange_message(self, exchange, message):
            data = super().exchange_message(exchange, message)
            self.heard = [*getattr(self, "heard", ()), self._parse(data)]
            return data

    return Hearing


def test_a_player_is_greeted_with_versions_and_what_we_can_read(talk, scenes, caplog):
    session = talk(scenes.BasicScene(), player=heard_by(Player))
    session.reset()
    assert f"Waiting for the Unity Editor on port {session.port}: press Play." in caplog.text
    hello = session.player.heard[0].unity_input.rl_initialization_input
    assert (hello.seed, hello.num_areas) == (0, 1)
    assert (hello.communication_version, hello.package_version) == ("1.5.0", "1.1.0")
    can = {field.name: getattr(hello.capabilities, field.name) for field in hello.capabilities.DESCRIPTOR.fields}
    assert len(can) == 7
    assert [name for name, is_so in can.items() if not is_so] == ["trainingAnalytics"]


@pytest.mark.parametrize(("seed", "told"), [(2**31 - 1, 2**31 - 1), (2**31, -(2**31)), (2**32 + 5, 5)])
def test_a_seed_is_folded_into_32_bits(talk, scenes, seed, told):
    session = talk(scenes.BasicScene(), player=heard_by(Player), seed=seed, num_areas=3)
    hello = session.player.heard[0].unity_input.rl_initialization_input
    assert (hello.seed, hello.num_areas) == (told, 3)


def test_who_ended_chooses_nothing_so_its_mask_is_nobodys(talk, scenes):
    ended = Info(0, sight(1), done=True, forbidden=[True, True])
    scene = scenes.Recorder({"A": UnityActionSpec(branches=(2,))}, [{"A": [Info(0, sight(1))]}, {"A": [ended]}])
    session = talk(scene)
    session.reset()
    assert len(session.step({"A": Choice(discrete=[[0]])})["A"].ended) == 1


def test_the_first_picture_tells_the_axes_where_the_version_does_not(talk, scenes):
    seen = [
        *sight(1, 2),
        ObservationMessage(np.zeros((3, 6, 8), np.float32)),
        ObservationMessage(np.zeros((9, 6, 2), np.float32)),
    ]
    scene = scenes.Recorder({"A": UnityActionSpec(continuous=1)}, [{"A": [Info(0, seen)]}])
    session = talk(scene, claims={"package_version": "preview"})
    session.reset()
    assert [sensor.shape for sensor in session.behaviors["A"].sensors] == [(2,), (6, 8, 3), (6, 2, 9)]
