"""The data set ``tiny``, flown once for each test process."""

import shutil
from pathlib import Path

import pytest

from magsim.cli import main
from magsim.generation import flying
from tests.support.tiny_dataset import FLOWN, write_recipe


@pytest.fixture(scope="session")
def made(tmp_path_factory) -> Path:
    """A folder with the recipe ``tiny``, its manifest, and the data that belong to it in ``data``."""
    base = tmp_path_factory.mktemp("made")
    write_recipe(base / "tiny")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flying, "fly", lambda task, fly=flying.fly: FLOWN.setdefault(task.name, fly(task)))
        code = main(["dataset", "build", f"{base}/tiny", "-o", f"{base}/data", "--renew", "--quiet"])
    assert code == 0
    return base


@pytest.fixture
def here(made, tmp_path, monkeypatch) -> Path:
    """A copy of ``made`` as the working folder, in which no flight is simulated again."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(flying, "fly", lambda task: FLOWN[task.name])
    return tmp_path
