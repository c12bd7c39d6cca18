import numpy as np
import pytest

from magsim.streams import integer_seed, stream


def test_same_name_same_numbers():
    np.testing.assert_array_equal(stream(7, "a").normal(size=9), stream(7, "a").normal(size=9))


def test_names_and_seeds_differ():
    draws = [tuple(stream(seed, name).normal(size=3)) for seed in (0, 1, 2**62) for name in ("a", "b", "a/b", "")]
    assert len(set(draws)) == len(draws)


def test_numbers_are_the_documented_construction():
    """PCG64 on SeedSequence(seed, spawn_key = the first 16 bytes of SHA-256 of the name as little-endian words)."""
    # SHA-256 of the empty text begins e3b0c442 98fc1c14 9afbf4c8 996fb924 (FIPS 180-4).
    key = tuple(
        int.from_bytes(bytes.fromhex(word), "little") for word in ["e3b0c442", "98fc1c14", "9afbf4c8", "996fb924"]
    )
    wanted = np.random.Generator(np.random.PCG64(np.random.SeedSequence(5, spawn_key=key)))
    np.testing.assert_array_equal(stream(5, "").integers(0, 2**60, 4), wanted.integers(0, 2**60, 4))


def test_streams_are_independent():
    a, b = stream(1, "x").normal(size=20_000), stream(1, "y").normal(size=20_000)
    assert abs(np.corrcoef(a, b)[0, 1]) < 4 / np.sqrt(20_000)


def test_negative_seed_is_refused():
    with pytest.raises(ValueError):
        stream(-1, "a")


def test_integer_seed_fits_31_bits():
    seeds = [integer_seed(s, "wind") for s in range(200)]
    assert all(1 <= s < 2**31 for s in seeds)
    assert len(set(seeds)) == 200
    assert integer_seed(3, "wind") == integer_seed(3, "wind")
