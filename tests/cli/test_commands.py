"""The command line: output, exit codes, messages."""

import hashlib
import json
import os
import pty
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import click
import numpy as np
import pytest

import magsim
from magsim import assets, cli, exchange, plots
from magsim.cli import import_
from magsim.cli.interrupts import delayed
from magsim.recording import Recording, file
from magsim.storage import cache_folder
from tests.support.caches import without_results

MAGSIM = [sys.executable, "-m", "magsim"]


def magsim_run(*args: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*MAGSIM, *args], cwd=cwd, capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )


@pytest.fixture(autouse=True)
def interrupts_arrive():
    """Let interrupts arrive, here and in children: tests that run in the background ignore them."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def here(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def small(name: str = "small") -> Recording:
    n = 60
    segments = {"circuit": np.ones(n), "leg": np.repeat([1.0, 2.0], n // 2), "split": np.repeat([0.0, 2.0], n // 2)}
    maneuver = {"axis": "pitch", "circuit": 1, "leg": 1, "asked_deg": 5.0, "flown_deg": 5.02, "period_s": 6.0}
    meta = {"seed": 7, "digest": "ab" * 32, "version": "0.1.0", "maneuvers": [maneuver]}
    data = {"mag_cabin_nt": np.linspace(0, 1, n), "flux_f_x_nt": np.zeros(n), **segments}
    return Recording(name, np.arange(n) * 0.1, data, meta)


def test_help_and_version(here, capsys):
    assert cli.main(["--help"]) == 0
    text = capsys.readouterr().out
    for command in cli.COMMANDS:
        assert f"\n  {command} " in text
    assert cli.main(["plot", "--help"]) == 0
    assert "\n  field         reading and background\n" in capsys.readouterr().out
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out == f"magsim {magsim.__version__}\n"


def commands_below(group: click.Group, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    for name in group.list_commands(click.Context(group)):
        command = group.get_command(click.Context(group), name)
        assert command is not None
        yield (*path, name), command
        if isinstance(command, click.Group):
            yield from commands_below(command, (*path, name))


def test_every_command_and_every_option_has_a_help(here, capsys):
    found = list(commands_below(cli.cli))
    assert len(found) >= len(cli.COMMANDS) + 3
    for path, command in found:
        assert cli.main([*path, "--help"]) == 0
        text = capsys.readouterr().out
        assert "\\" not in text, path
        if len(path) == 1:
            assert command.get_short_help_str(200) == cli.COMMANDS[path[0]][1]
        for option in command.params:
            if isinstance(option, click.Option):
                assert option.help, (path, option.name)


def test_tables_in_a_help_have_a_line_for_each_entry(here, capsys):
    for command, entries in {
        "export": exchange.FORMATS,
        "import": import_.FORMATS,
        "plot": plots.KINDS,
    }.items():
        assert cli.main([command, "--help"]) == 0
        lines = capsys.readouterr().out.splitlines()
        for entry in entries:
            assert [line for line in lines if re.match(rf"  {re.escape(entry)}  +\w", line)], (command, entry)


def test_the_help_of_generate_lists_the_shipped_scenarios(here, capsys):
    assert cli.main(["generate", "--help"]) == 0
    words = capsys.readouterr().out.replace(",", " ").split()
    assert set(assets.list_scenarios()) <= set(words)


def test_help_imports_only_click(here):
    code = (
        "import sys; from magsim.cli import main; main(['--help'])\n"
        "heavy = {'numpy', 'pydantic', 'h5py', 'rich', 'jsbsim', 'torch'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True).stderr == b"[]\n"


@pytest.mark.parametrize(
    ("args", "text"),
    [
        (["generat"], "there is no command 'generat' (did you mean 'generate'?)"),
        (["generate"], "Missing argument 'SCENARIO'"),
        (["generate", "x", "--sat", "a=1"], "No such option"),
    ],
)
def test_wrong_usage_is_exit_2(here, capsys, args, text):
    assert cli.main(args) == 2
    assert text in capsys.readouterr().err


def test_schema_is_json(here, capsys):
    assert cli.main(["schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert "aircraft" in schema["properties"]


def test_info_shows_the_contents_of_a_recording(here, capsys):
    small().write("small.h5")
    assert cli.main(["info", "small.h5"]) == 0
    out = capsys.readouterr().out
    for words in ("small   60    10       5.9         cabin           f", "seed     7", "mag_{sensor}_nt", "ab" * 32):
        assert words in out
    assert "1        2    leg   -            test   3.0      30" in out
    assert "1        1    train  pitch  -        6         -       5          5.02" in out


def test_info_shows_how_a_drape_was_flown(here, capsys):
    recording = small()
    notes = {"drape_worst_error_m": 1.25, "drape_lowest_above_ground_m": "\x1b[31m"}
    Recording(recording.name, recording.time_s, recording.data, {"notes": notes}).write("drape.h5")
    assert cli.main(["info", "drape.h5"]) == 0
    out = capsys.readouterr().out
    assert "Drape: heights on the lines" in out
    assert "1.25" in out
    assert "\x1b" not in out


def test_info_lists_several_flights(here, capsys):
    file.write(Path("a.h5"), [small("one"), small("two")])
    assert cli.main(["info", "a.h5"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("Flights\n")
    assert "one" in out
    assert "two" in out
    assert "Columns" not in out


def test_info_lists_individuals_and_days_of_several_flights(here, capsys):
    flights = [
        Recording(name, r.time_s, r.data, {"individual": individual, "day": day})
        for name, individual, day in (("one", 7, 3), ("two", 8, 0))
        for r in [small(name)]
    ]
    file.write(Path("a.h5"), flights)
    assert cli.main(["info", "a.h5"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert lines[1][:4] == ["flight", "individual", "day", "rows"]
    assert [line[:3] for line in lines[2:]] == [["one", "7", "3"], ["two", "8", "0"]]


def test_info_shows_one_flight_of_a_shard_in_full(here, capsys):
    file.write(Path("two.h5"), [small("first"), small("second")])
    assert cli.main(["info", "two.h5", "--flight", "second"]) == 0
    text = capsys.readouterr().out
    assert "second" in text
    assert "first" not in text
    assert "Provenance" in text
    assert cli.main(["info", "two.h5", "--flight", "third"]) == 2
    assert "there is no flight 'third'" in capsys.readouterr().err


def test_verify_reports_whether_a_file_is_sound(here, capsys):
    file.write(Path("two.h5"), [small("first"), small("second")])
    assert cli.main(["verify", "two.h5"]) == 0
    size = Path("two.h5").stat().st_size
    digest = hashlib.sha256(Path("two.h5").read_bytes()).hexdigest()
    sound = f"two.h5: sound; 2 flights, 120 rows, 5 columns, {size} bytes; sha256 {digest}\n"
    assert capsys.readouterr().out == sound
    data = bytearray(Path("two.h5").read_bytes())
    data[-20] ^= 1
    Path("two.h5").write_bytes(data)
    assert cli.main(["verify", "two.h5"]) == 3
    assert capsys.readouterr().err.startswith("two.h5: is damaged: ")
    assert cli.main(["verify", "no.h5"]) == 2


def test_verify_takes_files_and_folders_and_checks_all_of_them(here, capsys):
    Path("shards").mkdir()
    for name in ("one.h5", "shards/a.h5", "shards/b.h5"):
        file.write(Path(name), [small("first")])
    assert cli.main(["verify", "shards", "one.h5", "shards/a.h5"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == ["shards/a.h5", "shards/b.h5", "one.h5"]
    assert all(": sound; 1 flight, 60 rows" in line for line in lines)
    data = bytearray(Path("shards/a.h5").read_bytes())
    data[-20] ^= 1
    Path("shards/a.h5").write_bytes(data)
    assert cli.main(["verify", "shards", "one.h5"]) == 3
    told = capsys.readouterr()
    assert [line.split(":")[0] for line in told.out.splitlines()] == ["shards/b.h5", "one.h5"]
    assert told.err.startswith("shards/a.h5: is damaged: ")
    assert cli.main(["verify", "one.h5", "no.h5"]) == 2
    Path("empty").mkdir()
    assert cli.main(["verify", "empty"]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert "no.h5: there is no such file or folder" in told.err
    assert "empty: this folder has no recording" in told.err


def test_info_on_a_terminal_shows_tables(here):
    small().write("small.h5")
    leader, follower = pty.openpty()
    environment = {**os.environ, "COLUMNS": "150", "TERM": "xterm"}
    subprocess.run([*MAGSIM, "info", "small.h5"], stdout=follower, env=environment, check=True)
    os.close(follower)
    shown = os.read(leader, 65536).decode()
    os.close(leader)
    assert "─" in shown
    assert "small" in shown


def test_control_characters_of_a_file_do_not_reach_the_terminal(here, capsys):
    recording = small()
    evil = Recording(recording.name, recording.time_s, recording.data, {"seed": 1, "version": "\x1b[31mred"})
    evil.write("evil.h5")
    assert cli.main(["info", "evil.h5"]) == 0
    assert "\x1b" not in capsys.readouterr().out
    assert cli.main(["info", "no\x1b[31m.h5"]) == 2
    err = capsys.readouterr().err
    assert err == "no\\x1b[31m.h5: there is no such file\n"


@pytest.mark.parametrize(
    ("args", "code", "error"),
    [
        (["info", "no.h5"], 2, "no.h5: there is no such file\n"),
        (["info", "text.h5"], 3, "text.h5: is not an HDF5 file, so it is no recording\n"),
        (["info", "cut.h5"], 3, "cut.h5: is truncated: it ends before its data do\n"),
        (["info", "folder"], 2, "folder: this folder has no recording (*.h5)\n"),
        (["generate", "s.toml"], 2, "s.toml:3: is not TOML: Invalid value (column 1)\n"),
        (
            ["generate", "calibration_c208b", "-o", "no/x.h5"],
            2,
            "cannot write no/x.h5: there is no folder no; make it first, or give another path\n",
        ),
        (["generate", "calibration_c208b", "-o", "text.h5"], 2, "text.h5 exists already; --force replaces it\n"),
        (
            ["generate", "calibration_c208b", "--set", "start.alt_m=-1", "--set", "seed=x"],
            2,
            (
                "--set start.alt_m: -1 is not allowed; allowed: a number above 0\n"
                "--set seed: 'x' is text; allowed: a whole number of 0 or more, below 9223372036854775808\n"
            ),
        ),
    ],
)
def test_failures_are_plain_lines_and_leave_nothing(here, capsys, args, code, error):
    (here / "text.h5").write_text("this is no recording")
    (here / "folder").mkdir()
    (here / "s.toml").write_text("schema = 1\nseed = [\n= 3]\n")
    small().write("whole.h5")
    (here / "cut.h5").write_bytes((here / "whole.h5").read_bytes()[:2000])
    before = sorted(here.rglob("*"))
    assert cli.main(args) == code
    captured = capsys.readouterr()
    assert captured.err == error
    assert captured.out == ""
    assert sorted(here.rglob("*")) == before


def test_long_messages_are_not_wrapped(here):
    (here / "s.toml").write_text("schema = 1\nsensor_with_a_name = 1\n")
    run = magsim_run("generate", "s.toml", cwd=here, COLUMNS="40")
    assert run.returncode == 2
    lines = run.stderr.splitlines()
    assert all(line.startswith("s.toml:") for line in lines)
    assert max(map(len, lines)) > 100
    assert "Traceback" not in run.stderr


def test_a_reader_that_stops_early_is_no_error(here):
    with subprocess.Popen([*MAGSIM, "schema"], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as run:
        run.stdout.close()
        assert run.stderr.read() == b""
    assert run.returncode == cli.BROKEN_PIPE


SHORT = (
    "pattern.circuits=1",
    "pattern.leg_m=4000",
    'pattern.maneuvers=[{ axis = "roll", amplitude_deg = 10 }]',
    'field.eddy.model="coils"',  # the skin's bits on two threads are those of tests/field/test_response.py
)


def test_the_same_scenario_gives_the_same_bytes_anywhere(here):
    """Another folder, name instead of path, thread count, time zone, locale, home, empty cache, hash seed.

    The second run computes on two threads what the first reads from the cache of all tests.
    """
    source = Path(magsim.__file__).parents[1] / "scenarios" / "calibration_c208b.toml"
    runs = [
        (
            ["generate", str(source)],
            {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "TZ": "UTC", "LC_ALL": "C", "HOME": str(here)},
        ),
        (
            ["generate", "calibration_c208b.toml"],
            {"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2", "TZ": "Asia/Tokyo", "PYTHONHASHSEED": "5"},
        ),
    ]
    caches = str(cache_folder()), without_results(here / "cache")
    seen = set()
    for number, ((args, environment), cache) in enumerate(zip(runs, caches, strict=True)):
        folder = here / str(number)
        folder.mkdir()
        overrides = (f"--set={override}" for override in SHORT)
        run = magsim_run(*args, *overrides, cwd=folder, **environment, MAGSIM_CACHE=cache)
        assert run.returncode == 0, run.stderr
        assert run.stderr == ""
        assert [path.name for path in folder.iterdir()] == ["calibration_c208b.h5"]
        seen.add((folder / "calibration_c208b.h5").read_bytes())
    assert len(seen) == 1
    loaded = Recording.read(here / "0" / "calibration_c208b.h5")
    assert loaded.meta["overrides"] == list(SHORT)
    data = seen.pop()
    for word in (str(here), str(source.parent)):
        assert word.encode() not in data


def test_an_interrupt_is_delayed_not_lost():
    seen = []

    def load() -> None:
        """As a library does that catches everything."""
        try:
            signal.raise_signal(signal.SIGINT)
            seen.append("went on")
        except BaseException:
            seen.append("was lost")

    with pytest.raises(KeyboardInterrupt), delayed():
        load()
    assert seen == ["went on"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_run_leaves_nothing(here, number, code):
    code_of_run = (
        "import sys; from magsim.cli import main; print('ready', file=sys.stderr, flush=True)\n"
        "sys.exit(main(['generate', 'calibration_c208b']))"
    )
    with subprocess.Popen([sys.executable, "-c", code_of_run], stderr=subprocess.PIPE, text=True) as run:
        assert run.stderr.readline() == "ready\n"
        time.sleep(0.7)
        run.send_signal(number)
        _, error = run.communicate(timeout=30)
    assert run.returncode == code
    assert "Traceback" not in error
    assert list(here.iterdir()) == []
