"""Judge a compensated survey as docs/survey_protocol.md says: misclosure of crossings, coherence with attitude.

    python tests/benchmarks/survey_protocol.py compensated/*.h5 --sensor port [--json]

The files are recordings with the split of their lines (``magsim import``), as ``magsim compensate`` wrote them: beside
the reading ``mag_{sensor}_nt`` they hold ``compensated_{sensor}_nt`` of the method and ``compensated_contractor_nt``.
Lines with the split ``test`` are judged.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import t as student

from magsim.compensation.targets.crossings import Crossings
from magsim.compensation.targets.model import model_strength
from magsim.recording import Recording, read_recordings
from magsim.signals import in_band
from tests.benchmarks.rows import Row, finish, stated

CHANNELS = ("raw", "contractor", "method")
TAP_S = 0.5
SHIFTS, LEAST_SHIFT_S = 20, 10.0
LEAST_UNITS = 6
LEAST_LINE_S = 120.0
MAD = 1.4826
"""Median of absolute values of a normal variable, to its deviation."""


@dataclass(frozen=True)
class Line:
    """One judged line: its channels without the model field, (n,) [nT] each."""

    recording: Recording
    channels: dict[str, np.ndarray]


def channels_of(recording: Recording, sensor: str) -> dict[str, np.ndarray]:
    """Return the channels of a recording without the length of the model field, (n,) [nT] each."""
    model = model_strength(recording)
    names = {"raw": f"mag_{sensor}_nt", "contractor": "compensated_contractor_nt", "method": f"compensated_{sensor}_nt"}
    return {key: recording[name] - model for key, name in names.items()}


def lines_of(recording: Recording, sensor: str) -> list[Line]:
    """Return the judged lines of a flight."""
    judged = recording.where(split="test")
    out = []
    for number in np.unique(judged["circuit"]):
        for piece in judged.where(circuit=float(number)).pieces():
            if piece.time_s[-1] - piece.time_s[0] >= LEAST_LINE_S:
                out.append(Line(piece, channels_of(piece, sensor)))
    return out


def misclosures(flights: Sequence[Recording], sensor: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the unit (recording and line of the later pass) of each crossing, (p,), and the differences by channel."""
    judged = [flight.where(split="test") for flight in flights]
    pairs = Crossings().pairs(judged, sensor)
    later = zip(pairs.recordings[:, 1], pairs.rows[:, 1], strict=True)
    units = np.array([1000.0 * number + judged[number]["circuit"][row] for number, row in later])
    channels = [channels_of(flight, sensor) for flight in judged]
    return units, {key: pairs.target([one[key] for one in channels]) for key in CHANNELS}


def coherent_nt(line: Line, channel: str, random: np.random.Generator) -> float:
    """Return the in-band STD that goes with the attitude [nT].

    Of a signal S that does and a rest N that does not, a fit explains S + c N, and a fit to a shifted attitude
    c (S + N).
    """
    recording = line.recording
    value = in_band(line.channels[channel], recording.time_s)
    found = explained(value, taps(recording, 0))
    least = round(LEAST_SHIFT_S * recording.rate_hz)
    shifts = random.integers(least, len(recording) - least, SHIFTS)
    chance = np.mean([explained(value, taps(recording, int(shift))) for shift in shifts])
    share = chance / max(float(value.var()), 1e-30)
    return float(np.sqrt(max(found - chance, 0.0) / (1.0 - share)))


def taps(recording: Recording, shift: int) -> np.ndarray:
    """Return the attitude in band, shifted along the line, at three times each, (m, 12)."""
    roll, pitch, heading = (np.radians(recording[f"ins_{name}_deg"]) for name in ("roll", "pitch", "heading"))
    angles = np.column_stack([roll, pitch, np.sin(heading), np.cos(heading)])
    step = round(TAP_S * recording.rate_hz)
    moved = [np.roll(angles, shift + tap, axis=0) for tap in (-step, 0, step)]
    return in_band(np.hstack(moved), recording.time_s)


def explained(value: np.ndarray, columns: np.ndarray) -> float:
    """Return the mean square that columns explain of a value, both centered."""
    value, columns = value - value.mean(), columns - columns.mean(axis=0)
    found, *_ = np.linalg.lstsq(columns, value, rcond=1e-10)
    return float(np.mean((columns @ found) ** 2))


def fourth_nt(values: np.ndarray) -> float:
    """Return the STD of the fourth difference over 16 [nT]."""
    return float(np.diff(values, 4).std() / 16.0)


def interval(ratios: Sequence[float]) -> tuple[float, float, float]:
    """Return the geometric mean of ratios by unit, and its 95 % interval by Student's t on logarithms."""
    logs = np.log(ratios)
    half = student.ppf(0.975, len(logs) - 1) * logs.std(ddof=1) / np.sqrt(len(logs))
    low, middle, high = np.exp(logs.mean() + np.array([-half, 0.0, half]))
    return float(middle), float(low), float(high)


def verdict(*bounds: tuple[float, float]) -> str:
    """Return what the intervals of the ratios say of the method beside the contractor."""
    if all(high < 1.0 for _, high in bounds):
        return "better"
    if any(low > 1.0 for low, _ in bounds):
        return "worse"
    if all(0.8 <= low <= 1.0 <= high <= 1.25 for low, high in bounds):
        return "as good"
    return "undecided"


def judge(flights: Sequence[Recording], sensor: str) -> list[Row]:
    """Return all figures of the protocol; a ratio has no row where there are too few units."""
    random = np.random.default_rng(0)
    lines = [line for flight in flights for line in lines_of(flight, sensor)]
    units, differences = misclosures(flights, sensor)
    coherent = {key: [coherent_nt(line, key, random) for line in lines] for key in CHANNELS}
    rows = [stated("lines", len(lines), "1"), stated("crossings", len(units), "1")]
    for key in CHANNELS:
        rows.append(stated(f"misclosure_{key}", MAD * float(np.median(np.abs(differences[key]))), "nT"))
        rows.append(stated(f"coherent_{key}", float(np.median(coherent[key])), "nT"))
        fourth = [fourth_nt(line.channels[key]) for line in lines]
        rows.append(stated(f"fourth_difference_{key}", float(np.median(fourth)), "nT"))
    by_unit = {
        key: [float(np.median(np.abs(differences[key][units == unit]))) for unit in np.unique(units)]
        for key in CHANNELS
    }
    bounds = []
    for name, table in (("misclosure", by_unit), ("coherent", coherent)):
        pairs = zip(table["method"], table["contractor"], strict=True)
        ratios = [a / b for a, b in pairs if a > 0.0 and b > 0.0]
        if len(ratios) >= LEAST_UNITS:
            middle, low, high = interval(ratios)
            rows.append(stated(f"{name}_ratio", middle, "1"))
            rows += [stated(f"{name}_ratio_lower95", low, "1"), stated(f"{name}_ratio_upper95", high, "1")]
            bounds.append((low, high))
    if len(bounds) == 2:
        said = verdict(*bounds)
        rows += [stated(f"verdict_{word.replace(' ', '_')}", float(word == said), "1") for word in VERDICTS]
    return rows


VERDICTS = ("better", "as good", "worse", "undecided")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("files", nargs="+", type=Path, help="recordings that magsim compensate wrote")
    parser.add_argument("--sensor", required=True, help="scalar magnetometer that was compensated")
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    arguments = parser.parse_args()
    flights = [flight for path in arguments.files for flight in read_recordings(path)]
    finish(judge(flights, arguments.sensor), as_json=arguments.json)


if __name__ == "__main__":
    main()
