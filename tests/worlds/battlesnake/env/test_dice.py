"""Chance: a stream that others know too, and dice that fall as they are told."""

import pytest

from racecraft.worlds.battlesnake.env.dice import LoadedDice, StreamDice, sample, shuffle

SPLIT_MIX = {
    0: (0xE220A8397B1DCDAF, 0x6E789E6AA1B965F4, 0x06C45D188009454F, 0xF88BB8A8724C81EC),
    1234567: (6457827717110365317, 3203168211198807973, 9817491932198370423, 4593380528125082431),
}
"""What SplitMix64 is known to give from these two seeds."""


@pytest.mark.parametrize("key", SPLIT_MIX)
def test_a_stream_is_split_mix_whose_upper_half_is_rolled(key):
    dice = StreamDice(key)
    assert [dice.below(1 << 32) for _ in range(4)] == [number >> 32 for number in SPLIT_MIX[key]]
    assert dice.counter == 4


def test_a_stream_goes_on_where_its_counter_stands():
    assert StreamDice(0, counter=2).below(1 << 32) == 0x06C45D18
    dice = StreamDice(0)
    assert [dice.below(100) for _ in range(4)] == [88, 43, 2, 97], "0.8833, 0.4315, 0.0264 and 0.9708 of a hundred"


def test_loaded_dice_fall_as_told_then_low_and_never_beyond_their_faces():
    dice = LoadedDice([3, 9, 6])
    assert [dice.below(7) for _ in range(5)] == [3, 6, 6, 0, 0]


def test_a_shuffle_draws_from_the_end_on():
    """The last item changes places with the one drawn, then the one before it; the first is not drawn for."""
    letters = list("abcd")
    shuffle(letters, LoadedDice([1, 2, 0, 3]))
    assert letters == ["d", "a", "c", "b"]
    dice = StreamDice(1)
    shuffle(letters, dice)
    assert dice.counter == 3
    seen = set()
    for _ in range(200):
        shuffle(letters, dice)
        seen.add("".join(letters))
    assert len(seen) == 24, "every order of four comes"


def test_a_sample_leaves_its_items_alone_and_takes_all_where_there_are_fewer():
    items = [1, 2, 3, 4]
    assert sample(items, 3, LoadedDice([2, 0, 1])) == [3, 1, 4]
    assert sample(items, 9, LoadedDice([3])) == [4, 1, 2, 3]
    assert sample(items, 0, LoadedDice()) == sample([], 2, LoadedDice()) == []
    assert items == [1, 2, 3, 4]
