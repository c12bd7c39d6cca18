"""Instances of JSBSim: a model loaded with the integrators and the step of an aircraft."""

import math
import tempfile
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import jsbsim

from magsim.aircraft.facts import Facts
from magsim.errors import DataError
from magsim.flight.model.airframe import STILL_AIR, write_model
from magsim.flight.model.rates import INTEGRATORS, integrators_for


@lru_cache(maxsize=1)
def silence() -> None:
    """Stop JSBSim's own printing, once in a process and before its first instance."""
    logger = jsbsim.DefaultLogger()
    logger.set_min_level(jsbsim.LogLevel.FATAL)
    jsbsim.set_logger(logger)


def load(
    facts: Facts,
    step_hz: int,
    *,
    twin: bool = False,
    air_xml: str = STILL_AIR,
    turbulent: bool = False,
    hook_b: tuple[float, float, float] | None = None,
) -> jsbsim.FGFDMExec:
    """Load a fresh instance of an aircraft's flight model, or of its twin with direct thrust for the trim.

    Its step rate is set before its filters are built.

    ``air_xml`` is the system of shear and gusts; without it there are none. ``turbulent`` says that its air also turns.
    ``hook_b`` is where a rope pulls.
    """
    silence()
    with tempfile.TemporaryDirectory(prefix="magsim-") as name:
        folder = Path(name).resolve()
        write_model(facts, folder, "aircraft", twin=twin, air_xml=air_xml, turbulent=turbulent, hook_b=hook_b)
        return load_from(folder, "aircraft", 1.0 / step_hz, integrators_for(facts, step_hz))


def load_from(folder: Path, name: str, step_s: float, integrators: Mapping[str, int] = INTEGRATORS) -> jsbsim.FGFDMExec:
    """Load a fresh instance of the model ``aircraft/<name>/<name>.xml`` below a folder, with accurate integrators."""
    silence()
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    fdm.set_dt(step_s)
    loaded = fdm.load_model_with_paths(name, str(folder / "aircraft"), str(folder / "engine"), str(folder / "systems"))
    if not loaded or not math.isclose(fdm.get_delta_t(), step_s, rel_tol=1e-12):
        msg = f"JSBSim {fdm.get_version()} did not load the flight model of {name}"
        raise DataError(msg)
    fdm.disable_output()
    for group, order in integrators.items():
        fdm[f"simulation/integrator/{group}"] = order
    return fdm


def node_of(manager: jsbsim.FGPropertyManager, name: str) -> jsbsim.FGPropertyNode:
    """Return a property of an instance by its name.

    Raises
    ------
    DataError
        If there is none.
    """
    node = manager.get_node(name)
    if node is None:
        msg = f"JSBSim has no property {name}"
        raise DataError(msg)
    return node
