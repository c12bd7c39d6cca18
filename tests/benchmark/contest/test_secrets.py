"""What a method can find out from its process: nothing of the truth, of other flights, or of what it has seen before.

A method tells what it has found by an error, which the judge shows.
"""

import json
import os
import sys
from dataclasses import replace

import numpy as np
import pytest

from magsim.benchmark.contest import Contest, Entry
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
        frame, modules = sys._getframe(), []
        while frame:
            modules.append(frame.f_globals["__name__"])
            texts += [str(value) for value in frame.f_locals.values() if isinstance(value, (str, dict))]
            frame = frame.f_back
        secret = "the_truth_of_" + "this_judge"
        raise RuntimeError(json.dumps([sorted(roles), any(secret in text for text in texts), modules[-1]]))
    """
    kept = flights()  # they hold truth, here
    assert "truth" in {name for flight in kept for name in flight.data for name in [role(name)]}
    assert told(contest, tmp_path, body) == [["input"], False, "__main__"]


def role(name):
    from magsim import columns

    return columns.role_of(name)


def test_only_what_is_required_is_sent_and_nothing_that_names_a_flight(contest, tmp_path):
    body = """
        told = [recording.name[:7], sorted(recording.meta), sorted(recording.data), recording.time_s.flags.writeable]
        raise RuntimeError(json.dumps(told))
    """
    named = [replace(one, meta={**one.meta, "seed": 3, "individual": 7, "scenario": "text"}) for one in flights()]
    name = method_file(tmp_path, body)
    found = contest.run(Entry("a", name), training(), SENSOR, [named], LIMITS, np.random.default_rng(0))
    columns = [f"flux_nose_{axis}_nt" for axis in "xyz"]
    expected = ["flight_", ["rate_hz", "start_utc"], columns, False]
    assert json.loads(found.reason.removeprefix("RuntimeError: ")) == expected


def test_truth_in_training_flights_is_not_sent(contest, tmp_path):
    learn = "raise RuntimeError(json.dumps(sorted(training.recordings[0].data)))"
    name = method_file(tmp_path, learn=learn)
    found = contest.run(Entry("a", name), flights(), SENSOR, rounds(), LIMITS, np.random.default_rng(0))
    assert "interference_cabin_nt" in found.reason
    assert "clean_" not in found.reason
    assert "earth_" not in found.reason


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
    from magsim.benchmark.contest import sandbox

    # the last one is a signal, which the sixth version of Landlock keeps back
    assert found == [0] * 14 + [0 if sandbox.level() >= 6 else found[-1]]


REMEMBERS = {
    "a global": ("SEEN.append(1)", "len(SEEN)", "SEEN = []"),
    "a module": ("sys.modules['json'].seen = 1", "hasattr(json, 'seen')", ""),
    "a class": ("type(recording).seen = 1", "hasattr(type(recording), 'seen')", ""),
    "itself": ("self.seen_ = 1", "hasattr(self, 'seen_')", ""),
    "the environment": ("os.environ['SEEN'] = '1'", "'SEEN' in os.environ", ""),
    "the folder": ("Path('seen').touch()", "Path('seen').exists()", ""),
    "the temporary folder": (
        "(Path(tempfile.gettempdir()) / 'seen').touch()",
        "(Path(tempfile.gettempdir()) / 'seen').exists()",
        "",
    ),
    "the home": ("(Path.home() / 'seen').touch()", "(Path.home() / 'seen').exists()", ""),
    "its file": ("Path(__file__).touch()", "time.time() - os.stat(__file__).st_mtime < -1", ""),
}


@pytest.mark.parametrize("how", REMEMBERS)
def test_a_second_round_knows_nothing_of_the_first(contest, tmp_path, how):
    remember, remembers, end = REMEMBERS[how]
    body = f"""
        seen = bool({remembers}) and FIRST is None
        with contextlib.suppress(OSError):
            {remember}
        return np.full(len(recording), float(seen))
    """
    # what it knows within a round is no secret: the first flight of each round counts
    once = end + "\nFIRST = None\n"
    name = method_file(tmp_path, body, end=once)
    one = [[rounds()[0][0]], [rounds()[0][0]], [rounds()[0][0]]]
    found = contest.run(Entry("a", name), training(), SENSOR, one, LIMITS, np.random.default_rng(0))
    assert (found.status, found.reason) == ("ok", "")
    assert [float(estimates[0].max()) for estimates in found.estimates] == [0.0, 0.0, 0.0]


def test_elsewhere_on_the_disk_nothing_is_remembered(sandboxed, tmp_path):
    places = [str(tmp_path / "seen"), "/tmp/magsim_seen", "/var/tmp/magsim_seen", "/dev/shm/magsim_seen"]
    body = f"""
        seen = [os.path.exists(place) for place in {places}]
        for place in {places}:
            with contextlib.suppress(OSError):
                Path(place).touch()
        return np.full(len(recording), float(any(seen)))
    """
    found = judged(sandboxed, method_file(tmp_path, body))
    assert max(float(one.max()) for estimates in found.estimates for one in estimates) == 0.0


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
    body = "seen = found(47391)\nleave(47391)\ntime.sleep(0.2)\nreturn np.full(len(recording), float(seen))"
    one = [[rounds()[0][0]]] * 3
    name = method_file(tmp_path, body, end=LEAVES)
    found = contest.run(Entry("a", name), training(), SENSOR, one, LIMITS, np.random.default_rng(0))
    assert (found.status, found.reason) == ("ok", "")
    assert [float(estimates[0].max()) for estimates in found.estimates] == [0.0, 0.0, 0.0]
    left = os.popen(f"ps -eo args | grep -c '[c]ontest.server {contest_number(contest)}'").read()
    assert int(left) == 1


def contest_number(contest):
    return contest._server_for("tl16")._program.args[3]


@LINUX
def test_shared_memory_is_not_shared(sandboxed, tmp_path):
    body = """
        import ctypes
        libc = ctypes.CDLL(None, use_errno=True)
        seen = libc.shmget(47391, 4096, 0o600) >= 0
        libc.shmget(47391, 4096, 0o1600)
        return np.full(len(recording), float(seen))
    """
    one = [[rounds()[0][0]]] * 3
    name = method_file(tmp_path, body)
    found = sandboxed.run(Entry("a", name), training(), SENSOR, one, LIMITS, np.random.default_rng(0))
    assert [float(estimates[0].max()) for estimates in found.estimates] == [0.0, 0.0, 0.0]


def test_a_method_of_another_entry_is_not_there(contest, tmp_path):
    judged(contest, method_file(tmp_path, end="import magsim\nmagsim.left_behind = 1\n"))
    body = "import magsim\nraise RuntimeError(json.dumps(hasattr(magsim, 'left_behind')))"
    assert told(contest, tmp_path, body) is False
