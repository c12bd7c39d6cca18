#!/usr/bin/env bash
# JSBSim's turbulence as an input: what becomes of gusts of one's own that are written to its properties.
#
# Guess:  with atmosphere/turb-type 0 (none), own turbulence can be fed through atmosphere/turb-north-fps, which the catalog lists as
#         (RW), and its turning of the air through atmosphere/p-turb-rad_sec, by Python or by a component of the flight control;
#         what cannot be written is an error.
# Truth:  both are lost, without an error and without a message. p-turb-rad_sec does not take a value at all, from Python or from a
#         component whose <output> it is. turb-north-fps takes it, and is zero again before the step uses it. What is written to
#         atmosphere/gust-north-fps stays and moves the air; there is no such property that turns it.
# Seen:   jsbsim 1.3.3, Python 3.11: 10 ft/s and 0.5 rad/s written before each of ten steps, turb-type 0 and 4.
#
# Ends with 0 if this is still so, else with 1. Needs Python with venv and a package index.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/python -m pip install --quiet --disable-pip-version-check jsbsim==1.3.3

mkdir -p aircraft/stone
cat > aircraft/stone/stone.xml <<'XML'
<?xml version="1.0"?>
<fdm_config name="stone" version="2.0">
  <fileheader/>
  <metrics>
    <wingarea unit="FT2">1</wingarea> <wingspan unit="FT">1</wingspan> <chord unit="FT">1</chord>
    <location name="AERORP" unit="IN"><x>0</x><y>0</y><z>0</z></location>
  </metrics>
  <mass_balance>
    <ixx unit="SLUG*FT2">10</ixx> <iyy unit="SLUG*FT2">10</iyy> <izz unit="SLUG*FT2">10</izz> <emptywt unit="LBS">50</emptywt>
    <location name="CG" unit="IN"><x>0</x><y>0</y><z>0</z></location>
  </mass_balance>
  <ground_reactions/>
  <flight_control name="air">
    <channel name="air">
      <fcs_function name="air/turning">
        <function><value>0.5</value></function>
        <output>atmosphere/q-turb-rad_sec</output>
      </fcs_function>
    </channel>
  </flight_control>
  <aerodynamics/>
</fdm_config>
XML
cat > feed.py <<'PY'
import sys

import jsbsim


def flown(turb_type):
    """Largest of what was read after writing and after each of ten steps, by name."""
    fdm = jsbsim.FGFDMExec(".")
    fdm.set_debug_level(0)
    fdm.set_dt(1.0 / 120.0)
    assert fdm.load_model("stone")
    fdm["ic/h-sl-ft"] = 10000.0
    fdm["ic/vt-fps"] = 200.0
    fdm.run_ic()
    fdm["atmosphere/randomseed"] = 1
    fdm["atmosphere/turb-type"] = turb_type
    fdm["atmosphere/gust-north-fps"] = 10.0
    gust = fdm["atmosphere/gust-north-fps"]
    seen = {}
    for _ in range(10):
        fdm["atmosphere/turb-north-fps"] = 10.0
        fdm["atmosphere/p-turb-rad_sec"] = 0.5
        written = {"turb-north written": fdm["atmosphere/turb-north-fps"], "p written": fdm["atmosphere/p-turb-rad_sec"]}
        fdm.run()
        after = {
            "turb-north flown": fdm["atmosphere/turb-north-fps"],
            "wind north": fdm["atmosphere/total-wind-north-fps"],
            "component": fdm["air/turning"],
            "q flown": fdm["atmosphere/q-turb-rad_sec"],
            "air turns": fdm["velocities/p-rad_sec"] - fdm["velocities/p-aero-rad_sec"],
        }
        for name, value in (written | after).items():
            seen[name] = max(seen.get(name, 0.0), abs(value))
    print(f"turb-type {turb_type}, gust {gust:g}:", ", ".join(f"{name} {value:.3g}" for name, value in seen.items()))
    return seen


calm, dryden = flown(0), flown(4)
as_seen = (
    all(seen["turb-north written"] == 10.0 and seen["turb-north flown"] < 5.0 for seen in (calm, dryden))
    and abs(calm["wind north"] - 10.0) < 1e-6
    and all(seen["p written"] < 0.1 and seen["air turns"] < 0.1 for seen in (calm, dryden))
    and all(seen["component"] == 0.5 and seen["q flown"] < 0.1 for seen in (calm, dryden))
)
print("jsbsim", jsbsim.__version__)
sys.exit(0 if as_seen else "CHANGED: what is written to the turbulence stays, or is refused")
PY
venv/bin/python feed.py > told.txt 2>&1 || { cat told.txt; exit 1; }
grep -E '^(turb-type|jsbsim) ' told.txt
if grep -vE '^(turb-type|jsbsim) ' told.txt | grep -iE 'error|warning|turb|read-only'; then
    echo "CHANGED: there is a message"
    exit 1
fi
