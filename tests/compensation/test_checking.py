"""The checks of a method: all of this package pass, and each bad one fails where it is bad."""

import ctypes
import inspect
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import magsim
from magsim.cli import cli
from magsim.compensation import Compensator, create, names, registry
from magsim.compensation.checking import check_flight
from magsim.compensation.checking.signal import anomaly
from magsim.compensation.networks import NetworkCompensator
from magsim.errors import DataError, RequestError
from magsim.signals import high_pass
from tests.compensation.test_contract import METHODS

FLUX, MAG = "flux_{sensor}_{axis}_nt", "mag_{sensor}_nt"
CHEAP = {"steps": 2, "every": 2, "folds": 0, "band_weight": 0.0}
"""What a training of any method may be cut to: what is checked does not depend on how well it has learned."""

KNOWN = {"tl16_recursive": {"anomalies"}}
"""What is known to fail, and told in docs/plugins.md: a test that begins to pass says so."""


@pytest.mark.parametrize("name", names())
def test_every_method_of_the_package_passes(name):
    method = create(name)
    settings = {**METHODS[name], **CHEAP} if isinstance(method, NetworkCompensator) else {}
    report = magsim.check_compensator(method.set_params(**settings))
    assert {check.name for check in report.failures} == KNOWN.get(name, set()), str(report)


def test_the_flight_has_every_family_of_inputs_and_is_exact():
    r = check_flight()
    made = ("carrier", "compensated", "removed")  # of a tow, and by a method
    inputs = {f for f in magsim.columns.FAMILIES if f.role == "input" and not f.pattern.startswith(made)}
    assert {magsim.columns.family_of(n) for n in r.names("input")} == inputs
    for sensor in r.scalars:
        noise = r[f"mag_{sensor}_nt"] - r[f"clean_{sensor}_nt"] - r[f"interference_{sensor}_nt"]
        assert 0.009 < noise.std() < 0.011
    assert r != check_flight(1)
    # Tolles-Lawson has something to find, and leaves what it should: second order, strobe, elevator
    test = r.where(split="test")
    left = test["interference_cabin_nt"] - create("tl16", band="broad").fit(r).interference(test)
    assert 50.0 < test["interference_cabin_nt"].std() / left.std() < 5000.0


class Base(Compensator):
    """A decent method: a mean, and the fluxgate's length."""

    name = "decent"
    requires = (FLUX,)

    def learn(self, training, context):
        self.mean_ = float(np.mean(np.concatenate([r["interference_cabin_nt"] for r in training.recordings])))

    def estimate(self, recording):
        return self.mean_ + 1e-3 * recording["flux_flux_x_nt"]


class ShiftsParameters(Base):
    def __init__(self, *, gain: float = 1.0) -> None:
        self.gain = gain

    def learn(self, training, context):
        super().learn(training, context)
        self.gain += 1.0


class Writes(Base):
    """Goes behind the read-only flag of an array."""

    def estimate(self, recording):
        values = recording["flux_flux_x_nt"]
        ctypes.memset(values.ctypes.data, 0, 8)
        return np.full(len(recording), self.mean_)


class Peeks(Base):
    """Finds the labels in the frame that calls it."""

    def estimate(self, recording):
        whole = inspect.currentframe().f_back.f_back.f_locals["recording"]
        name = "interference_cabin_nt"
        return whole[name] if name in whole else np.full(len(recording), self.mean_)


class Memorizes(Base):
    """Keeps labels by their time tags."""

    def learn(self, training, context):
        super().learn(training, context)
        (r,) = training.recordings
        self.times_, self.labels_ = r.time_s.copy(), r["interference_cabin_nt"].copy()

    def estimate(self, recording):
        known = np.interp(recording.time_s, self.times_, self.labels_, right=self.mean_)
        return known + 1e-9 * recording["flux_flux_x_nt"]


class LooksAhead(Base):
    lookahead_rows = 1

    def estimate(self, recording):
        flux = recording["flux_flux_x_nt"]
        return self.mean_ + np.convolve(flux, np.ones(21) / 21.0, mode="same")


class LowPass(Base):
    """What is smooth is clean: destroys every anomaly."""

    requires = (MAG,)
    lookahead_rows = None

    def estimate(self, recording):
        return high_pass(recording["mag_cabin_nt"], recording.rate_hz)


class Seedless(Base):
    def learn(self, training, context):
        self.mean_ = float(np.random.default_rng().normal())


class Restless(Base):
    def estimate(self, recording):
        return super().estimate(recording) + np.random.default_rng().normal(size=len(recording))


class Remembers(Base):
    """Counts the rows that it has seen."""

    def learn(self, training, context):
        super().learn(training, context)
        self.seen_ = 0

    def estimate(self, recording):
        self.seen_ += len(recording)
        return super().estimate(recording) + 1e-3 * self.seen_


class Forgets(Base):
    """Saves less than it needs."""

    def learn(self, training, context):
        super().learn(training, context)
        self._slope = 1e-3 + 1e-9 * self.mean_

    def estimate(self, recording):
        return self.mean_ + getattr(self, "_slope", 0.0) * recording["flux_flux_x_nt"]


