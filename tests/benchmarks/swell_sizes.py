"""How large the field of a swell is at the heights of survey flights, as ``docs/earth.md`` prints it.

Run ``python tests/benchmarks/swell_sizes.py [--json | --markdown]``. A default swell (2 m, 12 s) in the field of
48.7 N, 127.2 E, met at 60 m/s from ahead, aslant and from astern; standard deviation along the main field, and that
part of it which lies in 0.1 to 0.6 Hz.
"""

import argparse
import sys

import numpy as np

from magsim import signals
from magsim.field.background.main_field import earth_at_start
from magsim.field.background.swell import draw_waves
from magsim.scenario import Swell
from magsim.streams import stream
from tests.benchmarks.rows import Row, finish, stated
from tests.support.toy_tow import scenario_of

HEIGHTS_M = (40.0, 60.0, 100.0, 150.0, 300.0)
COURSES_DEG = {"ahead": 180.0, "aslant": 135.0, "astern": 0.0}
SPEED_MPS, RATE_HZ, SPAN_S, SEAS = 60.0, 10.0, 600.0, 6


def sizes(height_m: float, toward_deg: float, settings: Swell) -> tuple[float, float]:
    """Standard deviation of the scalar anomaly over several seas, whole and in band [nT]; the flight goes north."""
    main_n = earth_at_start(scenario_of())
    time = np.arange(0.0, SPAN_S, 1.0 / RATE_HZ)
    place = np.column_stack([SPEED_MPS * time, np.zeros((len(time), 2))])
    whole, band = [], []
    for sea in range(SEAS):
        waves = draw_waves(stream(sea, "swell/waves"), settings.model_copy(update={"heading_deg": toward_deg}))
        strength = waves.strength_nt(main_n, settings.conductivity_spm)
        field = waves.field(strength, place, np.full(len(time), height_m), time)
        scalar = field @ main_n / np.linalg.norm(main_n)
        whole.append(np.var(scalar))
        band.append(np.var(signals.band_pass(scalar, RATE_HZ)[signals.off_ends(time)]))
    return float(np.sqrt(np.mean(whole))), float(np.sqrt(np.mean(band)))


def measure() -> dict[tuple[float, str], tuple[float, float]]:
    """Whole and in band by height and course."""
    return {
        (height, name): sizes(height, toward, Swell()) for height in HEIGHTS_M for name, toward in COURSES_DEG.items()
    }


def markdown(found: dict[tuple[float, str], tuple[float, float]]) -> str:
    """One row for each height."""
    lines = [f"| height | {' | '.join(f'waves from {name}' for name in COURSES_DEG)} |", "|---" * 4 + "|"]
    for height in HEIGHTS_M:
        cells = [f"{whole:.2g} / {band:.2g}" for whole, band in (found[height, name] for name in COURSES_DEG)]
        lines.append(f"| {height:g} m | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--markdown", action="store_true", help="print the table of docs/earth.md")
    arguments = parser.parse_args()
    found = measure()
    if arguments.markdown:
        sys.stdout.write(markdown(found))
        return
    rows: list[Row] = []
    for (height, name), (whole, band) in found.items():
        rows += [stated(f"{name}_{height:g}_m", whole, "nT"), stated(f"{name}_{height:g}_m_in_band", band, "nT")]
    finish(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()
