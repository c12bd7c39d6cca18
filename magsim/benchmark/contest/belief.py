"""What the judge believes of an answer: nothing that it has not checked."""

import contextlib
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from magsim import columns
from magsim.benchmark.contest import wire
from magsim.benchmark.contest.outcome import Costs, LostError, Status
from magsim.compensation import saving
from magsim.recording import Recording
from magsim.signals import spans

LONGEST_WARMUP_S = 60.0

LARGEST_NT = 1e9
"""An estimate beyond it is none: its square would spoil the tables of all."""

LONGEST_REASON = 300

KNOWN: dict[object, Status] = {"needs": "needs", "failed": "failed"}
"""Reasons that a method may give itself."""


@dataclass(frozen=True)
class Fitted:
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
        msg = "timed_out"
        raise LostError(msg, late) from None
    except (EOFError, ConnectionError):
        msg = "its process ended without an answer"
        msg_0 = "crashed"
        raise LostError(msg_0, msg) from None
    except wire.WireError as error:
        msg_0 = "crashed"
        raise LostError(msg_0, str(error)) from None


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
    raise LostError(KNOWN.get(status, "crashed") if isinstance(status, str) else "crashed", plain or "no reason given")


def declared(answer: wire.Message, sensor: str, costs: Costs) -> Fitted:
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
        msg_0 = "crashed"
        raise LostError(msg_0, msg) from None
    if len(names) != len(files) or len(set(names)) != len(names) or not set(names) <= set(saving.FILES):
        msg = f"its files are not those of a fitted method: {', '.join(saving.FILES)}"
        msg_0 = "crashed"
        raise LostError(msg_0, msg)
    if not set(requires) <= {family.pattern for family in columns.FAMILIES}:
        msg = "it requires a column that is not known"
        msg_0 = "crashed"
        raise LostError(msg_0, msg)
    if fitted_for != sensor:
        msg = f"it was trained for another magnetometer than {sensor!r}"
        msg_0 = "needs"
        raise LostError(msg_0, msg)
    if not 0.0 <= warmup_s <= LONGEST_WARMUP_S:
        msg = f"it declares a warm-up of {warmup_s:g} s; allowed: 0 to {LONGEST_WARMUP_S:g} s"
        msg_0 = "warmup"
        raise LostError(msg_0, msg)
    costs = replace(costs, state_bytes=float(sum(map(len, files))), parameters=parameters)
    return Fitted(names, files, requires, adapts, lookahead_rows, warmup_s, costs)


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
        msg = "bad_shape"
        raise LostError(msg, str(error)) from None
    if len(estimate) != len(flight):
        msg = f"{len(estimate)} numbers for a flight of {len(flight)} rows"
        msg_0 = "bad_shape"
        raise LostError(msg_0, msg)
    finite = np.abs(estimate) < LARGEST_NT  # not a NaN
    for span in spans(flight.time_s):
        seconds = flight.time_s[span] - flight.time_s[span.start]
        if not finite[span][seconds >= warmup_s - 1e-9].all():
            msg = f"its estimate is not finite, or beyond {LARGEST_NT:g} nT, after its warm-up"
            msg_0 = "not_finite"
            raise LostError(msg_0, msg)
    estimate[~finite] = 0.0
    return estimate
