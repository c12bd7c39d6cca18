"""The wheel holds what an installed magsim needs, and nothing else."""

import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import entry_points, version

import pytest

import magsim
from tests.support.paths import ROOT

NAME = "aeromagsim"
"""Name of the distribution: ``magsim`` on PyPI is another program. The package and the command are ``magsim``."""

SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> zipfile.ZipFile:
    """Built by the installed hatchling, without network and without an environment of its own."""
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)], cwd=ROOT, check=True)
    (path,) = folder.glob("*.whl")
    return zipfile.ZipFile(path)


def test_the_wheel_ships_code_and_assets(wheel):
    names = set(wheel.namelist())
    for path in (ROOT / "magsim").rglob("*"):
        if path.is_file() and "__pycache__" not in path.parts:
            assert path.relative_to(ROOT).as_posix() in names
    for folder in ("aircraft", "scenarios", "datasets"):
        for path in (ROOT / folder).rglob("*"):
            built = folder == "datasets" and "data" in path.relative_to(ROOT).parts
            if path.is_file() and not built:
                assert f"magsim/_assets/{path.relative_to(ROOT).as_posix()}" in names


def test_the_wheel_ships_nothing_else(wheel):
    for name in wheel.namelist():
        assert name.startswith(("magsim/", f"{NAME}-{magsim.__version__}.dist-info/"))
        assert "__pycache__" not in name
        assert not name.endswith((".h5", ".pyc"))


def test_metadata(wheel):
    (path,) = (name for name in wheel.namelist() if name.endswith("METADATA"))
    text = wheel.read(path).decode()
    assert f"Name: {NAME}\nVersion: {magsim.__version__}\n" in text
    assert "Requires-Python: <3.14,>=3.11" in text
    assert "License-Expression: BSD-3-Clause" in text
    plain = [line for line in text.splitlines() if line.startswith("Requires-Dist:") and "extra ==" not in line]
    assert not any("torch" in line or "matplotlib" in line or "dask" in line for line in plain)


def test_an_unpacked_wheel_finds_its_assets_and_writes_nothing_there(wheel, tmp_path):
    site = tmp_path / "site"
    wheel.extractall(site)
    before = sorted(site.rglob("*"))
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "import magsim, magsim.assets as a\n"
        "from magsim.loading import load_scenario\n"
        "assert a.ROOT.as_posix() == sys.argv[1] + '/magsim/_assets', a.ROOT\n"
        "print(load_scenario('papers/000_simulated').digest)"
    )
    run = [sys.executable, "-I", "-B", "-c", code, site.as_posix()]
    inside = subprocess.run(run, cwd=tmp_path, check=True, capture_output=True, text=True).stdout.strip()
    from magsim.loading import load_scenario

    assert inside == load_scenario("papers/000_simulated").digest
    assert sorted(site.rglob("*")) == before


def test_the_command_is_installed_and_the_versions_agree():
    (command,) = (entry for entry in entry_points(group="console_scripts") if entry.name == "magsim")
    assert command.value == "magsim.cli:main"
    assert SETTINGS["project"]["name"] == NAME
    assert version(NAME) == magsim.__version__ == SETTINGS["project"]["version"]


def test_dev_is_all_other_extras_and_the_tools():
    extras = SETTINGS["project"]["optional-dependencies"]
    assert extras["dev"][0] == f"{NAME}[{','.join(sorted(set(extras) - {'dev'}, key=list(extras).index))}]"


def test_hints_name_the_distribution_and_its_extras():
    extras = "|".join(SETTINGS["project"]["optional-dependencies"])
    hints = set()
    for path in [*(ROOT / "magsim").rglob("*.py"), *ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]:
        hints |= set(re.findall(rf"([\w-]+)\[(?:{extras})[\],]", path.read_text(encoding="utf-8")))
    assert hints == {NAME}


def test_importing_magsim_is_light():
    code = "import sys, magsim; print({'numpy', 'torch', 'h5py', 'jsbsim', 'pydantic'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True).stdout == b"set()\n"
