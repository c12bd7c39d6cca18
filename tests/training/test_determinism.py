"""What torch needs for the same weights from the same seed."""

import pytest
import torch

from magsim.training import reproducible, seeded


def settings():
    fills = torch.utils.deterministic.fill_uninitialized_memory
    return torch.get_num_threads(), torch.are_deterministic_algorithms_enabled(), fills


def test_settings_of_torch_are_put_back():
    before = settings()
    with reproducible(1):
        assert settings() == (1, True, False)
    assert settings() == before


def test_settings_are_put_back_after_an_error():
    before = settings()

    def fail():
        with reproducible(1):
            raise KeyError

    with pytest.raises(KeyError):
        fail()
    assert settings() == before


def test_a_seed_starts_the_generator_inside_and_leaves_it_alone_outside():
    torch.manual_seed(7)
    expected = torch.rand(2), torch.rand(2)
    torch.manual_seed(7)
    first = torch.rand(2)
    draws = []
    for _ in range(2):
        with seeded(1):
            draws.append(torch.rand(3))
    assert torch.equal(*draws)
    torch.testing.assert_close((first, torch.rand(2)), expected, rtol=0, atol=0)
