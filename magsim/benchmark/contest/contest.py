"""The judge's side: what a method is sent, how long it is waited for, what is believed of its answer."""

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from magsim.benchmark.contest import entries, sandbox, wire
from magsim.benchmark.contest.belief import Learned, answering, believed, checked, declared
from magsim.benchmark.contest.disguise import disguised
from magsim.benchmark.contest.outcome import Allowance, Contestant, Costs, Finish, LostError
from magsim.benchmark.contest.process import Server
from magsim.recording import Recording

MAX_STATE = 2**29
"""Most bytes of a fitted method."""

SEED = 0
"""Of every fit: fits differ by the flights."""


class Contest:
    """Runs methods in processes of their own; a context manager, which owns the servers of them.

    One method at a time: two threads need two. From the first on, other processes of the same user cannot read the
    memory of this one, and it leaves no core dump.
    """

    def __init__(self) -> None:
        sandbox.hide_memory()
        self._servers: dict[bool, Server] = {}

    @property
    def sandboxed(self) -> bool:
        """Whether the kernel keeps methods from other files."""
        return sandbox.level() > 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the servers, and every process with them."""
        while self._servers:
            self._servers.popitem()[1].close()

    def run(  # noqa: PLR0917 - all that a method is judged by
        self,
        entry: Contestant,
        training: Sequence[Recording],
        sensor: str,
        rounds: Sequence[Sequence[Recording]],
        limits: Allowance,
        rng: np.random.Generator,
    ) -> Finish:
        """Let a method fit, and estimate round by round, each in a process of its own.

        Parameters
        ----------
        entry : Contestant
        training : sequence of Recording
            What it may learn from; of it inputs, labels and segments.
        sensor : str
            The scalar magnetometer.
        rounds : sequence of sequence of Recording
            Those of one round are seen by one process, in a random order; of them the inputs that the fitted method
            requires.
        limits : Allowance
        rng : numpy.random.Generator
            Of names, clocks and order.

        Returns
        -------
        Finish
            Whatever the method does.

        Raises
        ------
        RequestError
            If there is no method of that name, or no such trained run.
        DataError
            If a trained run is broken, or no process can be started.
        """
        run = _Run(self._server_for(entry.method), entry, sensor, limits, rng)
        try:
            fitted = run.fit(training)
            found = [run.estimate(fitted, flights) for flights in rounds]
        except LostError as lost:
            return Finish(lost.status, lost.reason)
        rows = sum(len(flight) for flights in rounds for flight in flights)
        spent_s = sum(cpu_s for _, cpu_s in found)
        return Finish(
            "ok",
            estimates=tuple(estimates for estimates, _ in found),
            requires=fitted.requires,
            adapts=fitted.adapts,
            lookahead_rows=fitted.lookahead_rows,
            pretrained=run.pretrained,
            learned=entries.learned(Path(entry.method)) if run.pretrained else (),
            costs=replace(fitted.costs, estimate_us=1e6 * spent_s / max(rows, 1)),
        )

    def _server_for(self, method: str) -> Server:
        """Return the server for a method; it is started when it is first needed, and again if it has ended."""
        networks = entries.is_network(method)
        if networks in self._servers and not self._servers[networks].is_running:
            self._servers.pop(networks).close()
        if networks not in self._servers:
            self._servers[networks] = Server(networks=networks)
        return self._servers[networks]


class _Done(NamedTuple):
    """An answer, and what it has cost."""

    answer: wire.Message
    cpu_s: float
    wall_s: float
    peak_mb: float


class _Run:
    """One method in its processes."""

    def __init__(
        self, server: Server, entry: Contestant, sensor: str, limits: Allowance, rng: np.random.Generator
    ) -> None:
        self._server, self._sensor, self._limits, self._rng = server, sensor, limits, rng
        self._folder = Path(entry.method)
        self.pretrained = self._folder.is_dir()
        self._order: wire.Header = {
            "method": None if self.pretrained else entries.absolute(entry.method),
            "quick": entry.quick,
            "readable": entries.files_of(entry.method),
            "memory_mb": limits.memory_mb,
            "sensor": sensor,
            "seed": SEED,
        }

    def fit(self, training: Sequence[Recording]) -> Learned:
        """Have the method fitted, or opened if it comes fitted."""
        allowed_s = self._limits.fit_s
        if self.pretrained:
            names, files = entries.read_run(self._folder)
            done = self._done({"kind": "open", "files": names}, files, [], most=MAX_STATE, allowed_s=allowed_s)
        else:
            shown = [disguised(one.labeled(), self._rng) for one in training]
            done = self._done({"kind": "fit"}, (), shown, most=MAX_STATE, allowed_s=allowed_s)
        costs = Costs(done.cpu_s, done.wall_s, peak_mb=done.peak_mb)
        return declared(done.answer, self._sensor, costs)

    def estimate(self, fitted: Learned, flights: Sequence[Recording]) -> tuple[tuple[np.ndarray, ...], float]:
        """Return the estimates of a round in its order, and the processor time that they took [s]."""
        places = [int(place) for place in self._rng.permutation(len(flights))]
        shown = [disguised(flights[place].blind(fitted.requires), self._rng) for place in places]
        order = {"kind": "estimate", "files": fitted.names}
        most = sum(8 * len(flight) for flight in flights)
        done = self._done(order, fitted.files, shown, most=most, allowed_s=self._limits.estimate_s)
        if len(done.answer.blocks) != len(shown):
            msg = f"{len(done.answer.blocks)} estimates for {len(shown)} flights"
            raise LostError(msg, "bad_shape")
        found = {
            place: believed(done.answer, number, flights[place], fitted.warmup_s) for number, place in enumerate(places)
        }
        return tuple(found[place] for place in range(len(flights))), done.cpu_s

    def _done(
        self,
        order: wire.Header,
        files: Sequence[memoryview],
        shown: Sequence[Recording],
        *,
        most: int,
        allowed_s: float,
    ) -> _Done:
        """Have an order done by a new process: it makes the method, is sent flights, and answers."""
        with self._server.process() as process, answering(allowed_s) as until:
            header = {**self._order, **order, "folder": str(process.folder)}
            wire.send(process.line, header, files, until=until)
            checked(wire.receive(process.line, most=0, until=until).header, "ready")
            began, before_s = time.monotonic(), process.cpu_s()
            wire.send_recordings(process.line, shown, until=until)
            answer = wire.receive(process.line, most=most, until=until)
            checked(answer.header, "ok")
            return _Done(answer, process.cpu_s() - before_s, time.monotonic() - began, process.peak_mb())
