"""The XML that JSBSim reads, and the bridge between structural and body coordinates."""

import numpy as np
import pytest

from magsim.aircraft import Aircraft
from magsim.flight.model.aero import inertia
from magsim.flight.model.airframe import body_from_inches, inches_from_body, write_model
from magsim.flight.model.instance import load
from magsim.units import LB, SLUG_FT2


def test_structural_frame_there_and_back(cessna: Aircraft) -> None:
    for place in [(0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (-8.1, -0.4, -1.2)]:
        np.testing.assert_allclose(
            body_from_inches(inches_from_body(place, cessna.facts), cessna.facts), place, atol=1e-12
        )


def test_structural_axes_point_aft_right_up(cessna: Aircraft) -> None:
    origin = np.array(inches_from_body((0.0, 0.0, 0.0), cessna.facts))
    np.testing.assert_allclose(origin, [194.17, 0.0, 0.0], atol=1e-3)
    ahead_right_below = np.array(inches_from_body((0.0254, 0.0254, 0.0254), cessna.facts))
    np.testing.assert_allclose(ahead_right_below - origin, [-1.0, 1.0, -1.0], atol=1e-9)


def test_jsbsim_reads_back_the_facts(cessna: Aircraft) -> None:
    fdm = load(cessna.facts, 120)
    fdm.run_ic()
    center = [fdm[f"inertia/cg-{axis}-in"] for axis in "xyz"]
    np.testing.assert_allclose(body_from_inches(center, cessna.facts), cessna.facts.cg_b, atol=1e-9)
    assert fdm["inertia/weight-lbs"] * LB == pytest.approx(cessna.facts.mass.mass.value, rel=1e-5)
    moments = inertia(cessna.facts)
    for name, value in (("ixx", moments.xx), ("iyy", moments.yy), ("izz", moments.zz)):
        assert fdm[f"inertia/{name}-slugs_ft2"] * SLUG_FT2 == pytest.approx(value, rel=1e-6)
    # JSBSim states the moment of the thrust about this very point: no arm but the one of the facts.
    assert fdm["metrics/aero-rp-x-in"] == pytest.approx(center[0])


def test_the_model_is_written_nowhere_else(cessna: Aircraft, tmp_path) -> None:
    write_model(cessna.facts, tmp_path, "cessna")
    written = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.xml"))
    assert written == [
        "aircraft/cessna/cessna.xml",
        "engine/engine.xml",
        "engine/thruster.xml",
        "systems/air.xml",
        "systems/survey_autopilot.xml",
    ]
