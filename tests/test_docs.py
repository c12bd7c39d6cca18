"""The documentation agrees with the program."""

import re
import runpy

import pytest

from magsim import columns
from tests.support.parts import length_of_parts
from tests.support.paths import ROOT
from tests.support.quoted import rounds_to


def test_every_column_family_is_documented_with_its_role():
    text = (ROOT / "docs" / "recording.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`.+?) \| (\w+) \|", text, flags=re.MULTILINE)
    documented = {name: role for names, role in rows for name in re.findall(r"`([^`]+)`", names)}
    assert documented == {family.pattern: family.role for family in columns.FAMILIES}


def test_links_between_pages_lead_somewhere():
    for page in [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]:
        for link in re.findall(r"\]\((?!https?://)([^)#]+)", page.read_text(encoding="utf-8")):
            assert (page.parent / link).exists(), f"{page.name}: {link}"


def test_the_length_of_the_parts_is_off_by_what_the_page_says(calibration):
    text = " ".join((ROOT / "docs" / "recording.md").read_text(encoding="utf-8").split())
    (most,) = re.findall(r"by up to (\S+) nT in the calm calibration flight", text)
    (band,) = re.findall(r"at most (\S+) nT \(standard deviation\) in 0\.1 to 0\.6 Hz", text)
    found = length_of_parts(calibration, "cabin")
    assert rounds_to(found.most_nt, most)
    assert found.band_nt <= float(band)


def test_the_own_compensator_of_the_page_can_be_scored(calibration, monkeypatch, tmp_path):
    from magsim.benchmark import evaluate
    from magsim.compensation import registry

    monkeypatch.setattr(registry, "_REGISTRY", dict(registry._REGISTRY))
    text = (ROOT / "docs" / "plugins.md").read_text(encoding="utf-8")
    example = tmp_path / "mine.py"
    (code,) = (block for block in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL) if "class Mine" in block)
    example.write_text(code, encoding="utf-8")
    report = evaluate(calibration, [runpy.run_path(str(example))["Mine"](), f"{example}:Mine", "noise_floor"])
    assert report.value("mine", "ir") == pytest.approx(1.0)
    assert report.value("mine", "rmse_nt") < 400.0
    assert report.value(f"{example}:Mine", "rmse_nt") == report.value("mine", "rmse_nt")


def test_the_own_network_of_the_page_can_be_scored(calibration, monkeypatch, tmp_path):
    from magsim.benchmark import evaluate
    from magsim.compensation import make, registry

    monkeypatch.setattr(registry, "_REGISTRY", dict(registry._REGISTRY))
    text = (ROOT / "docs" / "plugins.md").read_text(encoding="utf-8")
    example = tmp_path / "my_net.py"
    (code,) = (block for block in re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL) if "class Net" in block)
    example.write_text(code, encoding="utf-8")
    shortly = {"steps": 4, "every": 2}
    method = runpy.run_path(str(example))["method"].set_params(**shortly)
    named = make(f"{example}:Net:window=20:steps=4:every=2")
    assert named.settings == method.settings
    report = evaluate(calibration, [method, named, "tl16"])
    assert report.value("Net", "ir") == report.value("my_net.py:Net", "ir") > 1.0


def test_every_method_is_on_the_page():
    from magsim.compensation import names

    text = (ROOT / "docs" / "compensators.md").read_text(encoding="utf-8")
    assert all(f"`{name}`" in text for name in names() if name != "mine")


def test_every_metric_is_on_the_page_with_its_unit_and_meaning():
    from magsim.benchmark import METRICS

    text = (ROOT / "docs" / "benchmark.md").read_text(encoding="utf-8")
    good = {"less": "small", "more": "large", "one": "close to 1"}
    rows = [f"| `{metric.name}` | {metric.unit} | {metric.meaning} | {good[metric.better]} |" for metric in METRICS]
    table = [
        line
        for line in text.splitlines()
        if re.match(r"\| `[\w.]+` \| (nT|pT|1) \| .* \| (small|large|close to 1) \|$", line)
    ]
    assert table == rows
