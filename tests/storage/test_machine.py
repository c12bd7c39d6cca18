"""What decides the last bits is in the fingerprint of a machine, and nothing about whose machine it is."""

import platform
from importlib.metadata import version

import pytest

from magsim.storage.machine import COMPUTING, differences, fingerprint, kind_of_machine


@pytest.mark.parametrize("name", ["numpy", "scipy", "numba", "llvmlite", "jsbsim", "trimesh", "h5py", "pydantic"])
def test_every_library_that_computes_or_writes_is_in_it(name):
    assert fingerprint()[name] == version(name)


def test_the_kind_of_machine_is_part_of_the_fingerprint():
    assert kind_of_machine().items() <= fingerprint().items()
    assert set(COMPUTING) <= set(kind_of_machine())
    assert fingerprint()["numba_math"] in {"svml", "libm"}


def test_nothing_private_is_in_it():
    values = fingerprint().values()
    assert not any("/" in value or platform.node() in value for value in values if platform.node())


def test_a_library_that_one_of_two_machines_lacks_is_a_difference():
    assert differences({"a": "1", "numba": "0.6"}, {"a": "1"}) == ["numba 0.6, not unknown"]
    assert differences({"a": "1"}, {"a": "2", "b": "3"}) == ["a 1, not 2", "b unknown, not 3"]
    assert differences(fingerprint(), fingerprint()) == []
