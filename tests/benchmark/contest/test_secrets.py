"""What a method can find out from its process: nothing of the truth, of other flights, or of what it has seen before.

A method tells what it has found by an error, which the judge shows.
"""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from magsim import columns
from magsim.benchmark.contest import Contest, Contestant, sandbox
from tests.benchmark.contest.cases import LIMITS, SENSOR, flights, judged, method_file, rounds, training

SECRET = "the_truth_of_" + "this_judge"
HIDDEN_HERE = {"truth": SECRET}
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="asks /proc")


def told(contest, folder, body, **parts):
    """Return what the body of an estimate has told."""
    found = judged(contest, method_file(folder, body, **parts))
    assert found.status == "crashed"
    assert found.reason.startswith("RuntimeError: ")
    return json.loads(found.reason.removeprefix("RuntimeError: "))


@pytest.fixture
def sandboxed(contest):
    if not contest.sandboxed:
        pytest.skip("the kernel has no Landlock")
    return contest


def test_live_objects_and_frames_hold_no_truth(contest, tmp_path):
    body = """
        roles, texts = set(), []
        from magsim import columns
        for one in gc.get_objects():
            if type(one).__name__ == "Recording":
                roles |= {columns.role_of(name) for name in one.data}
            if isinstance(one, dict):
                texts += [value for value in one.values() if isinstance(value, str)]
        frame = sys._getframe()
        while frame:
            texts += [str(value) for value in frame.f_locals.values() if isinstance(value, (str, dict))]
            frame = frame.f_back
        secret = "the_truth_of_" + "this_judge"
        raise RuntimeError(json.dumps([sorted(roles), any(secret in text for text in texts)]))
    """
    held_here = {columns.role_of(name) for flight in flights() for name in flight.data}
    assert "truth" in held_here
    assert told(contest, tmp_path, body) == [["input"], False]


def test_only_what_is_required_is_sent_and_nothing_that_names_a_flight(contest, tmp_path):
    body = """
        told = [recording.name[:7], sorted(recording.meta), sorted(recording.data), recording.time_s.flags.writeable]
        raise RuntimeError(json.dumps(told))
    """
    named = [replace(one, meta={**one.meta, "seed": 3, "individual": 7, "scenario": "text"}) for one in flights()]
    name = method_file(tmp_path, body)
    found = contest.run(Contestant("a", name), training(), SENSOR, [named], LIMITS, np.random.default_rng(0))
    columns = [f"flux_nose_{axis}_nt" for axis in "xyz"]
    expected = ["flight_", ["rate_hz", "start_utc"], columns, False]
    assert json.loads(found.reason.removeprefix("RuntimeError: ")) == expected


def test_truth_in_training_flights_is_not_sent(contest, tmp_path):
    learn = """
        from magsim import columns
        raise RuntimeError(json.dumps(sorted({columns.role_of(name) for name in training.recordings[0].data})))
    """
    name = method_file(tmp_path, learn=learn)
    with_truth = [replace(one, data={k: v for k, v in one.data.items() if k != "split"}) for one in flights()]
    found = contest.run(Contestant("a", name), with_truth, SENSOR, rounds(), LIMITS, np.random.default_rng(0))
    assert json.loads(found.reason.removeprefix("RuntimeError: ")) == ["input", "label", "segment"]


def test_the_environment_and_the_folder_are_bare(tmp_path, monkeypatch):
    monkeypatch.setenv("LADDER_SECRET", SECRET)
    body = """
        inherited = Path("/proc/self/environ").read_bytes() if Path("/proc/self").exists() else b""
        told = [sorted(os.environ), b"the_truth_of_" in inherited, os.path.samefile(".", os.environ["HOME"])]
        told += [os.path.samefile(tempfile.gettempdir(), "."), sorted(os.listdir(".")), len(sys.argv) - 2]
        raise RuntimeError(json.dumps(told))
    """
    with Contest() as contest:
        names = ["HOME", "OMP_NUM_THREADS", "PATH", "TMPDIR"]
        assert told(contest, tmp_path, body) == [names, False, True, True, ["given"], 0]


@LINUX
def test_no_file_of_the_judge_is_open(contest, tmp_path):
    # three that lead nowhere, and the line to the judge; listing them opens one more
    body = """
        open_now = sorted(os.readlink(f"/proc/self/fd/{n}").partition(":")[0] for n in range(64)
                          if os.path.islink(f"/proc/self/fd/{n}"))
        raise RuntimeError(json.dumps(open_now))
    """
    with (tmp_path / "truth").open("w") as held:
        os.set_inheritable(held.fileno(), True)
        assert told(contest, tmp_path, body) == ["/dev/null"] * 3 + ["socket"]


