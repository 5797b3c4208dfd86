"""Same seed, same chance, for ever: keys by twin, written out with nothing but Python's whole numbers."""

import hashlib

import numpy as np

from racecraft.contract.random_streams import generator, stream_keys


def splitmix64(z):
    """Sebastiano Vigna's splitmix64, one number from a state."""
    z = (z + 0x9E3779B97F4A7C15) % 2**64
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
    return z ^ (z >> 31)


def test_the_twin_is_the_published_one():
    """The first number of the published generator from state 0."""
    assert splitmix64(0) == 0xE220A8397B1DCDAF


def test_a_worlds_key_is_splitmix64_of_the_first_eight_bytes_of_the_purposes_digest():
    digest = hashlib.sha256(b"7/start positions").digest()
    base = sum(byte << (8 * place) for place, byte in enumerate(digest[:8]))
    expected = [splitmix64((base + n * 0x9E3779B97F4A7C15) % 2**64) for n in range(3)]
    assert stream_keys(7, "start positions", 3).tolist() == expected


def test_a_generator_is_numpys_own_from_seed_and_purpose():
    digest = hashlib.sha256(b"exploration").digest()
    expected = np.random.default_rng([7, int.from_bytes(digest[:8], "little")]).random(4)
    assert generator(7, "exploration").random(4).tolist() == expected.tolist()
    assert generator(8, "exploration").random(4).tolist() != expected.tolist()
