"""Honest methods in processes of their own: the estimates that they would have had here, and what they cost."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from magsim.benchmark.contest import Contest, Contestant
from magsim.compensation import create
from magsim.dataset import training_rows
from magsim.signals import in_band
from magsim.threads import one_blas_thread
from tests.benchmark.contest.cases import LIMITS, SENSOR, flights, judged, method_file, rounds, training


class Unmoved:
    """Draws that change neither clocks, dates, nor order."""

    def integers(self, low, high=None):
        return 0

    def permutation(self, count):
        return np.arange(count)


def estimates_here(name):
    with one_blas_thread():
        method = create(name).fit_rows(training_rows(training(), SENSOR))
        return [method.interference(flight) for flight in flights()]


@pytest.mark.parametrize("name", ["tl16", "tl16_recursive", "exact_norm"])
def test_estimates_are_those_of_the_method_in_one_process(contest, name):
    found = contest.run(Contestant(name, name), training(), SENSOR, rounds(), LIMITS, Unmoved())
    assert (found.status, found.reason) == ("ok", "")
    expected = estimates_here(name)
    for estimates in found.estimates:
        assert len(estimates) == len(expected)
        for one, other in zip(estimates, expected, strict=True):
            np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(("name", "nt"), [("tl16", 1e-7), ("exact_norm", 1e-4)])
def test_another_clock_and_date_cost_an_honest_method_nothing(contest, name, nt):
    found = judged(contest, name)
    for flight, one, other in zip(flights(), found.estimates[0], estimates_here(name), strict=True):
        assert in_band(one - other, flight.time_s).std() < nt


def test_the_same_seed_gives_the_same_bytes_and_another_seed_another_clock(contest, tmp_path):
    name = method_file(tmp_path, "return np.full(len(recording), recording.time_s[0])")
    first, again, other = (judged(contest, name, seed=seed).estimates for seed in (1, 1, 2))
    np.testing.assert_equal(first, again)
    assert first[0][0][0] != other[0][0][0]
    with Contest() as fresh:
        np.testing.assert_equal(judged(fresh, "exact_norm").estimates, judged(contest, "exact_norm").estimates)


def test_the_hour_of_a_row_stays_and_the_date_moves_by_ten_days_at_most(contest, tmp_path):
    name = method_file(
        tmp_path,
        """
        from datetime import datetime
        start = datetime.fromisoformat(recording.meta["start_utc"]).timestamp()
        return start + recording.time_s - 1.7418e9
        """,
    )
    found = judged(contest, name)
    begins = 1_741_824_000.0 - 1.7418e9  # 2025-03-13T00:00 UTC
    for estimates in found.estimates:
        for one, flight in zip(estimates, flights(), strict=True):
            days = (one - begins - flight.time_s) / 86400.0
            np.testing.assert_allclose(days, np.round(days[0]), rtol=0.0, atol=1e-9)
            assert abs(days[0]) <= 10.0


def test_estimates_come_back_in_the_order_of_the_request(contest, tmp_path):
    name = method_file(tmp_path, "return recording['flux_nose_x_nt']")
    for seed in range(4):  # some draw turns the order round
        found = judged(contest, name, seed=seed)
        for estimates in found.estimates:
            for one, flight in zip(estimates, flights(), strict=True):
                np.testing.assert_array_equal(one, flight["flux_nose_x_nt"])


def test_costs_are_read_by_the_judge(contest, tmp_path):
    burn = "until = time.process_time() + {s}\nwhile time.process_time() < until: pass\n"
    estimate = burn.format(s=0.1) + "return np.zeros(len(recording))"
    costs = judged(contest, method_file(tmp_path, estimate, learn=burn.format(s=0.3) + "time.sleep(0.3)")).costs
    assert 0.3 <= costs.fit_cpu_s < 0.5
    assert costs.fit_wall_s >= 0.6
    assert 0.1 <= costs.estimate_us * 1e-6 * sum(map(len, flights())) / len(flights()) < 0.2
    assert costs.parameters == 0


def test_size_of_what_was_learned(contest, tmp_path):
    costs = judged(contest, method_file(tmp_path, learn="self.found_ = np.ones(1_000_000)")).costs
    assert costs.parameters == 1_000_000
    assert costs.state_bytes == pytest.approx(8e6, rel=0.01)
    assert costs.peak_mb > 8.0


def test_what_a_method_declares_is_told(contest):
    found = judged(contest, "exact_norm_adaptive")
    method = create("exact_norm_adaptive").fit_rows(training_rows(training(), SENSOR))
    assert (found.status, found.adapts) == ("ok", True)
    assert (found.requires, found.lookahead_rows) == (tuple(method.requires), method.lookahead_rows)
    assert not found.pretrained


def test_a_trained_run_comes_fitted_and_says_what_it_has_learned(contest, tmp_path):
    method = create("tl16").fit_rows(training_rows(training(), SENSOR))
    method.save(tmp_path)
    digests = [hashlib.sha256(bytes([k])).hexdigest() for k in range(2)]
    (tmp_path / "run.json").write_text(json.dumps({"rows": [{"sha256": one} for one in digests]}), encoding="utf-8")
    found = contest.run(Contestant("run", str(tmp_path)), (), SENSOR, rounds(), LIMITS, Unmoved())
    assert (found.status, found.pretrained, found.learned) == ("ok", True, tuple(digests))
    np.testing.assert_allclose(found.estimates[1][0], method.interference(flights()[0]), rtol=0.0, atol=1e-9)
    other = contest.run(Contestant("run", str(tmp_path)), (), "stinger", rounds(), LIMITS, Unmoved())
    assert (other.status, "magnetometer" in other.reason) == ("needs", True)


def test_networks_have_a_server_of_their_own(contest):
    pytest.importorskip("torch")
    found = contest.run(Contestant("bp", "bp", quick=True), training(), SENSOR, rounds(), LIMITS, Unmoved())
    assert (found.status, found.reason) == ("ok", "")


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


JUDGE = """
import sys, time
from magsim.benchmark.contest import Contest
from tests.benchmark.contest.cases import judged
contest = Contest()
server = contest._server_for("tl16")
with server.process() as process:
    print(server.pid, process.pid, process.folder, flush=True)
    time.sleep(600.0)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="asks /proc")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_nothing_is_left_of_a_judge_that_was_killed(how):
    judge = subprocess.Popen(
        [sys.executable, "-c", JUDGE], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    server, child, folder = judge.stdout.readline().split()
    assert is_running(server)
    assert is_running(child)
    assert Path(folder).is_dir()
    os.kill(judge.pid, how)
    judge.wait()
    judge.stdout.close()
    until = time.monotonic() + 20.0
    while time.monotonic() < until and (is_running(server) or is_running(child) or Path(folder).parent.exists()):
        time.sleep(0.02)
    assert not is_running(server)
    assert not is_running(child)
    assert not Path(folder).parent.exists()


def test_a_closed_contest_leaves_neither_processes_nor_folders(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    contest = Contest()
    judged(contest, "tl16")
    pids = [server.pid for server in contest._servers.values()]
    assert len(list(tmp_path.iterdir())) == len(pids) == 1
    contest.close()
    assert not any(map(is_running, pids))
    assert list(tmp_path.iterdir()) == []
