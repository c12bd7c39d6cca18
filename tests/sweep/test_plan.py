"""Sweep files: what is read, and what is refused with file, line and key."""

import re
import tracemalloc
from pathlib import Path

import pytest

from magsim import sweep as room
from magsim.cli import main
from magsim.errors import RequestError
from magsim.loading import load_scenario
from tests.support.sweeps import LINE, sweep_file


def read(tmp_path: Path, sweep: str, scenario: str = LINE) -> room.SweepPlan:
    """Read a scenario with a sweep."""
    path = tmp_path / "line.toml"
    path.write_text(scenario + sweep, encoding="utf-8")
    return room.read_sweep(path)


@pytest.mark.parametrize(
    ("sweep", "message"),
    [
        ("", r"line.toml: has no \[sweep\]; magsim generate flies a scenario of one flight"),
        ("[sweep]\nflight = 3", r"line.toml:\d+: sweep.flight: unknown key \(did you mean 'flights'\?\)"),
        ("[sweep]\n[[sweep.axes]]\nkey = 'seed'\nuniform = [1, 2]", r"sweep.flights: is missing; allowed: a whole"),
        (
            "[sweep]\nflights = 5\n[[sweep.axes]]\nkey = 'day'\ngrid = [1, 2]",
            r"line.toml:\d+: sweep.flights: 5 is no multiple of the grid's 2 flights; allowed: 2, 4, ...",
        ),
        ("[sweep]\n[[sweep.axes]]\nkey = 'day'", r"sweep.axes\[0\]: has no values; allowed: one of grid, list, number"),
        ("[sweep]\n[[sweep.axes]]\ngrid = [1]", r"sweep.axes\[0\].key: is missing; allowed: a key path"),
        ("[sweep]\n[[sweep.axes]]\nkey = 'a b'\ngrid = [1]", r"sweep.axes\[0\].key\[0\]: 'a b' is no key path"),
        (
            "[sweep]\n[[sweep.axes]]\nkey = 'day'\ngrid = [1]\nwhole = true",
            r"sweep.axes\[0\].whole: has no effect on grid; allowed: with uniform",
        ),
        (
            "[sweep]\nflights = 2\n[[sweep.axes]]\nkey = 'day'\nuniform = [3, 1]",
            r"sweep.axes\[0\].uniform\[1\]: 1.0 is not above 3.0; allowed: more than the first",
        ),
        (
            "[sweep]\n[[sweep.axes]]\nkey = 'day'\ngrid = [1]\n[[sweep.axes]]\nkey = 'day'\ngrid = [2]",
            r"sweep.axes\[1\].key: 'day' is set by axes\[0\] too; allowed: each key once",
        ),
        (
            "[sweep]\n[[sweep.axes]]\nkey = 'day'\nlist = [1]\n[[sweep.axes]]\nkey = 'seed'\nlist = [2, 3]",
            r"sweep.axes\[1\].list: has 2 values, the first list 1; allowed: as many",
        ),
        (
            "[sweep]\n[[sweep.axes]]\nkey = 'sensors.fluxgate[*].mount'\ngrid = ['x']",
            r"sweep.axes\[0\].key: 'sensors.fluxgate\[\*\].mount' fits no list of the scenario; allowed: \[\*\] after",
        ),
        (
            "[sweep]\nflights = 2\n[[sweep.axes]]\nkey = 'day'\nuniform = [1, 2, 3]",
            r"sweep.axes\[0\].uniform: has 3 entries; allowed: a list of 2 values, each a number or a date",
        ),
        (
            "[sweep]\nset = ['sweep.seed=3']\n[[sweep.axes]]\nkey = 'day'\ngrid = [1]",
            r"line.toml:\d+: sweep.set\[0\]: 'sweep.seed=3' is of the sweep itself; allowed: settings of the scenario",
        ),
        (
            "[sweep]\nset = ['start.alt=3']\n[[sweep.axes]]\nkey = 'day'\ngrid = [1]",
            r"line.toml:\d+: sweep.set\[0\]: start.alt: unknown key \(did you mean 'alt_m'\?\)",
        ),
        (
            "[sweep]\n[[sweep.axes]]\nkey = 'day'\ngrid = { from = -1e308, to = 1e308, count = 3 }",
            r"sweep.axes\[0\].grid.to: 1e\+308 is too far from -1e\+308; allowed: numbers of ordinary size",
        ),
        (
            "[sweep]\nflights = 2\n[[sweep.axes]]\nkey = 'day'\nnormal = [1000.0, 1.0]\nlimits = [1040.0, 1060.0]",
            r"sweep.axes\[0\].limits: leave less than 1e-06 of the distribution; allowed: limits nearer to its mean",
        ),
        (
            "[sweep]\nflights = 2\n[[sweep.axes]]\nkey = 'day'\nuniform = [0.5, 1e300]\nwhole = true",
            r"sweep.axes\[0\].uniform\[0\]: 0.5 is no bound of whole numbers; allowed: .*\n.*\[1\]: 1e\+300 is no",
        ),
        (
            "[sweep]\nrequire = 'start.alt_m ** 2 > 1'\n[[sweep.axes]]\nkey = 'day'\ngrid = [1]",
            r"line.toml:\d+: sweep.require\[0\]: 'start.alt_m \*\* 2 > 1' cannot be understood; allowed: a comparison",
        ),
        (
            "[sweep]\nrequire = 'start.alt > 1'\n[[sweep.axes]]\nkey = 'day'\ngrid = [1]",
            r"sweep.require\[0\]: 'start.alt' neither varies nor is a number in the scenario's file",
        ),
    ],
)
def test_what_is_refused(tmp_path: Path, sweep: str, message: str) -> None:
    with pytest.raises(RequestError, match=message):
        read(tmp_path, sweep)


