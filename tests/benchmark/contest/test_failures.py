"""Methods that fail: each loses its own row, with one line that says why, and the next one is unharmed."""

import os
import signal
from dataclasses import replace

import numpy as np
import pytest

from magsim.benchmark.contest import Allowance, Contest, Contestant
from magsim.benchmark.contest import contest as judge
from magsim.errors import RequestError
from tests.benchmark.contest.cases import LIMITS, SENSOR, flights, judged, method_file, rounds, training

ZEROS = "return np.zeros(len(recording))"
CRASHES = {
    "exit": ("os._exit(3)", "ended without an answer"),
    "system exit": ("sys.exit(0)", "ended without an answer"),
    "segmentation fault": ("import ctypes; ctypes.string_at(0)", "ended without an answer"),
    "kills itself": ("os.kill(os.getpid(), 9)", "ended without an answer"),
    "closes all": ("os.closerange(0, 100)", "ended without an answer"),
    "error": ("raise ValueError('no\\nidea ' * 1000)", "ValueError: no idea no idea"),
    "recursion": ("f = lambda: f()\nf()", "RecursionError"),
    "error without words": (
        "class Mute(Exception):\n    def __str__(self): os._exit(1)\nraise Mute",
        "without an answer",
    ),
    "too much at once": ("np.empty(2**48)", "MemoryError"),
    "too much": ("kept = [np.ones(2**22) for _ in range(10_000)]", "MemoryError"),
}


@pytest.mark.parametrize("where", ["learn", "estimate"])
@pytest.mark.parametrize("how", CRASHES)
def test_a_crash_loses_a_row(contest, tmp_path, how, where):
    body, reason = CRASHES[how]
    name = method_file(tmp_path, learn=body) if where == "learn" else method_file(tmp_path, body)
    found = judged(contest, name, limits=replace(LIMITS, memory_mb=1000.0))
    assert found.status == "crashed"
    assert reason in found.reason
    assert len(found.reason) <= 300
    assert found.reason.isprintable()
    assert found.estimates == ()


@pytest.mark.parametrize("where", ["import", "learn", "estimate"])
@pytest.mark.parametrize(
    "body", ["while True: pass", "import signal; signal.pthread_sigmask(0, range(1, 64)); time.sleep(1e6)"]
)
def test_an_endless_method_is_ended(contest, tmp_path, body, where):
    parts = {"import": {"end": f"\n{body}"}, "learn": {"learn": body}, "estimate": {"estimate": body}}[where]
    found = judged(contest, method_file(tmp_path, **parts), limits=Allowance(fit_s=1.0, estimate_s=1.0))
    assert (found.status, "1 s" in found.reason) == ("timed_out", True)


@pytest.mark.parametrize("value", ["np.nan", "np.inf", "-1e30"])
def test_what_is_no_number_loses_a_row(contest, tmp_path, value):
    found = judged(contest, method_file(tmp_path, f"out = np.zeros(len(recording)); out[1500] = {value}; return out"))
    assert (found.status, "not finite" in found.reason) == ("not_finite", True)


def test_a_warm_up_may_have_no_estimate_and_may_not_be_long(contest, tmp_path):
    late = "return np.where(recording.time_s - recording.time_s[0] < {s} - 0.01, np.nan, 7.0)"
    found = judged(contest, method_file(tmp_path, late.format(s=30.0), warmup="30.0"))
    assert found.status == "ok"
    for estimates in found.estimates:
        for one in estimates:
            np.testing.assert_array_equal(one, np.where(np.arange(len(one)) < 300, 0.0, 7.0))
    assert judged(contest, method_file(tmp_path, late.format(s=30.1), warmup="30.0")).status == "not_finite"
    for declared in ("60.1", "float('nan')", "-1.0"):
        found = judged(contest, method_file(tmp_path, warmup=declared))
        assert (found.status, "0 to 60 s" in found.reason) == ("warmup", True)


@pytest.mark.parametrize("body", ["return np.zeros(1)", "return np.zeros((len(recording), 2))", "return 0.0"])
def test_another_shape_loses_a_row(contest, tmp_path, body):
    found = judged(contest, method_file(tmp_path, body))
    assert (found.status, "returned shape" in found.reason) == ("failed", True)
    # one that goes round the check of the package
    direct = f"\nMethod.interference = lambda self, recording: {body.removeprefix('return ')}"
    assert judged(contest, method_file(tmp_path, end=direct)).status in ("bad_shape", "crashed")


def test_a_missing_label_and_a_missing_column_are_named(contest):
    unlabeled = [flight.blind() for flight in training()]
    found = contest.run(Contestant("a", "exact_norm"), unlabeled, SENSOR, rounds(), LIMITS, np.random.default_rng(0))
    assert (found.status, "interference" in found.reason) == ("needs", True)
    bare = [replace(flight, data={k: v for k, v in flight.data.items() if k[:4] != "flux"}) for flight in training()]
    found = contest.run(Contestant("a", "tl16"), bare, SENSOR, rounds(), LIMITS, np.random.default_rng(0))
    assert (found.status, "flux_" in found.reason) == ("needs", True)


