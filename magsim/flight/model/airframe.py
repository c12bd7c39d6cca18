"""Facts -> flight model of JSBSim: the XML of airframe and engine. The autopilot's XML is in ``autopilot``.

The XML is written into a temporary folder when a flight model is loaded and never kept. Feet, slugs, pounds and
names of JSBSim appear in ``magsim.flight.model`` alone, beside the commands of the pilot.

JSBSim's structural frame is x aft, y right, z up in inches, from the manufacturer's datum; ``inches_from_body`` and
``body_from_inches`` are the only bridge between it and body axes.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from magsim.aircraft.facts import Facts
from magsim.flight.model.aero import derivatives, flap_curve, inertia, lift_curve
from magsim.flight.model.autopilot import system_xml
from magsim.flight.model.balance import dry_inertia, dry_mass, tanks
from magsim.flight.model.engines import ENGINE, THRUSTER, engine_files
from magsim.units import FT, INCH, LB, SLUG_FT2

SYSTEM, AIR = "survey_autopilot", "air"
AERO_RATE = "velocities/{}-aero-rad_sec"
"""JSBSim's rates of rotation that the aerodynamics read: p, q or r."""

STILL_AIR = '<?xml version="1.0"?>\n<system name="air"/>\n'
"""The system of shear and gusts without either."""


def inches_from_body(position_b: Sequence[float], facts: Facts) -> tuple[float, float, float]:
    """Return structural coordinates [in] (x aft, y right, z up) of a place in body axes, (3,) [m] from the datum."""
    datum = facts.datum
    return (
        (datum.station.value - position_b[0]) / INCH,
        (datum.buttline.value + position_b[1]) / INCH,
        (datum.waterline.value - position_b[2]) / INCH,
    )


def body_from_inches(position_in: Sequence[float], facts: Facts) -> tuple[float, float, float]:
    """Return body axes from the datum, (3,) [m], of a place in structural coordinates [in]."""
    datum = facts.datum
    return (
        datum.station.value - position_in[0] * INCH,
        position_in[1] * INCH - datum.buttline.value,
        datum.waterline.value - position_in[2] * INCH,
    )


PULLS = (("tow_n", "1 0 0"), ("tow_e", "0 1 0"), ("tow_d", "0 0 1"))
"""Forces of a rope in local axes: name, and direction north, east, down."""


def model_files(
    facts: Facts,
    name: str,
    *,
    twin: bool = False,
    air_xml: str = STILL_AIR,
    turbulent: bool = False,
    hook_b: Sequence[float] | None = None,
) -> dict[str, str]:
    """Return the text of a model's files by their paths below a folder; with direct thrust for its twin."""
    engine = {f"engine/{file}.xml": text for file, text in engine_files(facts, twin=twin).items()}
    return {
        f"aircraft/{name}/{name}.xml": airframe_xml(facts, name, hook_b, turbulent=turbulent),
        **engine,
        f"systems/{SYSTEM}.xml": system_xml(facts),
        f"systems/{AIR}.xml": air_xml,
    }


def write_model(
    facts: Facts,
    folder: Path,
    name: str,
    *,
    twin: bool = False,
    air_xml: str = STILL_AIR,
    turbulent: bool = False,
    hook_b: Sequence[float] | None = None,
) -> None:
    """Write ``aircraft/<name>/<name>.xml``, engine and systems below a folder, as JSBSim looks for them."""
    files = model_files(facts, name, twin=twin, air_xml=air_xml, turbulent=turbulent, hook_b=hook_b)
    for path, text in files.items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")


