"""Pictures, masks and actions: what travels is what is shown."""

import numpy as np
import pytest

from racecraft.adapters.spaces import action_space
from racecraft.contract.world import ContinuousActions, HybridActions, MultiDiscreteActions
from racecraft.worlds.unity.env.actions import ActionTable
from racecraft.worlds.unity.env.behaviors import HWC, Behavior, Sensor, UnityActions, learn_behavior, read_agents
from racecraft.worlds.unity.env.errors import WireError
from racecraft.worlds.unity.env.player import Info, ObservationMessage, Player, UnityActionSpec, mapping_of, pngs
from racecraft.worlds.unity.env.session import Choice
from racecraft.worlds.unity.files.messages import load

VERSIONS = {"2.3.0": "HWC", "3.0.0": "CHW", "4.1.0": "CHW"}


@pytest.mark.parametrize("version", VERSIONS)
def test_pictures_arrive_as_they_were_for_both_orders_of_axes(talk, scenes, version):
    session = talk(scenes.PictureScene(), claims={"package_version": version})
    camera, grid, numbers = session.reset()["Eyes"].decisions.observations
    assert camera.dtype == np.uint8
    np.testing.assert_array_equal(camera[0], scenes.PictureScene.png)
    np.testing.assert_array_equal(grid[0], scenes.PictureScene.raw)
    np.testing.assert_array_equal(numbers[0], [0, 1, 2])
    sensors = session.behaviors["Eyes"].sensors
    assert [sensor.name for sensor in sensors] == ["camera", "grid", "numbers"]
    wire = (6, 8, 5) if VERSIONS[version] == "HWC" else (5, 6, 8)
    assert sensors[0].wire_shape == wire


def test_a_user_may_overrule_the_order_of_axes(talk, scenes):
    class Mislabelled(Player):
        def _introduction(self):
            message = super()._introduction()
            message.unity_output.rl_initialization_output.package_version = "2.0.0"  # but it sends CHW
            return message

    session = talk(scenes.PictureScene(), player=Mislabelled, image_layout="CHW")
    np.testing.assert_array_equal(session.reset()["Eyes"].decisions.observations[0][0], scenes.PictureScene.png)


class Bent(Player):
    """Sends a picture with a mapping and bytes of the test's choice."""

    data, mapping, shape = b"", (), None

    def _write_seen(self, into, seen):
        super()._write_seen(into, seen)
        if self.data:
            into.compressed_data = self.data
        into.ClearField("compressed_channel_mapping")
        into.compressed_channel_mapping.extend(self.mapping)


def see(talk, scenes, values, **bent):
    player = type("Bent", (Bent,), bent)
    scene = scenes.Recorder({"A": UnityActionSpec(branches=(2,))}, [{"A": [Info(0, [ObservationMessage(values)])]}])
    return talk(scene, player=player, claims={"package_version": "2.0.0"}).reset()["A"].decisions.observations[0][0]


def test_channels_are_sorted_dropped_and_averaged_by_the_mapping(talk, scenes):
    """Six decoded channels 10, 20 … 60: 0 and 2 meet in channel 1 (20), 4 becomes channel 0 (50), others drop."""
    planes = np.broadcast_to(np.arange(10, 70, 10, dtype=np.uint8), (2, 3, 6))
    data = pngs(np.ascontiguousarray(planes))
    shown = see(talk, scenes, np.zeros((2, 3, 2), np.uint8), data=data, mapping=(1, -1, 1, -1, 0, -1))
    assert shown[0, 0].tolist() == [50, 20]


def test_without_a_mapping_one_channel_is_the_mean_of_three(talk, scenes):
    colour = np.broadcast_to(np.array([10, 20, 60], np.uint8), (2, 3, 3))
    shown = see(talk, scenes, np.zeros((2, 3, 1), np.uint8), data=pngs(np.ascontiguousarray(colour)))
    assert shown[:, :, 0].tolist() == [[30] * 3] * 2


def test_without_a_mapping_surplus_channels_are_cut(talk, scenes):
    picture = np.random.default_rng(0).integers(0, 256, (4, 5, 4), np.uint8)
    np.testing.assert_array_equal(see(talk, scenes, picture), picture)