def test_too_little_data_are_a_failure_of_the_method(contest):
    short = [flight.take(slice(0, 40)) for flight in training()]
    found = contest.run(Contestant("a", "tl16"), short, SENSOR, rounds(), LIMITS, np.random.default_rng(0))
    assert found.status == "failed"
    assert found.reason


def test_an_unknown_name_is_a_mistake_of_the_request(contest):
    with pytest.raises(RequestError, match="unknown method 'tl61'"):
        judged(contest, "tl61")
    found = judged(contest, "tl16:nonsense=3")
    assert (found.status, "nonsense" in found.reason) == ("needs", True)
    assert judged(contest, "/there/is/none.py:Method").status == "needs"


def test_what_a_method_prints_goes_nowhere(contest, tmp_path, capfd):
    body = "for _ in range(200): print('x' * 10**6)\nos.write(2, b'y' * 10**6)\n"
    assert judged(contest, method_file(tmp_path, body + ZEROS)).status == "ok"
    assert capfd.readouterr() == ("", "")


def test_a_state_beyond_measure_is_refused(contest, tmp_path, monkeypatch):
    monkeypatch.setattr(judge, "MAX_STATE", 100_000)
    assert judged(contest, method_file(tmp_path, learn="self.found_ = np.ones(10_000)")).status == "ok"
    found = judged(contest, method_file(tmp_path, learn="self.found_ = np.ones(20_000)"))
    assert (found.status, "allowed" in found.reason) == ("crashed", True)


FORGED = """
from magsim.benchmark.contest import wire

def line():
    return next(one for one in gc.get_objects() if isinstance(one, socket.socket) and one.fileno() >= 0)

def answer(**changed):
    good = dict(status="ok", requires=[], adapts=False, lookahead_rows=1, warmup_s=0.0, parameters=0, files=[])
    good["sensor"] = "cabin"
    wire.send(line(), good | changed, [b"x"] * len(changed.get("files", [])))
    time.sleep(60.0)
"""


@pytest.mark.parametrize("name", ["../../etc/outside", "/tmp/outside", "compensator.json/..", ".", "", "other.json"])
def test_files_of_other_names_are_refused(contest, tmp_path, name):
    found = judged(contest, method_file(tmp_path, learn=f"answer(files=[{name!r}])", end=FORGED))
    assert (found.status, "files" in found.reason) == ("crashed", True)


@pytest.mark.parametrize(
    "body",
    [
        "answer(requires=['truth_{sensor}_nt'])",
        "answer(requires=7)",
        "answer(warmup_s='long')",
        "answer(parameters=10**400)",
        "answer(files=['arrays.npz', 'arrays.npz'])",
        "answer(status=['ok'])",
        "line().sendall(b'rubbish' * 1000); time.sleep(60.0)",
        "line().sendall(wire.HEADER.pack(2**40, 0)); time.sleep(60.0)",
        "line().sendall(wire.HEADER.pack(2, 2**40) + b'{}'); time.sleep(60.0)",
        "line().sendall(wire.HEADER.pack(2, 0) + b'[]'); time.sleep(60.0)",
        "wire.send(line(), {'status': 'ok'}); time.sleep(60.0)",
    ],
)
def test_a_forged_answer_loses_a_row(contest, tmp_path, body):
    assert judged(contest, method_file(tmp_path, learn=body, end=FORGED)).status == "crashed"


def test_an_answer_that_stops_in_the_middle_is_not_waited_for(contest, tmp_path):
    body = "line().sendall(wire.HEADER.pack(100, 0) + b'{'); time.sleep(60.0)"
    limits = Allowance(fit_s=1.0, estimate_s=1.0)
    assert judged(contest, method_file(tmp_path, learn=body, end=FORGED), limits=limits).status == "timed_out"


def test_one_that_reads_nothing_is_not_waited_for(contest, tmp_path):
    limits = Allowance(fit_s=1.5, estimate_s=1.5)
    name = method_file(tmp_path, end="import signal\nos.kill(os.getpid(), signal.SIGSTOP)")
    assert judged(contest, name, limits=limits).status == "timed_out"


def test_the_next_method_is_unharmed(contest, tmp_path):
    with Contest() as fresh:
        alone = judged(fresh, "tl16")
    # the second one loses its server, where the kernel does not keep it from that
    for body in ("os._exit(1)", "os.kill(os.getppid(), 9); time.sleep(60.0)"):
        found = judged(contest, method_file(tmp_path, body), limits=Allowance(fit_s=2.0, estimate_s=2.0))
        assert found.status in ("crashed", "timed_out")
        found = judged(contest, "tl16")
        assert found.status == "ok"
        np.testing.assert_equal(found.estimates, alone.estimates)
    assert [len(one) for one in found.estimates[0]] == [len(flight) for flight in flights()]


def test_a_server_that_has_ended_is_started_again(contest):
    server = contest._server_for("tl16")
    os.kill(server.pid, signal.SIGKILL)
    server._program.wait()
    assert judged(contest, "tl16").status == "ok"
