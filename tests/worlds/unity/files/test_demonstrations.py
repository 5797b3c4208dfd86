"""ML-Agents' demonstrations: written here with protobuf's own library, read by ours; and real ones, where they lie.

RACECRAFT_MLAGENTS_REPOSITORY   an unpacked copy of Unity-Technologies/ml-agents
"""

import os
from pathlib import Path

import numpy as np
import pytest

from racecraft.worlds.unity.env.player import mapping_of, pngs
from racecraft.worlds.unity.files import messages
from racecraft.worlds.unity.files.demonstrations import DemonstrationError, read_demonstration, read_demonstrations

REPOSITORY = os.environ.get("RACECRAFT_MLAGENTS_REPOSITORY")


@pytest.fixture
def write(tmp_path):
    """Write a file: a behavior of 2 numbers and one branch of 3, records of three numbers and a picture."""

    def delimited(message):
        data, size, head = message.SerializeToString(), len(message.SerializeToString()), b""
        while size > 0x7F:
            head, size = head + bytes([size & 0x7F | 0x80]), size >> 7
        return head + bytes([size]) + data

    def write_file(
        records, name="play.demo", picture=None, promised=None, spoil=lambda message: None, is_old=False, more=(),
        version=1, behaves=lambda behavior: None,
    ):  # fmt: skip
        header, behavior = messages.load().DemonstrationMeta(), messages.load().BrainParameters()
        header.api_version, header.demonstration_name = version, "play"
        header.number_steps = len(records) if promised is None else promised
        header.number_episodes, header.mean_reward = 2, 0.5
        behavior.brain_name = "Mover?team=1"
        behavior.action_spec.num_continuous_actions, behavior.action_spec.num_discrete_actions = 2, 1
        behavior.action_spec.discrete_branch_sizes.append(3)
        behaves(behavior)
        parts = [delimited(header).ljust(33, b"\0"), delimited(behavior)]
        for row, (episode, reward, done, interrupted) in enumerate(records):
            pair = messages.load().AgentInfoActionPair()
            info, act = pair.agent_info, pair.action_info
            info.reward, info.done, info.max_step_reached, info.id = reward, done, interrupted, episode
            info.action_mask.extend([False, row == 1, False])
            seen = info.observations.add(name="place", shape=[3 + len(more)])
            seen.float_data.data.extend([row, row + 0.5, -row, *more])
            if picture is not None:
                shown = info.observations.add(name="eye", compression_type=1)
                shown.shape.extend((picture.shape[2], *picture.shape[:2]))
                shown.compressed_data = pngs(picture)
                shown.compressed_channel_mapping.extend(mapping_of(picture.shape[2]))
            if not (is_old and row == len(records) - 1):
                act.continuous_actions.extend([row / 10, -row / 10])
                act.discrete_actions.append(row % 3)
            spoil(pair)
            parts.append(delimited(pair))
        path = tmp_path / name
        path.write_bytes(b"".join(parts))
        return path

    return write_file


TWO_EPISODES = [(7, 0.0, False, False), (7, 1.0, False, False), (7, 2.0, True, True), (8, 0.0, False, False),
                (8, 5.0, True, False)]  # fmt: skip


def test_what_was_recorded_is_what_is_read(write):
    picture = np.random.default_rng(1).integers(0, 256, (4, 6, 3), dtype=np.uint8)
    told = read_demonstration(write(TWO_EPISODES, picture=picture))
    assert (told.name, told.behavior, told.num_continuous, told.branches) == ("play", "Mover?team=1", 2, (3,))
    assert (len(told), told.num_episodes, told.mean_reward) == (5, 2, 0.5)
    assert told.observations["place"].tolist() == [[row, row + 0.5, -row] for row in range(5)]
    np.testing.assert_array_equal(told.observations["eye"], np.stack([picture] * 5))
    np.testing.assert_allclose(told.continuous, [[row / 10, -row / 10] for row in range(5)], rtol=1e-6)
    assert told.discrete.tolist() == [[0], [1], [2], [0], [1]]
    assert told.reward.tolist() == [0, 1, 2, 0, 5]
    assert told.done.tolist() == [False, False, True, False, True]
    assert told.interrupted.tolist() == [False, False, True, False, False]
    assert told.allowed.tolist() == [[True] * 3, [True, False, True], *[[True] * 3] * 3]
    assert told.episode_id.tolist() == [7, 7, 7, 8, 8]


