"""From a scenario to a recording: the only place where flight, field and sensors meet."""

from collections.abc import Mapping
from pathlib import Path

from magsim import config
from magsim.errors import RequestError
from magsim.loading import LoadedScenario, load_scenario
from magsim.recording import Recording
from magsim.scenario import Scenario
from magsim.simulation.recording import record
from magsim.simulation.simulator import Progress, Simulator, compute_fields

__all__ = ["Progress", "Simulator", "compute_fields", "record", "simulate"]


def simulate(
    scenario: str | Path | LoadedScenario,
    *,
    seed: int | None = None,
    set: Mapping[str, object] | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Fly a scenario, compute the field at each sensor, and record the readings of the instruments.

    Parameters
    ----------
    scenario : str, Path or LoadedScenario
        Name of a shipped scenario, path of a TOML file, or the result of ``load_scenario``.
    seed : int, optional
        Replaces the seed of the scenario.
    set : mapping of str to object, optional
        Values by key path, applied on top of the file in order, as ``magsim generate --set`` does:
        ``{"start.alt_m": 2500, "sensors.scalar[0].noise_nt_rthz": 0.0}``.
    progress : callable, optional
        Called with the name of the step (``"flight"``, ``"field"`` or ``"sensors"``) and its share done, 0 to 1.

    Returns
    -------
    Recording
        With every column of ``magsim.columns`` that the scenario has instruments for. The same scenario, aircraft
        files, version and machine give the same bits.

    Raises
    ------
    RequestError
        If an argument is of the wrong kind, the scenario is wrong, or it does not fit the flight; with file and line
        where there is one.
    DataError
        If the flight diverges or a column is not finite.

    Examples
    --------
    >>> recording = magsim.simulate("calibration_c208b", seed=3, set={"air.turbulence_mps": 1.5})
    """
    if progress is not None and not callable(progress):
        msg = f"progress: is of type {type(progress).__name__}; allowed: a function of a step's name and its share done"
        raise RequestError(msg)
    loaded = _loaded(scenario, _overrides(seed, set))
    return Simulator().simulate(loaded, progress=progress)


def _loaded(scenario: object, overrides: tuple[str, ...]) -> LoadedScenario:
    """Return the scenario that was named, with its overrides."""
    if isinstance(scenario, LoadedScenario):
        return scenario.changed(overrides)
    if isinstance(scenario, str | Path):
        return load_scenario(scenario, overrides)
    if isinstance(scenario, Scenario):
        what = "is a Scenario, without its aircraft and files"
    else:
        what = f"is of type {type(scenario).__name__}"
    msg = (
        f"scenario: {what}; allowed: the name of a shipped scenario, the path of a TOML file, or the LoadedScenario "
        "that load_scenario returns"
    )
    raise RequestError(msg)


def _overrides(seed: int | None, settings: Mapping[str, object] | None) -> tuple[str, ...]:
    """Return the overrides that the arguments of ``simulate`` mean, as ``--set`` takes them."""
    overrides = config.overrides_of({} if settings is None else settings, name="set")
    if seed is None:
        return overrides
    if isinstance(settings, Mapping) and "seed" in settings:
        msg = "seed: is given twice, as an argument and in set; allowed: one of them"
        raise RequestError(msg)
    return (*overrides, *config.overrides_of({"seed": seed}, name="seed"))
