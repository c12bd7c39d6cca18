"""magsim: flight, magnetic interference, recordings and compensation with known truth.

This page fixes names, units and frames for the whole project; ``docs/glossary.md`` fixes the words.

Frames (suffixes)
-----------------
======  ==================================================================================
``_e``  Earth-centered Earth-fixed: Z to the north pole, X to latitude 0, longitude 0
``_n``  local north-east-down at the body's own position
``_b``  aircraft body: x forward, y right (starboard), z down
``_t``  towed-bird body: x forward, y right, z down
``_s``  sensor axes
``_m``  mesh and structural axes: x aft, y right, z up
======  ==================================================================================

A rotation is named by its two frames: ``v_n = rot_nb @ v_b``. Attitude is ``roll, pitch, heading``
(turned in the order heading, pitch, roll; heading clockwise from true north), stored as ``(n, 3)`` [rad].
The origin of body coordinates is a fixed structural datum that the aircraft file names, never the
moving center of gravity.

Units
-----
SI, radians and seconds inside. Magnetic flux density is in nT and magnetic moment in A m^2 everywhere
between modules; only the field solvers use tesla, ampere and ohm inside. Feet, slugs and pounds live in
``magsim.flight.model`` and the commands of its pilot alone, the interface to JSBSim. In files every name
carries its unit as a suffix:
``_m _mps _mps2 _deg _dps _s _nt _am2 _hz _a _v _pa _c _kg _n _norm``. Heights are above the WGS-84 ellipsoid.

Time
----
``time_s`` counts from the first recorded row; the start in UTC stands in the scenario. Rows are instants:
every column of a row belongs to the same time tag.

Words
-----
``n`` samples, ``s`` sensors or mounts, ``k`` modes or sources; vectors are rows, ``(n, 3)``.
*Background* or *earth* is the ambient field without the aircraft; *interference* is what the platform adds to
the scalar reading: as difference of norms (``interference_*``), and as projection on the direction of the
background (``projection_*``). *Truth* columns are known to the simulator alone; *labels* are noise-free.

Types
-----
``Scenario`` -> ``Flight`` -> ``FieldTruth`` -> ``Recording`` -> ``Compensator`` -> ``Report``; see
``docs/architecture.md``.
"""

from importlib import import_module

__version__ = "0.1.0"

_EXPORTS = {
    "Dataset": "magsim.dataset",
    "Recording": "magsim.recording",
    "Scenario": "magsim.scenario",
    "load_scenario": "magsim.loading",
    "Aircraft": "magsim.aircraft",
    "load_aircraft": "magsim.aircraft",
    "simulate": "magsim.simulation",
    "Compensator": "magsim.compensation",
    "CheckReport": "magsim.compensation",
    "FitContext": "magsim.compensation",
    "TollesLawson": "magsim.compensation",
    "TorchCompensator": "magsim.compensation.networks",
    "check_compensator": "magsim.compensation",
    "Report": "magsim.benchmark",
    "evaluate": "magsim.benchmark",
    "read_recordings": "magsim.recording",
}

__all__ = [
    "Aircraft",
    "CheckReport",
    "Compensator",
    "Dataset",
    "FitContext",
    "Recording",
    "Report",
    "Scenario",
    "TollesLawson",
    "TorchCompensator",
    "__version__",
    "check_compensator",
    "evaluate",
    "load_aircraft",
    "load_scenario",
    "read_recordings",
    "simulate",
]


def __getattr__(name: str) -> object:
    """Import a public name when it is first asked for, so that ``import magsim`` stays light."""
    if name in _EXPORTS:
        return getattr(import_module(_EXPORTS[name]), name)
    msg = f"module 'magsim' has no attribute {name!r}"
    raise AttributeError(msg)


def __dir__() -> list[str]:
    """List the public names, imported or not."""
    return sorted(__all__)
