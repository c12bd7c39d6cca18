"""Measure what one output costs: batch of one, one thread, every method with its default settings.

Run ``python tests/benchmarks/inference_speed.py [--json] [--methods tl16,magtcn]``. One output is what a crew sees of
one row: a row goes into ``Compensator.stream`` and an output comes out, with the input columns, the first stage and
the network. A network that sees both sides of its output has no stream; there one output is one call of the network,
in the precision that it estimates in, on one window of standardized columns, as in paper 000's Table 6, whose figures
stand beside it (a GPU, mean of 30 000). What else needs the whole flight has one output a flight, and no bound.
Networks are fitted for two steps: what an output costs does not depend on the weights.
"""

import argparse
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import torch

from magsim.compensation import Compensator, create, names, presets_of
from magsim.compensation.networks import NetworkCompensator
from magsim.errors import RequestError
from magsim.recording import Recording
from magsim.threads import one_blas_thread
from magsim.training import reproducible
from tests.benchmarks.physics_rows.shown import tell
from tests.benchmarks.rows import Row, at_most, finish, stated
from tests.support.inertial import flown

CALLS, WARM_UP = 2000, 200
MOST_MS, MOST_MAGTCN_MS = 100.0, 1.8

PAPER_MS: Mapping[str, float] = {"williams": 0.428, "bpnn": 0.046, "resnet": 1.240, "magtcn": 1.837}
"""Table 6 of paper 000: time of an output, batch of one, on an RTX 4060 Ti."""

BRIEFLY: Mapping[str, Any] = {"steps": 2, "every": 1}


def latencies_ms(call: Callable[[], object], count: int) -> np.ndarray:
    """Return the time of each call after a warm-up [ms]."""
    for _ in range(WARM_UP):
        call()
    found = np.empty(count)
    for i in range(count):
        began = time.perf_counter()
        call()
        found[i] = 1e3 * (time.perf_counter() - began)
    return found


def streamed(method: Compensator, recording: Recording) -> Callable[[], object]:
    """Return a call that gives the next row to a stream; the flight begins anew in a new stream at its end."""

    def rows() -> Iterator[object]:
        while True:
            stream = method.stream(start_utc=recording.meta["start_utc"])
            table = list(np.column_stack([recording[name] for name in stream.columns]))
            for row in table:
                yield stream.push_values(row)

    return rows().__next__


def windowed(method: NetworkCompensator, recording: Recording) -> Callable[[], object]:
    """Return a call of the network on one window."""
    fitted = method._fitted
    inputs = fitted.inputs(recording)[: method.settings.window]
    window, module = torch.from_numpy(inputs.T[None].copy()), fitted.module.eval()

    def call() -> object:
        with torch.inference_mode():
            return module(window)

    return call


def rows_of(name: str, recording: Recording, count: int) -> list[Row]:
    """Return the figures of a method."""
    brief = BRIEFLY if "default" in presets_of(name) else {}
    method = create(name, **brief).fit(recording)
    if method.causal:
        call, what = streamed(method, recording), "a row in a stream"
    elif isinstance(method, NetworkCompensator):
        what = f"a window of {method.settings.window} rows"
        call = windowed(method, recording)
    else:
        began = time.perf_counter()
        method.interference(recording)
        passed = 1e3 * (time.perf_counter() - began)
        return [stated(f"inference_ms_{name}_flight", passed, f"ms, a flight of {len(recording)} rows")]
    with reproducible(1):
        found = latencies_ms(call, count)
    about = f"ms, {what}, median of {count}"
    if name in PAPER_MS:
        about += f"; paper 000, on a GPU: {PAPER_MS[name]:g}"
    bound = MOST_MAGTCN_MS if name == "magtcn" else MOST_MS
    return [
        at_most(f"inference_ms_{name}", float(np.median(found)), about, bound),
        at_most(f"inference_p99_ms_{name}", float(np.percentile(found, 99.0)), f"ms, {what}", MOST_MS),
    ]


def main() -> None:
    """Fit, call, print."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--methods", default=",".join(names()), help="names by comma; default all")
    parser.add_argument("--calls", type=int, default=CALLS, help=f"outputs of each method; default {CALLS}")
    arguments = parser.parse_args()
    recording = flown()
    rows: list[Row] = []
    with one_blas_thread():
        for name in arguments.methods.split(","):
            try:
                found = rows_of(name, recording, arguments.calls)
            except RequestError as error:
                tell(f"{name} is left out: {error}")
                continue
            for row in found:
                tell(f"{row.name} {row.value:.4g} {row.unit}")
            rows += found
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()