class Borrows(Base):
    """Takes the reading, which it does not declare, from the frame that calls it."""

    def estimate(self, recording):
        whole = inspect.currentframe().f_back.f_back.f_locals["recording"]
        return self.mean_ + 1e-3 * whole["mag_cabin_nt"]


class Reaches(Base):
    """A running sum that does not stop at gaps."""

    lookahead_rows = 0

    def estimate(self, recording):
        return self.mean_ + 1e-6 * np.cumsum(recording["flux_flux_x_nt"])


class LearnsDropouts(Base):
    def learn(self, training, context):
        self.mean_ = float(np.mean([r["mag_cabin_nt"].mean() for r in training.recordings]))


class Warms(Base):
    """NaN for longer than declared."""

    warmup_s = 2.0

    def estimate(self, recording):
        late = recording.time_s - recording.time_s[0] >= 3.0
        return np.where(late, super().estimate(recording), np.nan)


class Takes(Base):
    """Takes a tenth of the reading for interference."""

    requires = (MAG,)

    def estimate(self, recording):
        return 0.1 * (recording["mag_cabin_nt"] - 50_000.0)


class Stumbles(Base):
    def estimate(self, recording):
        raise ZeroDivisionError("no rows")


BAD = {
    ShiftsParameters: "mutation",
    Writes: "mutation",
    Peeks: "labels",
    Memorizes: "clock",
    LooksAhead: "causality",
    LowPass: "anomalies",
    Seedless: "determinism",
    Restless: "statelessness",
    Remembers: "statelessness",
    Forgets: "round trip",
    Borrows: "declared inputs",
    Reaches: "gaps",
    LearnsDropouts: "dropouts",
    Warms: "shape",
    Takes: "offset",
    Stumbles: "shape",
}


def test_a_decent_method_passes():
    report = magsim.check_compensator(Base())
    assert report.passed, str(report)
    assert report["stream"].outcome == "skipped"


@pytest.mark.parametrize("cls", BAD)
def test_a_bad_method_fails_where_it_is_bad(cls):
    check_flight.cache_clear()  # one of them writes into its recording
    report = magsim.check_compensator(cls())
    assert report[BAD[cls]].outcome == "failed", str(report)
    with pytest.raises(DataError, match=f"method decent: .*{BAD[cls]}"):
        report.raise_for_failures()
    check_flight.cache_clear()


def test_what_a_failure_says():
    low = magsim.check_compensator(LowPass())
    assert "anomalies of random shape come through by" in low["anomalies"].text
    assert "allowed: 0.95 to 1.05" in low["anomalies"].text
    assert low["causality"].outcome == "skipped"
    warm = magsim.check_compensator(Warms())["shape"].text
    assert "beyond the warm-up of 2 s" in warm
    assert magsim.check_compensator(Stumbles())["shape"].text == "it raised ZeroDivisionError: no rows"


def test_a_method_that_cannot_learn_has_one_failure():
    report = magsim.check_compensator("tl16:fluxgate=nose")
    assert [check.name for check in report.checks] == ["fit"]
    assert "has no fluxgate 'nose'" in report["fit"].text
    with pytest.raises(RequestError, match="a int cannot be checked; allowed: a Compensator, or the name of a method"):
        magsim.check_compensator(3)


def test_anomalies_differ_and_are_of_all_widths():
    time_s = np.arange(3000) / 10.0
    drawn = [anomaly(time_s, np.random.default_rng(seed)) for seed in range(4)]
    for values in drawn:
        assert np.ptp(values) > 5.0
    assert np.abs(np.corrcoef(drawn) - np.eye(4)).max() < 0.95


def test_own_recordings_and_the_command_line(tmp_path, monkeypatch):
    monkeypatch.setattr(registry, "_REGISTRY", dict(registry._REGISTRY))
    flight = check_flight(5)
    flight.write(tmp_path / "flight.h5")
    report = magsim.check_compensator("tl16", data=tmp_path / "flight.h5", sensor="stinger")
    assert report.passed, str(report)
    bare = replace(flight, data={n: v for n, v in flight.data.items() if n != "split"})
    assert magsim.check_compensator("none", data=bare).passed
    run = CliRunner().invoke(cli, ["check", "tl16"])
    assert run.exit_code == 0
    assert "tl16: 17 checks, 0 failed" in run.output
    file = tmp_path / "mine.py"
    file.write_text(
        "from magsim import Compensator\n"
        "class Mine(Compensator):\n"
        "    requires = ('mag_{sensor}_nt',)\n"
        "    def learn(self, training, context): pass\n"
        "    def estimate(self, recording): return 0.5 * recording['mag_cabin_nt']\n"
    )
    run = CliRunner().invoke(cli, ["check", f"{file}:Mine", str(tmp_path / "flight.h5")])
    assert run.exit_code == 3
    assert "failed   offset" in run.output