def airframe_xml(facts: Facts, name: str, hook_b: Sequence[float] | None = None, *, turbulent: bool = False) -> str:
    """Write the airframe: metrics, mass, engine, aerodynamics, and a rope that pulls on a hook.

    It has no wheels for JSBSim: a flight ends where one would touch (``envelope``), and each wheel would cost 3 % of
    the time. Aerodynamic moments refer to a point of the airframe, independent of the center of gravity. The product
    of inertia is the integral of x z; without ``negated_crossproduct_inertia="false"`` JSBSim reads its negative.
    """
    geometry = facts.geometry
    moments = inertia(facts)
    whole = np.array([[moments.xx, 0.0, -moments.xz], [0.0, moments.yy, 0.0], [-moments.xz, 0.0, moments.zz]])
    dry = dry_inertia(facts, whole) / SLUG_FT2
    return f"""<?xml version="1.0"?>
<fdm_config name="{name}" version="2.0" release="BETA">
 <fileheader><author>magsim</author><description>{name}, generated from facts.toml</description></fileheader>
 <metrics>
  <wingarea unit="FT2">{geometry.wing_area.value / FT**2!r}</wingarea>
  <wingspan unit="FT">{geometry.span.value / FT!r}</wingspan>
  <chord unit="FT">{geometry.mean_chord.value / FT!r}</chord>
  <htailarea unit="FT2">{geometry.tailplane_area.value / FT**2!r}</htailarea>
  <htailarm unit="FT">{geometry.tailplane_arm.value / FT!r}</htailarm>
  <vtailarea unit="FT2">{geometry.fin_area.value / FT**2!r}</vtailarea>
  <vtailarm unit="FT">{geometry.fin_arm.value / FT!r}</vtailarm>
  {_location("AERORP", facts.aerodynamic_reference_b, facts)}
  {_location("EYEPOINT", facts.cg_b, facts)}
  {_location("VRP", facts.cg_b, facts)}
 </metrics>
 <mass_balance negated_crossproduct_inertia="false">
  <ixx unit="SLUG*FT2">{float(dry[0, 0])!r}</ixx>
  <iyy unit="SLUG*FT2">{float(dry[1, 1])!r}</iyy>
  <izz unit="SLUG*FT2">{float(dry[2, 2])!r}</izz>
  <ixz unit="SLUG*FT2">{float(-dry[0, 2])!r}</ixz>
  <emptywt unit="LBS">{dry_mass(facts) / LB!r}</emptywt>
  {_location("CG", facts.dry_cg_b, facts)}
 </mass_balance>
 <ground_reactions/>
 <propulsion>
  <engine file="{ENGINE}">
   <thruster file="{THRUSTER}">
    {_location("", facts.engine.position.value, facts)}
    <orient unit="DEG"><roll>0</roll><pitch>0</pitch><yaw>0</yaw></orient> <sense>1</sense>
   </thruster>
{"".join(f"   <feed>{i}</feed>" + chr(10) for i in range(len(tanks(facts))))}  </engine>
{"".join(_tank_xml(place, fuel, capacity, facts) for place, fuel, capacity in tanks(facts))} </propulsion>
 <system file="{SYSTEM}"/>
 <system file="{AIR}"/>
{_aerodynamics_xml(facts, turbulent=turbulent)}{"" if hook_b is None else _rope_xml(hook_b, facts)}</fdm_config>
"""


def _rope_xml(hook_b: Sequence[float], facts: Facts) -> str:
    """Write forces in local axes at a hook; their magnitudes are set step by step."""
    forces = ""
    for name, direction in PULLS:
        x, y, z = direction.split()
        forces += f"""  <force name="{name}" frame="LOCAL">
   {_location("", hook_b, facts)}
   <direction><x>{x}</x><y>{y}</y><z>{z}</z></direction>
  </force>
"""
    return f" <external_reactions>\n{forces} </external_reactions>\n"


def _location(name: str, position_b: Sequence[float], facts: Facts) -> str:
    x, y, z = inches_from_body(position_b, facts)
    title = f' name="{name}"' if name else ""
    return f'<location{title} unit="IN"><x>{x!r}</x><y>{y!r}</y><z>{z!r}</z></location>'


def _tank_xml(position_b: Sequence[float], fuel_kg: float, capacity_kg: float, facts: Facts) -> str:
    return f"""  <tank type="FUEL">
   {_location("", position_b, facts)}
   <capacity unit="LBS">{capacity_kg / LB!r}</capacity> <contents unit="LBS">{fuel_kg / LB!r}</contents>
  </tank>
"""


