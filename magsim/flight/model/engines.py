"""Engines: the kinds of ``[engine]`` in ``facts.toml``, and their XML for JSBSim.

``direct`` is a thrust that depends on speed, height and lever. ``turboprop`` is a free turbine with a governed
propeller. JSBSim's trim stops the clock and its turboprop gives no power then; so every turboprop has a *twin* with
direct thrust, made of the same propeller, which is trimmed and linearized in its place.
"""

import math
from functools import lru_cache

import numpy as np

from magsim.aircraft.engine import DirectEngine, Engine, FixedPropeller, TurbopropEngine
from magsim.aircraft.facts import Facts
from magsim.flight.model.propeller import ADVANCE, PITCH_DEG, governed_thrust, tables
from magsim.units import FT, HP, LB, LBF, RHO0, SLUG_FT2, SLUG_FT3

ENGINE, THRUSTER = "engine", "thruster"

SETTLE_S = 40.0
"""Time in which a propeller that starts from rest has reached its speed and the loops have settled."""

IDLE_POWER = 0.03
"""Part of the power that a turbine gives at idle; an estimate, it only keeps fuel flow over power finite."""


def settling_time(engine: Engine) -> float:
    """Return the time [s] that an engine needs after its start before the flight may begin."""
    return SETTLE_S if isinstance(engine, TurbopropEngine) else 0.0


def available_power(engine: TurbopropEngine, density: float) -> float:
    """Return the shaft power [W] with the lever forward: flat rated, then falling with density.

    The law is Anderson's, Aircraft Performance and Design, eq. 3.36.
    """
    return min(engine.power.value, engine.thermodynamic_power.value * (density / RHO0) ** engine.density_exponent.value)


def available_thrust(engine: Engine, speed_mps: float, density: float) -> float:
    """Return the thrust [N] with the lever forward; a direct engine's loss with height is left out."""
    if isinstance(engine, DirectEngine):
        thrust = engine.power.value * engine.propeller_efficiency.value / max(speed_mps, 1.0)
        return min(engine.static_thrust.value, thrust)
    return governed_thrust(engine.propeller, available_power(engine, density), speed_mps, density)


def turning_speed(
    propeller: FixedPropeller, thrust_n: np.ndarray, speed_mps: np.ndarray, density: np.ndarray
) -> np.ndarray:
    """Return the speed at which a propeller of fixed pitch gives a thrust, (n,) [rad/s].

    ``T = rho n^2 D^4 (c0 + c1 J + c2 J^2)`` with ``J = V / (n D)`` is a square equation for the revolutions ``n``
    (Beard and McLain, Small Unmanned Aircraft, chapter 4).

    Parameters
    ----------
    propeller : FixedPropeller
    thrust_n : (n,) [N]
        Not negative.
    speed_mps : (n,) [m/s]
    density : (n,) [kg/m^3]
    """
    c0, c1, c2 = propeller.thrust_coefficient.value
    diameter = propeller.diameter.value
    flow = speed_mps / diameter
    rest = c2 * flow**2 - thrust_n / (density * diameter**4)
    return math.pi / c0 * (np.sqrt((c1 * flow) ** 2 - 4.0 * c0 * rest) - c1 * flow)


def lever_of(engine: TurbopropEngine, thrust_n: float, speed_mps: float, density: float) -> float:
    """Return the lever, 0 to 1, at which the governed propeller settles at a thrust."""
    power = available_power(engine, density)
    low, high = IDLE_POWER, 1.0
    for _ in range(40):
        share = 0.5 * (low + high)
        if governed_thrust(engine.propeller, share * power, speed_mps, density) < thrust_n:
            low = share
        else:
            high = share
    return (0.5 * (low + high) - IDLE_POWER) / (1.0 - IDLE_POWER)


def engine_files(facts: Facts, *, twin: bool) -> dict[str, str]:
    """Return the text of the files of engine and thruster by name; of the turboprop's twin on request."""
    engine = facts.engine
    direct = f'<?xml version="1.0"?>\n<direct name="{THRUSTER}"/>\n'
    if isinstance(engine, DirectEngine):
        return {ENGINE: _direct_xml(engine), THRUSTER: direct}
    if twin:
        return {ENGINE: _twin_xml(engine), THRUSTER: direct}
    return {ENGINE: _turboprop_xml(engine), THRUSTER: _propeller_xml(engine)}


def _direct_xml(engine: DirectEngine) -> str:
    """Write the lesser of static thrust and propeller power over speed, times a factor of height."""
    power, static = engine.power.value * engine.propeller_efficiency.value, engine.static_thrust.value
    speeds = [0.0, *(power / static * step for step in (1.0, 1.1, 1.2, 1.35, 1.5, 1.7, 1.9, 2.2, 2.6, 3.2, 4.0))]
    rows = "".join(f"     {v / FT!r} {min(1.0, power / max(v, 1.0) / static)!r}\n" for v in speeds)
    factors = zip(engine.height_factor.at, engine.height_factor.value, strict=True)
    heights = "".join(f"     {height / FT!r} {factor!r}\n" for height, factor in factors)
    return _thrust_xml(
        static,
        f"""<product>
   <table>
    <independentVar lookup="row">velocities/vt-fps</independentVar>
    <tableData>
{rows}    </tableData>
   </table>
   <table>
    <independentVar lookup="row">position/h-sl-ft</independentVar>
    <tableData>
{heights}    </tableData>
   </table>
  </product>""",
    )


