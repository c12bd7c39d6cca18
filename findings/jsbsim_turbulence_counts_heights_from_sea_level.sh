#!/usr/bin/env bash
# JSBSim's Dryden turbulence above high ground: which height its low-altitude figures follow.
#
# Guess:  with atmosphere/turb-type 4 (Tustin) the low-altitude figures of MIL-F-8785C hold below 1000 ft above the ground;
#         the wind that scales them is called windspeed_at_20ft_AGL. And the severity makes a difference at every height.
# Truth:  heights count from sea level. 100 m above the sea the wind at 20 ft alone decides, and severities 1 to 5 give the same
#         gusts to the last digit; 100 m above a plateau of 1500 m that wind does nothing, to the last digit, and the severity
#         alone decides: 0.27 and 4.6 m/s of vertical gusts where 0.76 m/s are specified (a tenth of 25 ft/s).
# Seen:   jsbsim 1.3.3, Python 3.11: severities 1 and 5, winds of 25 and 50 ft/s.
#
# Ends with 0 if this is still so, else with 1. Needs Python with venv and a package index.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/python -m pip install --quiet --disable-pip-version-check jsbsim==1.3.3

cat > gusts.py <<'PY'
import statistics
import sys

import jsbsim

logger = jsbsim.DefaultLogger()
logger.set_min_level(jsbsim.LogLevel.FATAL)
jsbsim.set_logger(logger)


def vertical_gusts(ground_ft, severity, wind_fps):
    """Standard deviation of the vertical gusts [m/s] over two minutes, at rest 328 ft (100 m) above the ground."""
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    fdm.set_dt(1.0 / 60.0)
    assert fdm.load_model("ball")
    fdm.disable_output()
    fdm["ic/terrain-elevation-ft"] = ground_ft
    fdm["ic/h-sl-ft"] = ground_ft + 328.0
    fdm["ic/vt-fps"] = 200.0
    for group in ("rate/rotational", "rate/translational", "position/rotational", "position/translational"):
        fdm[f"simulation/integrator/{group}"] = 0  # hold the state: the air alone moves
    fdm.run_ic()
    fdm["atmosphere/randomseed"] = 1
    fdm["atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps"] = wind_fps
    fdm["atmosphere/turbulence/milspec/severity"] = severity
    fdm["atmosphere/turb-type"] = 4
    seen = []
    for _ in range(7200):
        fdm.run()
        seen.append(0.3048 * fdm["atmosphere/total-wind-down-fps"])
    assert abs(fdm["position/h-agl-ft"] - 328.0) < 1.0
    return statistics.pstdev(seen)


ground = {"sea": 0.0, "plateau of 1500 m": 4921.0}
table = {}
for where, height in ground.items():
    for severity in (1, 5):
        for wind in (25.0, 50.0):
            table[where, severity, wind] = vertical_gusts(height, severity, wind)
            print(f"100 m above {where}, severity {severity}, {wind:g} ft/s at 20 ft: {table[where, severity, wind]:.3f} m/s")
sea, high = ground
as_seen = (
    all(table[sea, 1, wind] == table[sea, 5, wind] for wind in (25.0, 50.0))
    and table[sea, 1, 50.0] > 1.9 * table[sea, 1, 25.0]
    and all(table[high, severity, 25.0] == table[high, severity, 50.0] for severity in (1, 5))
    and table[high, 5, 25.0] > 10.0 * table[high, 1, 25.0]
)
print("jsbsim", jsbsim.__version__)
sys.exit(0 if as_seen else "CHANGED: heights or severities count otherwise")
PY
venv/bin/python gusts.py