def test_steps_join_what_was_seen_with_the_action_that_followed(write):
    """Newer files hold the action that led to a record: step 0 acts as record 1 tells, and earns its reward."""
    told = read_demonstration(write(TWO_EPISODES))
    assert told.action_lag == 1
    steps = told.transitions()
    assert steps.observations["place"][:, 0].tolist() == [0, 1, 3]  # no step leads from one episode to the next
    assert steps.discrete.tolist() == [[1], [2], [1]]
    np.testing.assert_allclose(steps.continuous, [[0.1, -0.1], [0.2, -0.2], [0.4, -0.4]], rtol=1e-6)
    assert steps.reward.tolist() == [1, 2, 5]
    assert steps.terminated.tolist() == [False, False, True]
    assert steps.truncated.tolist() == [False, True, False]
    assert steps.allowed.tolist() == [[True] * 3, [True, False, True], [True] * 3]
    assert told.transitions(action_lag=0).discrete.tolist() == [[0], [1], [0]]


def test_old_files_hold_the_action_that_was_chosen_and_none_in_their_last_record(write):
    """One id for all episodes: the record of an end shows the next start."""
    told = read_demonstration(write([(7, 0, False, False), (7, 1, True, False), (7, 2, False, False)], is_old=True))
    assert told.action_lag == 0
    steps = told.transitions()
    assert steps.observations["place"][:, 0].tolist() == [0, 1]
    assert (steps.discrete.tolist(), steps.reward.tolist()) == ([[0], [1]], [1, 2])
    assert steps.terminated.tolist() == [True, False]


def test_bytes_behind_the_last_record_are_nobodys_and_a_file_that_was_not_closed_is_read_to_its_end(write):
    path = write(TWO_EPISODES)
    path.write_bytes(path.read_bytes() + b"\x08\xff\xff")
    assert len(read_demonstration(path)) == 5
    assert len(read_demonstration(write(TWO_EPISODES, promised=0))) == 5


