"""Checks of the manners: parameters, determinism, nothing changed, no state, files, threads."""

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from magsim.compensation import saving
from magsim.compensation.base import restore
from magsim.compensation.checking.case import Case, blas_threads, expect_same, fail, shown, skip
from magsim.errors import RequestError


def parameters(case: Case) -> str:
    """Check that parameters can be read, set and copied."""
    method = case.method
    params = method.get_params()
    copy = method.unfitted()
    if copy.is_fitted or copy.name != method.name or copy.get_params() != params:
        fail(f"an unfitted copy is {copy!r} of name {copy.name!r}, not of the same name and parameters")
    if copy.set_params(**params).get_params() != params:
        fail("set_params(**get_params()) changes parameters")
    return f"{len(params)} parameters: read, set, copied"


def determinism(case: Case) -> str:
    """Check that two fits of one seed agree."""
    expect_same(case.estimate, case.fit().interference(case.probe), "two fits to the same rows with the same seed")
    return "two fits to the same rows with the same seed agree in every bit"


def mutation(case: Case) -> str:
    """Check that recordings and parameters stay as they are."""
    fitted = case.method.unfitted()
    params = repr(fitted.get_params())
    fitted = case.fit()
    if repr(fitted.get_params()) != params:
        fail(f"learn changed the parameters from {params} to {fitted.get_params()!r}")
    fitted.interference(case.probe)
    if repr(fitted.get_params()) != params:
        fail(f"estimate changed the parameters from {params} to {fitted.get_params()!r}")
    changed = [r.name for r, held in zip((*case.flights, case.probe), case.held, strict=True) if shown(r) != held]
    if changed:
        fail(f"the recordings {', '.join(map(repr, changed))} are not what they were")
    return "recordings and parameters are what they were"


def statelessness(case: Case) -> str:
    """Check that an estimate does not depend on what was estimated before."""
    fitted, half = case.fitted, len(case.probe) // 2
    other = case.probe.take(slice(half, None))
    alone = case.fit().interference(other)
    for _ in range(2):
        expect_same(case.estimate, fitted.interference(case.probe), "an estimate and its repetition")
        expect_same(alone, fitted.interference(other), "an estimate before and after that of another recording")
    fresh = case.fit()
    fresh.interference(other)
    expect_same(case.estimate, fresh.interference(case.probe), "estimates in one order and in the other")
    return "estimates repeat, in any order of recordings"


def round_trip(case: Case) -> str:
    """Check that a method comes back from its files."""
    fitted = case.fitted
    with TemporaryDirectory() as folder:
        first, second = Path(folder, "a"), Path(folder, "b")
        fitted.save(first)
        fitted.save(second)
        settings = saving.read_settings(first)
        if settings["params"] != json.loads(json.dumps(fitted.get_params())):
            fail(f"the parameters come back as {settings['params']!r}")
        back = restore(fitted.unfitted(), first, settings)
        expect_same(case.estimate, back.interference(case.probe), "estimates before and after saving")
        for path in first.iterdir():
            if path.read_bytes() != (second / path.name).read_bytes():
                fail(f"{path.name} has other bytes when it is saved again")
    return "saved and loaded, every bit is the same"


def threads(case: Case) -> str:
    """Check that fits on one and on two BLAS threads agree."""
    found = []
    for count in (1, 2):
        with blas_threads(count):
            found.append(case.fit().interference(case.probe))
    expect_same(found[0], found[1], "fits on one and on two BLAS threads")
    return "fits on one and on two BLAS threads agree in every bit"


def stream(case: Case) -> str:
    """Check that a stream gives what the batch gives."""
    fitted, count = case.fitted, min(len(case.probe), 1500)
    part = case.probe.take(slice(0, count))
    start = part.meta.get("start_utc")
    try:
        made = fitted.stream(rate_hz=part.rate_hz, start_utc=start if isinstance(start, str) else None)
    except RequestError as error:
        skip(str(error))
    table = part.stack(made.columns)
    rows = [row for row in map(made.push_values, table) if row is not None] + made.finish()
    got = np.array([row.interference_nt for row in rows])
    expect_same(fitted.interference(part), got, "the estimates of a stream and of the whole", 1e-9)
    return f"{count} rows, one by one, are those of the whole within 1e-9 nT"
