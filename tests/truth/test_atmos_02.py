"""NASA check case Atmos_02: a tumbling brick without damping or drag, flown with the integrators that magsim sets."""

from pathlib import Path

import numpy as np
import pytest

from magsim.flight.model.instance import load_from
from magsim.flight.model.rates import INTEGRATORS
from magsim.units import FT
from tests.support.paths import REFERENCE_DATA

DATA = REFERENCE_DATA / "nesc_atmos_02.csv"
STEP_S = 0.01

# NASA TM-2015-218675 (trajectory tables of nasa/simupy-flight, NESC_data), reference simulation 01.
# Time s; roll, pitch, yaw deg; altitude ft.
NASA_ROWS = """
 0.5   5.630632902   9.792393768   15.312510928 29996.0011449
 2.5  40.016053952  31.883389423   91.623787384 29900.0156723
 5.0  43.879239092   2.224379214 -177.786288440 29600.0591843
 7.5 -21.641047300 -23.284675104  -92.716916654 29100.1253495
10.0 -66.019003244   3.741337474   -4.321336368 28400.2046314
12.5 -23.131818608  24.806414966   88.608265638 27500.2836754
15.0  34.037456323  -9.133426718  171.030424000 26400.3453080
17.5  29.056440590 -34.312665902  -95.332132827 25100.3685343
20.0   4.138317996   4.059829768   -6.369693824 23600.3285365
22.5  14.711809319  37.756982207   85.652027935 21900.1966708
25.0  10.523078488   5.380257102  175.261255526 19999.9404643
27.5 -36.571730658 -29.566689767  -97.575024532 17899.5236123
30.0 -56.151307597  -3.819654920   -4.289355039 15598.9059736
"""

# Mass and moments of the check case; the reference point is the center of gravity.
BRICK = """<?xml version="1.0"?>
<fdm_config name="brick" version="2.0" release="BETA">
 <metrics>
  <wingarea unit="FT2">0.22222</wingarea><wingspan unit="FT">0.33333</wingspan><chord unit="FT">0.66667</chord>
  <location name="AERORP" unit="FT"><x>0</x><y>0</y><z>0</z></location>
 </metrics>
 <mass_balance>
  <ixx unit="SLUG*FT2">0.001894220</ixx><iyy unit="SLUG*FT2">0.006211019</iyy><izz unit="SLUG*FT2">0.007194665</izz>
  <emptywt unit="LBS">5.0000000</emptywt>
  <location name="CG" unit="FT"><x>0</x><y>0</y><z>0</z></location>
 </mass_balance>
 <ground_reactions/><propulsion/><flight_control name="none"/><aerodynamics/>
</fdm_config>
"""


def tumble(folder: Path, integrators: dict[str, int] | None = None) -> np.ndarray:
    """Roll, pitch, yaw [deg] and altitude [ft] at every step of 30 s, (3001, 4)."""
    for name in ("aircraft/brick", "engine", "systems"):
        (folder / name).mkdir(parents=True)
    (folder / "aircraft" / "brick" / "brick.xml").write_text(BRICK, encoding="utf-8")
    fdm = load_from(folder, "brick", STEP_S)
    for group, order in (integrators or {}).items():
        fdm[f"simulation/integrator/{group}"] = order
    fdm["ic/terrain-elevation-ft"] = 0.0
    fdm["ic/lat-geod-deg"] = 0.0
    fdm["ic/long-gc-deg"] = 0.0
    fdm["ic/h-sl-ft"] = 30000.0
    for name in ("phi", "theta", "psi-true"):
        fdm[f"ic/{name}-deg"] = 0.0
    for name in ("vn", "ve", "vd"):
        fdm[f"ic/{name}-fps"] = 0.0
    # Relative to the turning Earth; inertially 10, 20 and 30 deg/s.
    for name, rate in (("p", 9.995821927), ("q", 20.0), ("r", 30.0)):
        fdm[f"ic/{name}-rad_sec"] = np.radians(rate)
    fdm.run_ic()
    names = ("attitude/phi-deg", "attitude/theta-deg", "attitude/psi-deg", "position/geod-alt-ft")
    rows = [[fdm[name] for name in names]]
    for _ in range(3000):
        fdm.run()
        rows.append([fdm[name] for name in names])
    return np.array(rows)


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    return tumble(tmp_path_factory.mktemp("brick"))


def departure_deg(flown: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference of three angles, across the jump at 180 degrees."""
    return float(np.abs((flown - expected + 180.0) % 360.0 - 180.0).max())


def test_attitude_follows_the_reference(flown: np.ndarray) -> None:
    rows = np.loadtxt(NASA_ROWS.split("\n"))
    index = np.rint(rows[:, 0] / STEP_S).astype(int)
    assert departure_deg(flown[index, :3], rows[:, 1:4]) <= 0.001
    assert np.abs(flown[index, 3] - rows[:, 4]).max() * FT <= 0.1


def test_attitude_follows_every_reference_simulation(flown: np.ndarray) -> None:
    """All rows of NASA's table where it lies beside the checkout; a clone has the rows above."""
    names = ("roll", "pitch", "yaw")
    if DATA.exists():
        table = np.genfromtxt(DATA, delimiter=",", names=True)
        simulations = [
            np.column_stack([table["time_s"], *(table[f"{simulation}_{name}_deg"] for name in names)])
            for simulation in ("sim01", "sim04", "sim05")
        ]
    else:
        simulations = [np.loadtxt(NASA_ROWS.split("\n"))[:, :4]]
    for rows in simulations:
        index = np.rint(rows[:, 0] / STEP_S).astype(int)
        assert departure_deg(flown[index, :3], rows[:, 1:]) <= 0.001


def test_the_case_tells_integrators_apart(tmp_path: Path) -> None:
    # JSBSim's own choice for rotation, Euler's rule, must fail this case by degrees (JSBSim pull request 1453).
    assert (INTEGRATORS["rate/rotational"], INTEGRATORS["position/rotational"]) == (4, 7)
    euler = tumble(tmp_path, {"rate/rotational": 1, "position/rotational": 1})
    assert 2.0 < departure_deg(euler[-1, :3], np.array([-56.151307597, -3.81965492, -4.289355039])) < 3.0