def test_a_folder_is_read_in_the_order_of_names_and_must_be_of_one_kind(write, tmp_path):
    write(TWO_EPISODES, name="b.demo")
    write(TWO_EPISODES[:3], name="a.demo")
    assert [len(one) for one in read_demonstrations(tmp_path)] == [3, 5]
    write(TWO_EPISODES, name="c.demo", picture=np.zeros((4, 6, 3), np.uint8))
    with pytest.raises(DemonstrationError, match=r"c\.demo: sees and does .*'eye'.* Keep demonstrations of one"):
        read_demonstrations(tmp_path)
    write(TWO_EPISODES, name="c.demo", more=(0.0,))
    with pytest.raises(DemonstrationError, match=r"c\.demo: sees and does .*\(4,\).*what a\.demo has.*\(3,\)"):
        read_demonstrations(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(DemonstrationError, match=r"holds no \.demo file"):
        read_demonstrations(tmp_path / "empty")


def spoilt(field, value):
    def spoil(pair):
        if field == "actions":
            pair.action_info.ClearField("continuous_actions")
            pair.action_info.continuous_actions.extend(value)
        elif field == "choice":
            pair.action_info.discrete_actions[:] = [value]
        elif field == "reward":
            pair.agent_info.reward = value
        elif field == "mask":
            pair.agent_info.action_mask.append(value)
        elif field == "numbers":
            pair.agent_info.observations[0].float_data.data[:] = value
        elif field == "shape":
            pair.agent_info.observations[0].shape[:] = value

    return spoil


@pytest.mark.parametrize(
    ("field", "value", "letter"),
    [
        ("actions", [1.0], r"record 1: does 1 numbers and 1 choices where the behavior has 2 and 1"),
        ("actions", [1.0, float("nan")], "NaN"),
        ("choice", 3, r"chooses \[3\] in branches of \[3\]"),
        ("reward", float("inf"), "earns inf"),
        ("mask", True, "a mask of 4 entries"),
        ("numbers", [1.0, 2.0, float("nan")], "NaN"),
        ("shape", [2**14, 2**14, 2], "impossible shape"),
    ],
)
def test_records_that_contradict_themselves_are_letters(write, field, value, letter):
    with pytest.raises(DemonstrationError, match=letter):
        read_demonstration(write(TWO_EPISODES, spoil=spoilt(field, value)))


def test_whatever_stands_in_a_file_it_is_a_demonstration_or_a_letter(write):
    """Cut at every length, and one byte changed at every place."""
    path = write(TWO_EPISODES, picture=np.zeros((1, 2, 1), np.uint8))
    whole = path.read_bytes()
    letters = 0
    bent = [whole[:length] for length in range(0, len(whole), 3)]
    bent += [whole[:at] + bytes([whole[at] ^ flip]) + whole[at + 1 :] for at in range(len(whole)) for flip in (1, 128)]
    for data in bent:
        path.write_bytes(data)
        try:
            read_demonstration(path)
        except DemonstrationError as letter:
            letters += str(letter).startswith(str(path))
    assert letters > len(whole) / 3


def test_files_that_are_no_demonstrations_are_letters(tmp_path):
    with pytest.raises(DemonstrationError, match="cannot be read"):
        read_demonstration(tmp_path / "absent.demo")
    (tmp_path / "play.txt").write_text("behaviors:\n  Basic:\n    trainer_type: ppo\n")
    with pytest.raises(DemonstrationError, match=r"play\.txt: the header: claims 98 bytes where"):
        read_demonstration(tmp_path / "play.txt")
    (tmp_path / "new.demo").write_bytes(b"\x02\x08\x09".ljust(40, b"\0"))
    with pytest.raises(DemonstrationError, match="is of version 9"):
        read_demonstration(tmp_path / "new.demo")


NUMBERS_ALONE, CHOICES_ALONE = (1, ()), (0, (3, 1))
"""What a behavior does, as (numbers, sizes of its branches)."""


def doing(numbers, branches):
    def behaves(behavior):
        behavior.action_spec.num_continuous_actions = numbers
        behavior.action_spec.num_discrete_actions = len(branches)
        behavior.action_spec.discrete_branch_sizes[:] = branches

    return behaves


def acting(field, values):
    """Have every record do this alone, told in one of the fields that actions have had."""

    def spoil(pair):
        pair.ClearField("action_info")
        getattr(pair.action_info, field).extend(values)
        pair.agent_info.ClearField("action_mask")

    return spoil


@pytest.mark.parametrize(
    ("does", "field", "values"),
    [
        (NUMBERS_ALONE, "continuous_actions", [0.5]),
        (CHOICES_ALONE, "discrete_actions", [2, 0]),
        (NUMBERS_ALONE, "vector_actions_deprecated", [0.5]),
        (CHOICES_ALONE, "vector_actions_deprecated", [2.0, 0.0]),
    ],
)
def test_numbers_or_choices_alone_are_read_from_the_new_field_and_the_old(write, does, field, values):
    told = read_demonstration(write(TWO_EPISODES[:3], behaves=doing(*does), spoil=acting(field, values)))
    assert (told.num_continuous, told.branches) == does
    assert told.continuous.tolist() == [values * bool(does[0])] * 3
    assert told.discrete.tolist() == [values * bool(does[1])] * 3
    assert (told.continuous.dtype, told.discrete.dtype) == (np.float32, np.int64)


@pytest.mark.parametrize(("kind", "sizes", "does"), [(1, [2], (2, ())), (0, [3, 2], (0, (3, 2)))])
def test_what_a_behavior_does_stood_elsewhere_before_there_were_hybrid_actions(write, kind, sizes, does):
    def behaves(behavior):
        behavior.ClearField("action_spec")
        behavior.vector_action_space_type_deprecated = kind
        behavior.vector_action_size_deprecated.extend(sizes)

    told = read_demonstration(
        write(TWO_EPISODES, behaves=behaves, spoil=acting("vector_actions_deprecated", [1.0, 1.0]))
    )
    assert (told.num_continuous, told.branches) == does


def test_versions_nought_and_one_are_read(write):
    assert len(read_demonstration(write(TWO_EPISODES, version=0))) == 5
    with pytest.raises(DemonstrationError, match="the header: is of version 2, and 0 and 1 are known"):
        read_demonstration(write(TWO_EPISODES, version=2))


def test_a_file_is_a_folder_of_one(write):
    assert [len(one) for one in read_demonstrations(write(TWO_EPISODES))] == [5]


def test_where_no_record_has_a_mask_there_is_none_and_where_one_has_the_others_may_do_all(write):
    def unmasked(pair):
        pair.agent_info.ClearField("action_mask")

    def masked_once(pair):
        pair.agent_info.action_mask[:] = [True, False, True] if pair.agent_info.reward == 5 else []

    none = read_demonstration(write(TWO_EPISODES, spoil=unmasked))
    assert none.allowed is None
    assert none.transitions().allowed is None
    one = read_demonstration(write(TWO_EPISODES, spoil=masked_once))
    assert one.allowed.tolist() == [[True] * 3] * 4 + [[False, True, False]]


@pytest.mark.parametrize(
    ("layout", "wire", "shape"),
    [
        (None, (2, 3, 4), (3, 4, 2)),  # few channels first
        (None, (4, 3, 2), (4, 3, 2)),
        ("HWC", (2, 3, 4), (2, 3, 4)),
        ("CHW", (4, 3, 2), (3, 2, 4)),
        (None, (2, 3), (2, 3)),
    ],
)
def test_pictures_of_numbers_are_shown_with_their_channels_last(write, layout, wire, shape):
    values = np.arange(np.prod(wire), dtype=np.float32).reshape(wire)

    def spoil(pair):
        pair.agent_info.observations[0].shape[:] = wire
        pair.agent_info.observations[0].float_data.data[:] = values.ravel().tolist()

    seen = read_demonstration(write(TWO_EPISODES, spoil=spoil), layout).observations["place"]
    assert seen.shape == (5, *shape)
    is_turned = layout == "CHW" or shape != wire
    np.testing.assert_array_equal(seen[4], np.moveaxis(values, 0, -1) if is_turned else values)


def test_observations_without_names_of_their_own_are_numbered(write):
    def spoil(pair):
        pair.agent_info.observations.add(name="place", shape=[0])

    seen = read_demonstration(write(TWO_EPISODES, spoil=spoil)).observations
    assert {name: values.shape for name, values in seen.items()} == {"obs_0": (5, 3), "obs_1": (5, 0)}


def at_the_third(change):
    """Change the record that earns 2 alone."""
    return lambda pair: change(pair.agent_info) if pair.agent_info.reward == 2 else None


def as_png(info):
    info.observations[0].compression_type = 1


@pytest.mark.parametrize(
    ("spoil", "letter"),
    [
        (lambda pair: pair.agent_info.ClearField("observations"), "record 1: shows no observation"),
        (at_the_third(lambda info: info.ClearField("observations")), "record 3: shows 0 observations where the first"),
        (
            at_the_third(lambda info: info.observations[0].shape.__setitem__(0, 2)),
            r"as \(2,\) where the first is \(3,\)",
        ),
        (at_the_third(as_png), "record 3: shows 'place' once as PNG and once as numbers"),
        (lambda pair: pair.agent_info.observations[0].shape.__setitem__(0, -3), r"the impossible shape \(-3,\)"),
        (lambda pair: pair.action_info.discrete_actions.__setitem__(0, -1), r"chooses \[-1\] in branches of \[3\]"),
    ],
)
def test_records_that_leave_something_out_are_letters(write, spoil, letter):
    with pytest.raises(DemonstrationError, match=letter):
        read_demonstration(write(TWO_EPISODES, spoil=spoil))


@pytest.mark.parametrize(
    ("does", "letter"),
    [
        ((0, ()), r"has 0 numbers and branches \[\], and something must be done"),
        ((1, (3, 0)), r"branches \[3, 0\]"),
        ((2**28 + 1, ()), "has 268435457 numbers"),
        ((2**28, ()), r"has a mask of 3 entries where branches \[\]"),
    ],
)
def test_behaviors_that_cannot_be_are_letters(write, does, letter):
    with pytest.raises(DemonstrationError, match=letter):
        read_demonstration(write(TWO_EPISODES, behaves=doing(*does)))


def test_observations_too_large_to_hold_are_letters_before_room_is_taken(write):
    """Nine of 2**28 numbers, of which each alone might be."""
    with pytest.raises(DemonstrationError, match="claims observations of more than 2,147,483,648 numbers"):
        read_demonstration(write([TWO_EPISODES[0]] * 9, spoil=spoilt("shape", [2**28])))


def test_numbers_of_more_than_64_bits_are_a_demonstration_or_a_letter(write):
    """The episode's id as ten bytes of seven bits each: protobuf keeps the lowest 64 of these 70."""
    path = write([(-1, 0, False, False)] * 2)
    path.write_bytes(path.read_bytes().replace(b"\xff" * 9 + b"\x01", b"\xff" * 9 + b"\x7f"))
    assert read_demonstration(path).episode_id.tolist() == [-1, -1]


def test_a_file_with_fewer_records_than_its_header_promises_was_cut(write):
    with pytest.raises(DemonstrationError, match="the end: holds 5 records where the header promises 6"):
        read_demonstration(write(TWO_EPISODES, promised=6))
    with pytest.raises(DemonstrationError, match="the end: holds 0 records where the header promises 1"):
        read_demonstration(write([]))
    path = write(TWO_EPISODES)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(DemonstrationError, match=r"record 5: claims (\d+) bytes where \d+ are left; the file was cut"):
        read_demonstration(path)


@pytest.mark.skipif(not REPOSITORY, reason="RACECRAFT_MLAGENTS_REPOSITORY names no copy of ml-agents")
def test_ml_agents_own_demonstrations_are_read():
    """The header's figures are those of the records; the actions turn the platform of 3DBall the way they say."""
    found = {path.name: path for path in Path(REPOSITORY).expanduser().rglob("*.demo") if path.stat().st_size > 500}
    assert found, "no .demo files lie there"
    read = {name: read_demonstration(path) for name, path in found.items()}
    for name, one in read.items():
        assert len(one.transitions().reward) > 0, name
        assert one.reward.sum() / one.num_episodes == pytest.approx(one.mean_reward, abs=1e-3), name
    for name in {"Expert3DBall.demo", "test.demo", "test4.demo"} & set(read):
        steps = read[name].transitions()
        seen = steps.observations["obs_0"]
        goes_on = ~(steps.terminated | steps.truncated)[:-1]
        goes_on &= np.abs(np.diff(seen[:, 2:5], axis=0)).max(axis=1) < 0.5  # the ball was not thrown in again
        turned = np.diff(seen[:, 0])[goes_on]
        assert np.corrcoef(turned, steps.continuous[:-1, 0][goes_on])[0, 1] > 0.99, name


def test_a_learner_is_shown_what_was_recorded(write, tmp_path):
    """Steps, not records: the action of the record after; the last record of an episode begins none."""
    from racecraft.algorithms.demonstrations import demonstration_tensors, read_demonstration_batch
    from racecraft.algorithms.policy_spec import PolicySpec
    from racecraft.contract.errors import SettingError
    from racecraft.contract.world import ArraySpec, ContinuousActions, HybridActions, MultiDiscreteActions, WorldSpec

    write(TWO_EPISODES)
    write(TWO_EPISODES, name="second.demo")
    shown = read_demonstration_batch(tmp_path)
    assert shown.observations["place"][:, 0].tolist() == [0, 1, 3] * 2
    assert shown.actions.tolist() == [
        pytest.approx(row) for row in [[0.1, -0.1, 1], [0.2, -0.2, 2], [0.4, -0.4, 1]] * 2
    ]
    assert (shown.reward.tolist(), shown.episode.tolist()) == ([1, 2, 5] * 2, [0, 0, 1, 2, 2, 3])
    assert shown.action_mask.tolist() == [[True] * 3, [True, False, True], [True] * 3] * 2
    told = PolicySpec.from_dictionary(shown.spec).actions
    assert (told.continuous.low, told.continuous.high) == ((-1.0, -1.0), (1.0, 1.0)), "what a Unity world promises"

    actions = HybridActions(ContinuousActions((-1.0,) * 2, (1.0,) * 2), MultiDiscreteActions((3,)))
    fits = WorldSpec("unity", 1, 1, {"place": ArraySpec((3,), np.float32)}, actions, has_action_mask=True)
    assert len(demonstration_tensors(shown, fits, ["place"], "cpu", "bc.demonstrations")) == 6
    other = WorldSpec("unity", 1, 1, {"place": ArraySpec((4,), np.float32)}, actions, has_action_mask=True)
    with pytest.raises(SettingError, match=r"gail\.demonstrations: the observation 'place'"):
        demonstration_tensors(shown, other, ["place"], "cpu", "gail.demonstrations")
