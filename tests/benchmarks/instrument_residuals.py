"""What errors of instruments leave after Tolles-Lawson: the table of docs/instruments.md.

Run ``python tests/benchmarks/instrument_residuals.py [--json]``. One flight of ``calibration_c208b`` with a second
magnetometer at the stinger, recorded by other instruments each time. In-band STD against truth; 16 terms, fitted on
circuit 1 by the fluxgate and judged on circuit 2.
"""

import argparse

from magsim.flight import fly
from magsim.loading import load_scenario
from magsim.simulation import compute_fields, record
from tests.benchmarks.electronics_residuals import fitted, left
from tests.benchmarks.rows import Row, finish, stated

BOTH = "sensors.scalar=[{name='cabin', mount='cabin_center'}, {name='stinger', mount='sgl_mag_1'}]"
SCALARS = ("sensors.scalar[0].", "sensors.scalar[1].")

QUIET = ("preset=cs_quiet", "dead_polar_deg=0.0", "dead_equator_deg=0.0")
"""Without its dead zones: rows that repeat a reading have no place in a band."""

EFFECTS: dict[str, tuple[str, ...]] = {
    "as_shipped": (),
    "scalar_flicker_4_pt": tuple(f"{key}flicker_nt_rthz=0.004" for key in SCALARS),
    "counter": tuple(f"{key}counter_s=0.1" for key in SCALARS),
    "counter_400_hz": tuple(
        setting
        for key in SCALARS
        for setting in (f"{key}counter_s=0.1", f"{key}tones=[{{frequency_hz=399.6, amplitude_nt=20.0}}]")
    ),
    "fluxgate_flicker_20_pt": ("sensors.fluxgate[0].flicker_nt_rthz=0.02",),
    "flexure_200_mdeg_g": ("sensors.fluxgate[0].flexure_deg_g=[0.0, 0.2, 0.0]",),
    "cs_quiet": tuple(f"{key}{setting}" for key in SCALARS for setting in QUIET),
}
"""Settings over the shipped ones. The tone of 399.6 Hz folds to 0.4 Hz, into the band."""


def rows() -> list[Row]:
    """Fly once, record and fit with each set of instruments."""
    loaded = load_scenario("calibration_c208b", [BOTH])
    flight = fly(loaded.scenario, loaded.aircraft, ground=loaded.ground)
    truths = compute_fields(loaded, flight)
    out = []
    for name, settings in EFFECTS.items():
        recording = record(loaded.changed(settings), flight, truths)
        test = recording.where(split="test")
        for sensor in recording.scalars:
            raw, rest = left(test, fitted(recording, sensor), sensor)
            out += [stated(f"{name}_{sensor}_raw", raw, "nT"), stated(f"{name}_{sensor}_tl16", rest, "nT")]
    return out


def main() -> None:
    """Simulate, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    arguments = parser.parse_args()
    finish(rows(), as_json=arguments.json)


if __name__ == "__main__":
    main()
