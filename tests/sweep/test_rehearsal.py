"""What is said of a sweep before it is flown."""

import time
from datetime import UTC, datetime
from pathlib import Path

import pytest

from magsim import sweep as room
from magsim.cli import main
from magsim.sweep.rehearsal import Range
from tests.support.sweeps import LINE, sweep_file


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ([2, 1.5, 2], "2 values: 1.5, 2"),
        (["seat", "cabin"], "2 values: seat, cabin"),
        ([{"b": 1}, {"a": 2}], "2 values: {'b': 1}, {'a': 2}"),
        ([datetime(2025, 1, 2, tzinfo=UTC), 3], "2 values: 2025-01-02 00:00:00+00:00, 3"),
        (
            [datetime(2025, 1, 2, tzinfo=UTC), datetime(2025, 1, 1)],
            "2 values: 2025-01-02 00:00:00+00:00, 2025-01-01 00:00:00",
        ),
        ([*range(20)], "0 to 19"),
        ([*range(20), "x"], "many values"),
    ],
)
def test_values_of_any_kind_are_shown_in_an_order_that_stays(values: list[object], text: str) -> None:
    found = Range()
    found.add(values[:1])
    found.add(values[1:])
    assert found.text == text


def test_a_hundred_million_flights_are_not_waited_for(tmp_path: Path) -> None:
    wide = '\n[[sweep.axes]]\nkey = "start.lat_deg"\ngrid = { from = 0.0, to = 60.0, count = 100000 }\n'
    path = sweep_file(tmp_path, wide, flights=100_000_000)
    plan = room.read_sweep(path, ["sweep.require=start.heading_deg < 90"])
    began = time.process_time()
    found, count = room.ranges(plan)
    assert time.process_time() - began < 30.0  # all of them take twenty minutes
    assert count == pytest.approx(25e6, rel=0.01)
    assert found["start.lat_deg"].text == "0 to 60"
    assert found["start.heading_deg"].most < 90.0


def test_a_dry_run_flies_what_can_be_flown(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    path = tmp_path / "line.toml"
    path.write_text(f'{LINE}[sweep]\n[[sweep.axes]]\nkey = "start.alt_m"\ngrid = [-5.0, 1000.0]\n', encoding="utf-8")
    assert main(["sweep", str(path), "--dry-run", "-q"]) == 0
    told = capsys.readouterr().out
    assert "sweep.axes[0]: start.alt_m: -5 is not allowed; allowed: a number above 0" in told
    assert "(from 1 flights)" in told