@pytest.mark.parametrize("channels", [1, 2, 4, 7])
def test_every_number_of_channels_goes_round(talk, scenes, channels):
    picture = np.random.default_rng(channels).integers(0, 256, (4, 5, channels), np.uint8)
    np.testing.assert_array_equal(see(talk, scenes, picture, mapping=tuple(mapping_of(channels))), picture)


GOOD = pngs(np.zeros((4, 5, 3), np.uint8))


@pytest.mark.parametrize(
    ("data", "mapping"),
    [
        (GOOD[:40], ()),
        (GOOD[:8] + b"\xff\xff\xff\xffIHDR", ()),
        (GOOD, (0, 1)),
    ],
)
def test_damaged_pictures_and_mappings_are_named_errors(talk, scenes, data, mapping):
    with pytest.raises(WireError, match="observation"):
        see(talk, scenes, np.zeros((4, 5, 3), np.uint8), data=data, mapping=mapping)


def test_a_picture_may_change_its_compression(talk, scenes):
    picture = np.random.default_rng(0).integers(0, 256, (4, 5, 3), np.uint8)
    plain = (picture / np.float32(255)).astype(np.float32)
    for first, second in ((picture, plain), (plain, picture)):
        moments = [{"A": [Info(0, [ObservationMessage(first)])]}, {"A": [Info(0, [ObservationMessage(second)])]}]
        session = talk(scenes.Recorder({"A": UnityActionSpec(branches=(2,))}, moments))
        session.reset()
        again = session.step({"A": Choice(discrete=[[0]])})["A"].decisions.observations[0][0]
        np.testing.assert_allclose(again, first, atol=1e-6)


def test_variable_length_and_goal_observations_are_marked(talk, scenes):
    entities = np.zeros((5, 3), np.float32)
    seen = [
        ObservationMessage(entities, "entities", variable_length=True),
        ObservationMessage(np.ones(2, np.float32), "aim", goal=True),
    ]
    session = talk(scenes.Recorder({"A": UnityActionSpec(continuous=1)}, [{"A": [Info(0, seen)]}]))
    session.reset()
    first, second = session.behaviors["A"].sensors
    assert (first.shape, first.variable_length, first.goal) == ((5, 3), True, False)
    assert (second.variable_length, second.goal) == (False, True)


def test_sensors_without_names_of_their_own_are_numbered(talk, scenes):
    seen = [
        ObservationMessage(np.ones(1, np.float32), "eye"),
        ObservationMessage(np.ones(2, np.float32)),
        ObservationMessage(np.ones(3, np.float32), "eye"),
    ]
    session = talk(scenes.Recorder({"A": UnityActionSpec(continuous=1)}, [{"A": [Info(0, seen)]}]))
    session.reset()
    assert [sensor.name for sensor in session.behaviors["A"].sensors] == ["eye", "obs_1", "obs_2"]


def test_eight_megabytes_of_numbers_arrive(talk, scenes):
    shown = talk(scenes.BigScene()).reset()["Big"].decisions.observations[0][0]
    np.testing.assert_array_equal(shown, scenes.BigScene.sight)


def test_several_branches_are_a_choice_each_however_many_combinations_there_are():
    table = ActionTable(UnityActions(branches=(40, 2, 50)))
    assert table.spec == MultiDiscreteActions((40, 2, 50))
    choice = table.choice(np.array([[39, 1, 0], [2, 0, 49]]))
    assert choice.discrete.tolist() == [[39, 1, 0], [2, 0, 49]]
    assert choice.continuous is None


def test_numbers_and_branches_stand_side_by_side():
    table = ActionTable(UnityActions(continuous=1, branches=(2, 3)))
    assert table.spec == HybridActions(ContinuousActions((-1.0,), (1.0,)), MultiDiscreteActions((2, 3)))
    choice = table.choice(np.array([[-1.5, 1.0, 2.0], [0.5, 0.0, 1.0], [1.5, 1.0, 0.0]], np.float32))
    assert choice.continuous.tolist() == [[-1.0], [0.5], [1.0]]
    assert choice.discrete.tolist() == [[1, 2], [0, 1], [1, 0]]


@pytest.mark.parametrize("actions", [UnityActions(branches=(2, 3)), UnityActions(2, (4,))])
def test_what_gymnasium_draws_is_an_action(actions):
    """A hybrid action is a Box there; whatever is drawn from it, every choice is one that there is."""
    table = ActionTable(actions)
    space = action_space(table.spec)
    space.seed(3)
    drawn = np.stack([space.sample() for _ in range(200)])
    told = np.asarray(table.choice(drawn).discrete)
    for branch, count in enumerate(actions.branches):
        assert sorted(set(told[:, branch])) == list(range(count))