@lru_cache(maxsize=8)
def _twin_xml(engine: TurbopropEngine) -> str:
    """Write the thrust of the governed propeller over speed and density."""
    speeds = (0.0, *(float(v) for v in range(20, 151, 10)))
    densities = tuple(RHO0 * part for part in (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25))
    static = available_thrust(engine, 0.0, RHO0)
    head = " ".join(repr(density / SLUG_FT3) for density in densities)
    rows = "".join(
        f"     {v / FT!r} " + " ".join(repr(available_thrust(engine, v, d) / static) for d in densities) + "\n"
        for v in speeds
    )
    return _thrust_xml(
        static,
        f"""<table>
    <independentVar lookup="row">velocities/vt-fps</independentVar>
    <independentVar lookup="column">atmosphere/rho-slugs_ft3</independentVar>
    <tableData>
     {head}
{rows}    </tableData>
   </table>""",
    )


def _thrust_xml(static_n: float, share: str) -> str:
    """Write a JSBSim turbine with a thrust function, because that one can be trimmed."""
    return f"""<?xml version="1.0"?>
<turbine_engine name="{ENGINE}">
 <milthrust unit="LBS">{static_n / LBF!r}</milthrust>
 <bypassratio>0.0</bypassratio> <tsfc>0.6</tsfc> <bleed>0.0</bleed>
 <idlen1>30.0</idlen1> <idlen2>60.0</idlen2> <maxn1>100.0</maxn1> <maxn2>100.0</maxn2>
 <augmented>0</augmented> <injected>0</injected>
 <function name="IdleThrust"><value>0.0</value></function>
 <function name="MilThrust">
  {share}
 </function>
</turbine_engine>
"""


@lru_cache(maxsize=8)
def _turboprop_xml(engine: TurbopropEngine) -> str:
    """Write power over gas generator speed, turbine speed and density; fuel flow falls to its idle part with the power.

    The torque of a free turbine falls linearly to zero at twice its design speed; a trace of power at rest lets it
    start to turn. The lever commands a part of the power that the air allows, so it never commands more than the flat
    rating.
    """
    low, high = (100.0 * value for value in engine.gas_generator.value)
    rated = engine.power.value / HP
    design = engine.propeller.speed.value * 30.0 / math.pi
    levers = [i / 20.0 for i in range(21)]
    shares = [IDLE_POWER + (1.0 - IDLE_POWER) * lever for lever in levers]
    gas = [low + (high - low) * lever for lever in levers]
    speeds = [design * i / 20.0 for i in range(29)]
    power = "".join(
        f"   {speed!r} "
        + " ".join(repr(rated * share * max(1e-4, speed / design * (2.0 - speed / design))) for share in shares)
        for speed in speeds
    ).replace("   ", "\n   ")
    densities = [RHO0 * i / 20.0 for i in range(4, 27)]
    factor = "".join(
        f"   {density / SLUG_FT3!r} {available_power(engine, density) / engine.power.value!r}\n"
        for density in densities
    )
    idle = engine.idle_fuel_fraction.value
    efficiency = "".join(
        f"   {n1!r} {share / (idle + (1.0 - idle) * share)!r}\n" for n1, share in zip(gas, shares, strict=True)
    )
    return f"""<?xml version="1.0"?>
<turboprop_engine name="{ENGINE}">
 <milthrust unit="LBS">{available_thrust(engine, 0.0, RHO0) / LBF!r}</milthrust>
 <idlen1>{low!r}</idlen1> <maxn1>{high!r}</maxn1>
 <maxpower unit="HP">{rated!r}</maxpower>
 <psfc unit="LBS/HR/HP">{engine.fuel_flow.value / LB * 3600.0 / rated!r}</psfc>
 <n1idle_max_delay>{engine.spool_time.value!r}</n1idle_max_delay>
 <itt_delay>0.05</itt_delay>
 <table name="EnginePowerVC">
  <independentVar lookup="row">atmosphere/rho-slugs_ft3</independentVar>
  <tableData>
{factor}  </tableData>
 </table>
 <table name="EnginePowerRPM_N1" type="internal">
  <tableData>
   {" ".join(repr(n1) for n1 in gas)}{power}
  </tableData>
 </table>
 <table name="ITT_N1" type="internal">
  <tableData>
   0 1
   0 0 0
   100 300 740
  </tableData>
 </table>
 <table name="CombustionEfficiency_N1" type="internal">
  <tableData>
{efficiency}  </tableData>
 </table>
</turboprop_engine>
"""


@lru_cache(maxsize=8)
def _propeller_xml(engine: TurbopropEngine) -> str:
    propeller = engine.propeller
    low, high = (math.degrees(angle) for angle in propeller.pitch_range.value)
    rpm = propeller.speed.value * 30.0 / math.pi
    head = "    " + " ".join(str(angle) for angle in PITCH_DEG) + "\n"
    thrust, power = (
        head
        + "".join(
            f"    {j!r} " + " ".join(repr(float(value)) for value in row) + "\n"
            for j, row in zip(ADVANCE, table, strict=True)
        )
        for table in tables(propeller)
    )
    return f"""<?xml version="1.0"?>
<propeller name="{THRUSTER}" version="1.01">
 <ixx unit="SLUG*FT2">{propeller.inertia.value / SLUG_FT2!r}</ixx>
 <diameter unit="FT">{propeller.diameter.value / FT!r}</diameter>
 <numblades>{propeller.blades.value:.0f}</numblades>
 <minpitch>{low!r}</minpitch> <maxpitch>{high!r}</maxpitch>
 <minrpm>{0.5 * rpm!r}</minrpm> <maxrpm>{rpm!r}</maxrpm>
 <table name="C_THRUST" type="internal">
  <tableData>
{thrust}  </tableData>
 </table>
 <table name="C_POWER" type="internal">
  <tableData>
{power}  </tableData>
 </table>
</propeller>
"""
