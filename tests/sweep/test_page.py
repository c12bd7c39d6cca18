"""docs/sweeps.md tells what sweep files have."""

import re

from magsim.sweep.settings import WAYS, Axis, SweepSettings
from tests.support.paths import ROOT
from tests.sweep.test_shipped import FLIGHTS

PAGE = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")


def test_every_key_is_on_the_page_with_its_default() -> None:
    known = {field.alias or name for name, field in SweepSettings.model_fields.items()}
    rows = dict(re.findall(r"^\| ((?:`\w+`(?:, )?)+) \| ([^|]+) \|", PAGE, re.MULTILINE))
    documented = {name for names in rows for name in re.findall(r"`(\w+)`", names)}
    assert documented >= known - {"axes"}
    for name in ("seed", "block", "dressings", "shard"):
        assert int(rows[f"`{name}`"]) == SweepSettings.model_fields[name].default


def test_every_way_of_an_axis_is_on_the_page() -> None:
    for name in (*WAYS, *(field.alias or name for name, field in Axis.model_fields.items())):
        assert f"`{name}" in PAGE, name


def test_every_shipped_sweep_is_on_the_page_with_its_flights() -> None:
    for name, flights in FLIGHTS.items():
        assert f"| `{name}` | {flights} |" in PAGE