def brain(continuous=0, branches=(), kind=0, sizes=()):
    """What a player announces of a behavior: as today, or as before hybrid actions."""
    told = load().BrainParameters(brain_name="A", vector_action_space_type_deprecated=kind)
    told.action_spec.num_continuous_actions, told.action_spec.num_discrete_actions = continuous, len(branches)
    told.action_spec.discrete_branch_sizes.extend(branches)
    told.vector_action_size_deprecated.extend(sizes)
    return told


def agent(*shapes, values=(), **words):
    """One agent with an observation of each shape, of zeros unless values are given."""
    info = load().AgentInfo(**words)
    for shape in shapes:
        part = info.observations.add(shape=shape)
        if min(shape, default=0) > 0 and np.prod(shape) < 100:
            part.float_data.data.extend(values or [0.0] * int(np.prod(shape)))
    return info


@pytest.mark.parametrize(
    ("told", "actions"),
    [
        (brain(2), UnityActions(2, ())),
        (brain(2, (3, 1)), UnityActions(2, (3, 1))),
        (brain(2, kind=0, sizes=[9]), UnityActions(2, ())),
        (brain(kind=1, sizes=[3]), UnityActions(3, ())),
        (brain(kind=0, sizes=[2, 4]), UnityActions(0, (2, 4))),
    ],
)
def test_what_a_behavior_does_is_learnt_from_what_the_player_announces(told, actions):
    assert learn_behavior(told, agent((1,)), HWC).actions == actions


@pytest.mark.parametrize("told", [brain(-1), brain(2, (3, 0)), brain(0, (-1,)), brain(-1, (2,))])
def test_actions_that_cannot_be_are_a_lie(told):
    with pytest.raises(WireError, match="behavior 'A' has impossible actions"):
        learn_behavior(told, agent((1,)), HWC)


def test_the_axes_of_pictures_alone_are_turned():
    first, second = learn_behavior(brain(1), agent((2, 4, 5), (2, 4)), "CHW").sensors
    assert (first.shape, first.wire_shape, second.shape) == ((4, 5, 2), (2, 4, 5), (2, 4))


@pytest.mark.parametrize(
    ("flags", "kind", "marks"), [(1, 0, (False, False)), (4, 1, (True, True)), (5, 2, (True, False))]
)
def test_absent_entities_and_goals_are_flags_of_the_wire(flags, kind, marks):
    seen = agent((2, 3))
    seen.observations[0].dimension_properties.extend([flags, 1])
    seen.observations[0].observation_type = kind
    (sensor,) = learn_behavior(brain(1), seen, HWC).sensors
    assert (sensor.variable_length, sensor.goal) == marks


def test_plain_numbers_of_a_picture_that_came_as_png_are_cut_to_its_range():
    """From 0 to 1, in 255 steps: a half is 127.5, and the even one of its neighbours."""
    eyes = Behavior("A", (Sensor("eye", (1, 3, 1), (1, 3, 1), compressed=True),), UnityActions(1))
    rows = read_agents(eyes, [agent((1, 3, 1), values=[-0.5, 0.5, 1.5])])
    assert rows.observations[0].dtype == np.uint8
    assert rows.observations[0].ravel().tolist() == [0, 128, 255]


THREE = Behavior("A", (Sensor("obs_0", (1,), (1,)),), UnityActions(0, (2, 3, 2)))


@pytest.mark.parametrize("mask", [[1, 1, 0, 0, 0, 0, 0], [0, 0, 1, 1, 1, 0, 0], [0, 0, 0, 0, 0, 1, 1]])
def test_no_branch_may_be_forbidden_whole(mask):
    with pytest.raises(WireError, match="an action mask of 'A' forbids every action of a branch"):
        read_agents(THREE, [agent((1,), action_mask=mask)])
    one_less = [*mask]
    one_less[mask.index(1)] = 0
    allowed = read_agents(THREE, [agent((1,), action_mask=one_less), agent((1,))]).allowed
    assert allowed.tolist() == [[not forbidden for forbidden in one_less], [True] * 7]