def test_the_scenario_is_what_is_left_without_the_sweep(tmp_path: Path) -> None:
    sweep = "[sweep]\nflights = 2  # [[not.a.table]]\n[[sweep.axes]]\nkey = 'day'\nchoice = [\n  [1, 2],\n  [3],\n]\n"
    head, tail = LINE[: LINE.index("[start]")], LINE[LINE.index("[start]") :]
    plan = read(tmp_path, tail, head + sweep)
    alone = tmp_path / "alone.toml"
    alone.write_text(LINE, encoding="utf-8")
    assert plan.base.scenario == load_scenario(alone).scenario
    assert "sweep" not in plan.base.text
    # lines stay where they are, so that messages name them
    wrong = head + sweep + tail.replace("straight", "strait")
    line = wrong[: wrong.index("strait")].count("\n") + 1
    with pytest.raises(RequestError, match=rf"line.toml:{line}: pattern.kind: 'strait' is not allowed"):
        read(tmp_path, "", wrong)


def test_a_sweep_of_another_scenario(tmp_path: Path) -> None:
    (tmp_path / "line.toml").write_text(LINE, encoding="utf-8")
    path = tmp_path / "sweep.toml"
    path.write_text(
        '[sweep]\nscenario = "line.toml"\nset = ["start.alt_m=1234"]\n[[sweep.axes]]\nkey = "day"\ngrid = [0, 1]\n',
        encoding="utf-8",
    )
    plan = room.read_sweep(path, ["start.lat_deg=10.0"])
    flights = [plan.load(flight) for flight in plan.space.flights(0, 2)]
    assert [loaded.scenario.day for loaded in flights] == [0, 1]
    assert {(loaded.scenario.start.alt_m, loaded.scenario.start.lat_deg) for loaded in flights} == {(1234.0, 10.0)}
    path.write_text(path.read_text(encoding="utf-8") + "[start]\nalt_m = 3\n", encoding="utf-8")
    with pytest.raises(RequestError, match=r"sweep.toml:\d+: start: has no effect beside sweep.scenario = 'line.toml'"):
        room.read_sweep(path)