def test_files_elsewhere_cannot_be_read_or_written(sandboxed, tmp_path):
    (tmp_path / "truth.txt").write_text(SECRET, encoding="utf-8")
    body = """
        told = []
        for attempt in (
            lambda: Path("{folder}/truth.txt").read_text(),
            lambda: os.listdir("{folder}"),
            lambda: os.listdir("/"),
            lambda: os.listdir(".."),
            lambda: Path("{folder}/new.txt").write_text("x"),
            lambda: Path("/tmp/new.txt").write_text("x"),
            lambda: Path("/dev/shm/new").write_text("x"),
            lambda: os.symlink("{folder}/truth.txt", "link") or Path("link").read_text(),
            lambda: os.link("{folder}/truth.txt", "link2") or Path("link2").read_text(),
            lambda: os.system("cat {folder}/truth.txt > out") and 1 / 0,
            lambda: Path("/proc/{judge}/environ").read_bytes() and 1,
            lambda: os.open("/proc/{judge}/mem", os.O_RDONLY),
            lambda: os.listdir("/proc/{judge}/fd"),
            lambda: os.listdir("/proc"),
            lambda: os.kill({judge}, 0),
        ):
            try:
                attempt()
                told.append(1)
            except (OSError, ZeroDivisionError):
                told.append(0)
        raise RuntimeError(json.dumps(told))
    """.replace("{folder}", str(tmp_path)).replace("{judge}", str(os.getpid()))
    found = told(sandboxed, tmp_path, body)
    # the last one is a signal, which the sixth version of Landlock keeps back
    assert found == [0] * 14 + [0 if sandbox.level() >= 6 else found[-1]]


def seen_by_round(contest, folder, remembers, remember, *, end=""):
    """Return, for three rounds of the same two flights, in how many of them a method notices that it has been there."""
    body = f"""
        seen = bool({remembers})
        {remember}
        return np.full(len(recording), float(seen))
    """
    name = method_file(folder, body, end=end)
    twice = [rounds()[0]] * 3
    found = contest.run(Contestant("a", name), training(), SENSOR, twice, LIMITS, np.random.default_rng(0))
    assert (found.status, found.reason) == ("ok", "")
    return [sum(float(one[0]) for one in estimates) for estimates in found.estimates]


REMEMBERS = {
    "a global": ("SEEN", "SEEN.append(1)"),
    "a module": ("hasattr(json, 'seen')", "json.seen = 1"),
    "a class": ("hasattr(type(recording), 'seen')", "type(recording).seen = 1"),
    "itself": ("hasattr(self, 'seen_')", "self.seen_ = 1"),
    "the environment": ("'SEEN' in os.environ", "os.environ['SEEN'] = '1'"),
    "the folder": ("Path('seen').exists()", "Path('seen').touch()"),
    "temporary files": ("Path(tempfile.gettempdir(), 'seen').exists()", "Path(tempfile.gettempdir(), 'seen').touch()"),
    "the home": ("Path.home().joinpath('seen').exists()", "Path.home().joinpath('seen').touch()"),
}


@pytest.mark.parametrize("how", REMEMBERS)
def test_a_second_round_knows_nothing_of_the_first(contest, tmp_path, how):
    """Within a round the second flight does know of the first, so each of the ways would work in one process."""
    assert seen_by_round(contest, tmp_path, *REMEMBERS[how], end="\nSEEN = []\n") == [1.0, 1.0, 1.0]


def test_elsewhere_on_the_disk_nothing_is_remembered(sandboxed, tmp_path):
    places = [str(tmp_path / "seen"), *(f"/{folder}/magsim_seen" for folder in ("tmp", "var/tmp", "dev/shm"))]
    end = f"""
def write():
    for place in {places}:
        with contextlib.suppress(OSError):
            Path(place).touch()
"""
    seen = f"any(map(os.path.exists, {places}))"
    assert seen_by_round(sandboxed, tmp_path, seen, "write()", end=end) == [0.0, 0.0, 0.0]


LEAVES = """
def leave(port):
    if os.fork():
        os.wait()
        return
    os.setsid()
    if os.fork():
        os._exit(0)
    # neither in the group nor a child of the method's process
    lines = []
    with contextlib.suppress(OSError):
        lines.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        lines[-1].bind(("127.0.0.1", port))
    with contextlib.suppress(OSError):
        lines.append(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
        lines[-1].bind(chr(0) + "magsim_seen")
    time.sleep(30.0)
    os._exit(0)

def found(port):
    for kind, place in ((socket.AF_INET, ("127.0.0.1", port)), (socket.AF_UNIX, chr(0) + "magsim_seen")):
        with socket.socket(kind, socket.SOCK_DGRAM) as line, contextlib.suppress(OSError):
            line.connect(place)
            line.send(b"x")
            time.sleep(0.05)
            line.send(b"x")
            return True
    return False
"""


@LINUX
def test_a_process_that_is_left_behind_is_ended(contest, tmp_path):
    found = seen_by_round(contest, tmp_path, "found(47391)", "leave(47391); time.sleep(0.2)", end=LEAVES)
    assert found == [1.0, 1.0, 1.0]
    server = contest._server_for("tl16").pid
    assert Path(f"/proc/{server}/task/{server}/children").read_text(encoding="ascii") == ""


@LINUX
def test_shared_memory_is_not_shared(sandboxed, tmp_path):
    end = """
def memory(flags):
    import ctypes
    return ctypes.CDLL(None).shmget(47391, 4096, flags) >= 0
"""
    assert seen_by_round(sandboxed, tmp_path, "memory(0o600)", "memory(0o1600)", end=end) == [1.0, 1.0, 1.0]


def test_a_method_of_another_entry_is_not_there(contest, tmp_path):
    judged(contest, method_file(tmp_path, end="import magsim\nmagsim.left_behind = 1\n"))
    body = "import magsim\nraise RuntimeError(json.dumps(hasattr(magsim, 'left_behind')))"
    assert told(contest, tmp_path, body) is False
