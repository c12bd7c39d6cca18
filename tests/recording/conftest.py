"""A file with one small recording."""

from pathlib import Path

import pytest

from tests.support.boxes import make


@pytest.fixture
def path(tmp_path) -> Path:
    target = tmp_path / "box.h5"
    make().write(target)
    return target