def test_a_star_is_every_element_of_a_list(tmp_path: Path) -> None:
    second = '[[sensors.scalar]]\nname = "tail"\nmount = "sgl_mag_1"\n'
    axis = '[sweep]\n[[sweep.axes]]\nkey = "sensors.scalar[*].noise_nt_rthz"\ngrid = [0.01, 0.02]\n'
    plan = read(tmp_path, second + axis)
    assert plan.space.names == ("sensors.scalar[0].noise_nt_rthz", "sensors.scalar[1].noise_nt_rthz")
    last = plan.load([*plan.space.flights(0, 2)][1])
    assert [sensor.noise_nt_rthz for sensor in last.scenario.sensors.scalar] == [0.02, 0.02]


def test_seeds_are_of_the_flight_and_of_its_instruments(tmp_path: Path) -> None:
    plan = room.read_sweep(sweep_file(tmp_path))
    found = [plan.load(flight).scenario for flight in plan.space.flights(0, 8)]
    assert len({scenario.seed for scenario in found}) == 4
    assert len({scenario.sensors.seed for scenario in found}) == 8
    fixed = room.read_sweep(sweep_file(tmp_path), ["sweep.new_seeds=false"])
    assert {fixed.load(flight).scenario.seed for flight in fixed.space.flights(0, 8)} == {1}


def test_splits_are_of_whole_flights_with_all_their_dressings(tmp_path: Path) -> None:
    plan = room.read_sweep(sweep_file(tmp_path, "\n[sweep.split]\nvalid = 0.2\ntest = 0.3\n", flights=2000))
    words = {number: plan.split(number) for number in range(1000)}
    shares = [sum(word == wanted for word in words.values()) / 1000 for wanted in ("train", "valid", "test")]
    assert shares == pytest.approx([0.5, 0.2, 0.3], abs=0.05)
    for flight in plan.space.flights(0, 40):
        assert plan.load(flight).scenario.recording.split == words[flight.flown]


def test_a_million_flights_need_no_memory(tmp_path: Path) -> None:
    plan = room.read_sweep(sweep_file(tmp_path, flights=1_000_000))
    tracemalloc.start()
    try:
        for first in range(0, 1_000_000, 250_000):
            assert sum(1 for _ in plan.space.flights(first, first + 4096)) == 4096
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 20e6


def test_all_flights_refused_ends_before_the_first(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    path = sweep_file(tmp_path, '\n[[sweep.axes]]\nkey = "start.altitude_m"\ngrid = [1000.0]\n')
    assert main(["sweep", str(path), "-o", str(tmp_path / "out")]) == 2
    errors = capsys.readouterr().err
    assert re.search(
        r"line.toml:\d+: sweep.axes\[2\]: start.altitude_m: unknown key \(did you mean 'alt_m'\?\)", errors
    )
    assert "none of 8 flights of the sweep that were looked at can be flown" in errors
    assert not (tmp_path / "out").exists()


def test_generate_says_what_flies_a_sweep(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["generate", str(sweep_file(tmp_path))]) == 2
    assert "is a sweep of many flights ([sweep]); magsim sweep flies them" in capsys.readouterr().err


def test_a_dry_run_tells_what_would_be_flown_and_writes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = sweep_file(tmp_path, flights=1000)
    assert main(["sweep", str(path), "--dry-run", "-w", "4"]) == 0
    told = capsys.readouterr()
    assert "1000 of 1000" in told.out
    assert "flown       500, each dressed 2 times" in told.out
    assert "sensors.scalar[0].noise_nt_rthz  2 values: 0.001, 0.1" in told.out
    assert "core hours" in told.out
    assert "with 4 workers" in told.out
    assert [entry.name for entry in tmp_path.iterdir()] == ["line.toml"]


@pytest.mark.parametrize("part", ["0/4", "5/4", "2", "a/b", "1/0"])
def test_parts_that_there_are_not(part: str, tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["sweep", str(sweep_file(tmp_path)), "--shard", part]) == 2
    assert "is no part of a sweep; allowed: i/n" in capsys.readouterr().err
