#!/usr/bin/env bash
# JSBSim's turbulence in calm air, or in a wind from due west or east: which way its axes point.
#
# Guess:  the same seed gives the same gusts, whatever the initial heading; without a wind the axes are those of the compass,
#         and in a wind they are along and across it.
# Truth:  the angle of the axes (atmosphere/psiw-rad) is taken from a wind that has gone to the aircraft's axes and back. Without a
#         wind, that is rounding: it is 0, 26.57 or 284.04 degrees by the initial heading, and one seed gives gusts that differ by 2 m/s.
#         A wind to the east alone does no better: 0, 26.57 or 284.04 degrees, not 90. A wind to the north-east gives 45 on every
#         heading. Writing atmosphere/psiw-rad after run_ic holds it.
# Seen:   jsbsim 1.3.3, Python 3.11, x86-64: headings 0, 200 and 300 degrees at 45 degrees of latitude, ten seconds.
#
# Ends with 0 if this is still so, else with 1. Needs Python with venv and a package index.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/python -m pip install --quiet --disable-pip-version-check jsbsim==1.3.3

cat > axes.py <<'PY'
import math
import sys

import jsbsim

logger = jsbsim.DefaultLogger()
logger.set_min_level(jsbsim.LogLevel.FATAL)
jsbsim.set_logger(logger)


def gust(heading_deg, north_fps, east_fps, psiw_rad=None):
    """Angle of the axes [deg], and the gust [m/s] to north and east after ten seconds with one seed."""
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    fdm.set_dt(1.0 / 60.0)
    assert fdm.load_model("ball")
    fdm.disable_output()
    fdm["ic/h-sl-ft"] = 10000.0
    fdm["ic/vt-fps"] = 200.0
    fdm["ic/psi-true-deg"] = heading_deg
    fdm["ic/lat-geod-deg"] = 45.0
    fdm.run_ic()
    fdm["atmosphere/wind-north-fps"] = north_fps
    fdm["atmosphere/wind-east-fps"] = east_fps
    fdm["atmosphere/randomseed"] = 1
    fdm["atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps"] = 25.0
    fdm["atmosphere/turbulence/milspec/severity"] = 3
    fdm["atmosphere/turb-type"] = 4
    if psiw_rad is not None:
        fdm["atmosphere/psiw-rad"] = psiw_rad
    for _ in range(600):
        fdm.run()
    north = 0.3048 * (fdm["atmosphere/total-wind-north-fps"] - north_fps)
    east = 0.3048 * (fdm["atmosphere/total-wind-east-fps"] - east_fps)
    return math.degrees(fdm["atmosphere/psiw-rad"]), north, east


def spread(*wind, **held):
    """Print the gusts of three initial headings, and return how far they differ [deg, m/s]."""
    found = [gust(heading, *wind, **held) for heading in (0.0, 200.0, 300.0)]
    for heading, (angle, north, east) in zip((0, 200, 300), found):
        print(f"wind {wind} ft/s, heading {heading:3d}: axes {angle:6.2f} deg, gust {north:6.2f} {east:6.2f} m/s  {held or ''}")
    angles, norths, easts = zip(*found)
    return max(angles) - min(angles), math.hypot(max(norths) - min(norths), max(easts) - min(easts))


calm, eastward = spread(0.0, 0.0), spread(0.0, 20.0)
oblique, held = spread(14.0, 14.0), spread(0.0, 0.0, psiw_rad=0.0)
as_seen = calm[1] > 1.0 and eastward[0] > 10.0 and oblique[1] < 0.1 and held[1] < 0.1
print("jsbsim", jsbsim.__version__)
sys.exit(0 if as_seen else "CHANGED: the axes are definite")
PY
venv/bin/python axes.py