def _aerodynamics_xml(facts: Facts, *, turbulent: bool) -> str:
    """Write forces and moments, one function an axis: a sum of terms times dynamic pressure and reference sizes.

    In turbulent air the rates of rotation are those relative to the air, which turns itself.
    """
    d = derivatives(facts)
    alpha, beta = "aero/alpha-rad", "aero/beta-rad"
    elevator, aileron, rudder = "fcs/elevator-pos-rad", "fcs/left-aileron-pos-rad", "fcs/rudder-pos-rad"
    p, q, r = (f"aero/relative/{axis}-rad_sec" if turbulent else AERO_RATE.format(axis) for axis in "pqr")
    alphadot = "aero/alphadot-rad_sec"
    chord, span = "metrics/cbarw-ft", "metrics/bw-ft"
    per_chord, per_span = "aero/ci2vel", "aero/bi2vel"
    curve = "".join(f"      {a!r} {value!r}\n" for a, value in lift_curve(facts))
    lift = f"""   <function name="aero/coefficient/cl-alpha">
     <table><independentVar lookup="row">{alpha}</independentVar><tableData>
{curve}     </tableData></table>
   </function>
{"".join(map(_relative_rate, "pqr")) if turbulent else ""}"""
    wing = "aero/coefficient/cl-alpha"
    flap_drag, flap_pitch = "", ""
    if facts.controls.flap:
        # With flaps the lift of the wing is that of its angle of attack and that of the flaps.
        wing = "aero/coefficient/cl-wing"
        lift += _flaps_xml(facts, wing)
        flap_drag = "<property>aero/coefficient/cd-flap</property>"
        flap_pitch = _term(facts.controls.flap.pitch_per_lift.value, "aero/coefficient/cl-flap")
    drag_terms = (
        f"<value>{d.cd_0!r}</value>"
        f"<product><value>{d.cd_lift!r}</value><property>{wing}</property><property>{wing}</property></product>"
        f"<product><value>{d.cd_sideslip!r}</value><abs><property>{beta}</property></abs></product>{flap_drag}"
    )
    # Rates come first with their reference length, so that each group is multiplied once.
    lift_terms = (
        f"<property>{wing}</property>"
        + _rates(per_chord, (d.cl_q, q), (d.cl_alphadot, alphadot))
        + _term(d.cl_elevator, elevator)
    )
    pitch_terms = (
        f"<value>{d.cm_0!r}</value>"
        + _term(d.cm_alpha, alpha)
        + _rates(per_chord, (d.cm_q, q), (d.cm_alphadot, alphadot))
        + _term(d.cm_elevator, elevator)
        + flap_pitch
    )
    side_terms = _term(d.cy_beta, beta) + _rates(per_span, (d.cy_p, p), (d.cy_r, r)) + _term(d.cy_rudder, rudder)
    roll_terms = (
        _term(d.roll_beta, beta)
        + _rates(per_span, (d.roll_p, p), (d.roll_r, r))
        + _term(d.roll_aileron, aileron)
        + _term(d.roll_rudder, rudder)
    )
    yaw_terms = (
        _term(d.yaw_beta, beta)
        + _rates(per_span, (d.yaw_p, p), (d.yaw_r, r))
        + _term(d.yaw_aileron, aileron)
        + _term(d.yaw_rudder, rudder)
    )
    # The trim searches its angle of attack between these; JSBSim's own range ends at -5 degrees.
    low, high = facts.limits.angle_of_attack.value
    return (
        f' <aerodynamics>\n  <alphalimits unit="DEG"><min>{low!r}</min><max>{high!r}</max></alphalimits>\n'
        + lift
        + _axis("DRAG", "", drag_terms)
        + _axis("SIDE", "", side_terms)
        + _axis("LIFT", "", lift_terms)
        + _axis("ROLL", span, roll_terms)
        + _axis("PITCH", chord, pitch_terms)
        + _axis("YAW", span, yaw_terms)
        + " </aerodynamics>\n"
    )


def _relative_rate(axis: str) -> str:
    """Write a rate of rotation relative to air that turns."""
    names = AERO_RATE.format(axis), f"air/turbulence/{axis}-rad_sec"
    parts = "".join(f"<property>{name}</property>" for name in names)
    return f'   <function name="aero/relative/{axis}-rad_sec"><difference>{parts}</difference></function>\n'


def _flaps_xml(facts: Facts, wing: str) -> str:
    """Write lift and drag of the flaps over their deflection, and the lift of the whole wing."""
    points = flap_curve(facts)
    position = "fcs/flap-pos-rad"
    text = ""
    for name, column in (("cl", 1), ("cd", 2)):
        rows = "".join(f"      {point[0]!r} {point[column]!r}\n" for point in points)
        text += f"""   <function name="aero/coefficient/{name}-flap">
     <table><independentVar lookup="row">{position}</independentVar><tableData>
{rows}     </tableData></table>
   </function>
"""
    lifts = "<property>aero/coefficient/cl-alpha</property><property>aero/coefficient/cl-flap</property>"
    return text + f'   <function name="{wing}"><sum>{lifts}</sum></function>\n'


def _term(coefficient: float, name: str) -> str:
    return f"<product><value>{coefficient!r}</value><property>{name}</property></product>"


def _rates(scale: str, *terms: tuple[float, str]) -> str:
    return f"<product><property>{scale}</property><sum>{''.join(_term(c, n) for c, n in terms)}</sum></product>"


def _axis(axis: str, length: str, terms: str) -> str:
    reference = f"<property>{length}</property>" if length else ""
    return (
        f'  <axis name="{axis}"><function name="aero/total/{axis.lower()}"><product>'
        f"<property>aero/qbar-psf</property><property>metrics/Sw-sqft</property>{reference}<sum>{terms}</sum>"
        "</product></function></axis>\n"
    )
