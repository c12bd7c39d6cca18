"""The flights of paper 000 as they are flown here.

Its simulated flight has two circuits, the first learned and the second judged. Its three real lines are calibrations of
the Cessna 208B of Sander Geophysics: the nearest that can be flown here is the same type with its electronics, one
individual for each set of lines, on two days.
"""

from collections.abc import Mapping

from magsim.papers.paper import Effort, PaperFlight

SIMULATED, LINES = "simulated", "lines"

JUDGED: Mapping[str, tuple[str, ...]] = {SIMULATED: ("circuit 2",), LINES: ("1002.20", "1006.06")}
"""What is judged in each world; of the lines those that they stand for."""

GUSTS_MPS = 0.3
"""Light air, so that seeds are other flights and not other noise alone: an estimate, the paper tells of no air."""

_LINES: Mapping[str, tuple[str, ...]] = {
    "a": (),
    "b": ("recording.train_circuits=[]", "start.time_utc=2020-06-20T18:29:30Z"),
    "c": ("recording.train_circuits=[]", "start.time_utc=2020-07-06T14:57:30Z", "day=17", "pattern.circuits=1"),
}
"""How the lines that 1002.02, 1002.20 and 1006.06 stand for differ from the scenario."""


_SHORT: Mapping[str, tuple[str, ...]] = {
    "a": ("pattern.circuits=1", "recording.train_circuits=[1]"),
    "b": ("pattern.circuits=1",),
    "c": (),
}
"""What is left of them in the quick run."""


def simulated(effort: Effort) -> list[str]:
    """Return the names of the flights of two circuits."""
    return [f"simulated_{number:02d}" for number in range(effort.count(12, 1))]


def lines(effort: Effort) -> list[tuple[str, str, str]]:
    """Return the names of the lines, set by set: learned, judged, judged on another day."""
    sets = range(effort.count(6, 1))
    return [(f"lines_{number:02d}_a", f"lines_{number:02d}_b", f"lines_{number:02d}_c") for number in sets]


def flights(effort: Effort) -> list[PaperFlight]:
    """Return all flights."""
    out = [
        PaperFlight(name, "papers/000_simulated", (f"seed={1 + number}", f"air.turbulence_mps={GUSTS_MPS}"))
        for number, name in enumerate(simulated(effort))
    ]
    for number, names in enumerate(lines(effort)):
        for (key, changes), name in zip(_LINES.items(), names, strict=True):
            short = _SHORT[key] if effort.quick else ()
            seed = 1 + 3 * number + "abc".index(key)
            out.append(
                PaperFlight(name, "papers/000_lines", (f"seed={seed}", f"individual={1 + number}", *changes, *short))
            )
    return out
