"""All checks of a method, one after the other."""

from collections.abc import Callable

import numpy as np

from magsim import columns
from magsim.compensation.base import Compensator
from magsim.compensation.checking import inputs, manners, signal
from magsim.compensation.checking.case import Case, Failure, Skip
from magsim.compensation.checking.flight import check_flight
from magsim.compensation.checking.report import Check, CheckReport
from magsim.compensation.registry import make
from magsim.dataset import Data, flights_of
from magsim.dataset.rows import pick_sensor
from magsim.errors import RequestError
from magsim.recording import Recording

CHECKS: dict[str, Callable[[Case], str]] = {
    "parameters": manners.parameters,
    "shape": inputs.shape,
    "determinism": manners.determinism,
    "mutation": manners.mutation,
    "statelessness": manners.statelessness,
    "declared inputs": inputs.declared_inputs,
    "labels": inputs.labels,
    "clock": inputs.clock,
    "causality": inputs.causality,
    "gaps": inputs.gaps,
    "dropouts": inputs.dropouts,
    "offset": signal.offset,
    "anomalies": signal.anomalies,
    "stream": manners.stream,
    "round trip": manners.round_trip,
    "threads": manners.threads,
}
"""Checks by name: each returns what it saw, or raises ``Failure`` or ``Skip``."""


def check_compensator(
    method: Compensator | str, *, data: Data | None = None, sensor: str | None = None, seed: int = 0
) -> CheckReport:
    """Check that a method keeps what a compensator promises.

    Parameters
    ----------
    method : Compensator or str
        Of an object the parameters count, fitted or not; or a name with settings, as ``create`` and the command line
        take it.
    data : Recording, Dataset, Path, str, or several of them, optional
        With labels; a small flight that is built in by default. What has the split ``test`` is estimated, all of the
        first recording where nothing has.
    sensor : str, optional
        The scalar magnetometer; the first one by default.
    seed : int
        Of fits and of all that is drawn.

    Returns
    -------
    CheckReport
        Whatever a method does: nothing that it raises comes through. ``raise_for_failures`` raises.

    Raises
    ------
    RequestError
        If there is no such method, or the data cannot be read.
    """
    checked = make(method) if isinstance(method, str) else method
    if not isinstance(checked, Compensator):
        msg = f"a {type(method).__name__} cannot be checked; allowed: a Compensator, or the name of a method"
        raise RequestError(msg)
    flights = (check_flight(),) if data is None else tuple(info.read() for info in flights_of(data))
    if not flights:
        msg = "nothing to check a method on: no recording was given"
        raise RequestError(msg)
    case = Case(checked, flights, _probe(flights), pick_sensor(flights, sensor), seed)
    checks = []
    try:
        _ = case.fitted
    except Exception as error:
        checks.append(Check("fit", "failed", _told(error)))
    else:
        checks.append(Check("fit", "passed", f"learned from {', '.join(repr(r.name) for r in flights)}"))
        checks += [_run(name, check, case) for name, check in CHECKS.items()]
    return CheckReport(checked.name or type(checked).__name__, tuple(checks))


def _probe(flights: tuple[Recording, ...]) -> Recording:
    """Return the rows to estimate, without a gap."""
    for recording in flights:
        if columns.SPLIT.pattern in recording and np.count_nonzero(recording.mask(split="test")) >= 2:
            recording = recording.where(split="test")  # noqa: PLW2901 - its part
            return max(recording.pieces(), key=len)
    return max(flights[0].pieces(), key=len)


def _run(name: str, check: Callable[[Case], str], case: Case) -> Check:
    try:
        return Check(name, "passed", check(case))
    except Skip as reason:
        return Check(name, "skipped", str(reason))
    except Failure as seen:
        return Check(name, "failed", str(seen))
    except Exception as error:
        return Check(name, "failed", _told(error))


def _told(error: Exception) -> str:
    return f"it raised {type(error).__name__}: {error}"
