"""What the judge believes of an answer: nothing that it has not checked."""

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from magsim import columns
from magsim.benchmark.contest import wire
from magsim.benchmark.contest.outcome import Costs, LostError, Status
from magsim.benchmark.judging import LONGEST_WARMUP_S
from magsim.compensation import saving
from magsim.recording import Recording
from magsim.signals import spans

LARGEST_NT = 1e9
"""An estimate beyond it is none: its square would spoil the tables of all."""

LONGEST_REASON = 300

KNOWN: dict[str, Status] = {"needs": "needs", "failed": "failed"}
"""Reasons that a method may give itself."""


@dataclass(frozen=True)
class Learned:
    """What a fit has left: files by their names, and what the method declares."""

    names: tuple[str, ...]
    files: tuple[memoryview, ...]
    requires: tuple[str, ...]
    adapts: bool
    lookahead_rows: int | None
    warmup_s: float
    costs: Costs


@contextlib.contextmanager
def answering(allowed_s: float) -> Iterator[float]:
    """Give the time until which an answer may come; turn what goes wrong before it is there into a lost row."""
    until = time.monotonic() + allowed_s
    late = f"no answer within the {allowed_s:g} s that it is allowed"
    try:
        yield until
    except TimeoutError:
        raise LostError(late, "timed_out") from None
    except (EOFError, ConnectionError):
        msg = "its process ended without an answer"
        raise LostError(msg, "crashed") from None
    except wire.WireError as error:
        raise LostError(str(error), "crashed") from None


def checked(header: wire.Header, wanted: str) -> None:
    """Refuse an answer that has not the wanted status.

    Raises
    ------
    LostError
        With the method's own reason, in one line.
    """
    status = header.get("status")
    if status == wanted:
        return
    plain = "".join(c if c.isprintable() else " " for c in str(header.get("reason", ""))[:LONGEST_REASON])
    raise LostError(plain or "no reason given", KNOWN.get(str(status), "crashed"))


def declared(answer: wire.Message, sensor: str, costs: Costs) -> Learned:
    """Return what a fit has left.

    Raises
    ------
    LostError
        If it is not that of a method, is for another magnetometer, or declares too long a warm-up.
    """
    header, files = answer
    try:
        names, requires = (tuple(map(str, header[key])) for key in ("files", "requires"))
        lookahead_rows = None if header["lookahead_rows"] is None else int(header["lookahead_rows"])
        warmup_s, parameters = float(header["warmup_s"]), float(header["parameters"])
        adapts, fitted_for = bool(header["adapts"]), str(header["sensor"])
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        msg = f"its answer is not that of a fitted method: {type(error).__name__}"
        raise LostError(msg, "crashed") from None
    if len(names) != len(files) or len(set(names)) != len(names) or not set(names) <= set(saving.FILES):
        msg = f"its files are not those of a fitted method: {', '.join(saving.FILES)}"
        raise LostError(msg, "crashed")
    if not set(requires) <= {family.pattern for family in columns.FAMILIES}:
        msg = "it requires a column that is not known"
        raise LostError(msg, "crashed")
    if fitted_for != sensor:
        msg = f"it was trained for another magnetometer than {sensor!r}"
        raise LostError(msg, "needs")
    if not 0.0 <= warmup_s <= LONGEST_WARMUP_S:
        msg = f"it declares a warm-up of {warmup_s:g} s; allowed: 0 to {LONGEST_WARMUP_S:g} s"
        raise LostError(msg, "warmup")
    costs = replace(costs, state_bytes=float(sum(map(len, files))), parameters=parameters)
    return Learned(names, files, requires, adapts, lookahead_rows, warmup_s, costs)


def believed(answer: wire.Message, number: int, flight: Recording, warmup_s: float) -> np.ndarray:
    """Return an estimate of an answer, (n,) [nT]; 0 in the declared warm-up of each piece where it has none.

    Raises
    ------
    LostError
        If it has another length, or is not finite elsewhere.
    """
    try:
        estimate = np.array(answer.numbers(number))
    except wire.WireError as error:
        raise LostError(str(error), "bad_shape") from None
    if len(estimate) != len(flight):
        msg = f"{len(estimate)} numbers for a flight of {len(flight)} rows"
        raise LostError(msg, "bad_shape")
    finite = np.abs(estimate) < LARGEST_NT  # not a NaN
    for span in spans(flight.time_s):
        seconds = flight.time_s[span] - flight.time_s[span.start]
        if not finite[span][seconds >= warmup_s - 1e-9].all():
            msg = f"its estimate is not finite, or beyond {LARGEST_NT:g} nT, after its warm-up"
            raise LostError(msg, "not_finite")
    estimate[~finite] = 0.0
    return estimate
