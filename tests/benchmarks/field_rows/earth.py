"""The background: main field, crust, targets; official tables in full where they lie beside the repository."""

import magpylib as magpy
import numpy as np

from magsim.earth import ecef_from_geodetic, igrf, rot_ne_at
from magsim.field.background.crust import crust_of, draw_modes
from magsim.field.background.path import FieldE
from magsim.field.background.prism import prism_field
from magsim.field.background.targets import sources_of
from magsim.field.composition import backgrounds_of
from magsim.field.situation import Passage, used_mounts
from magsim.flight import fly
from magsim.frames import rot_nb_from_attitude, rotate, rotate_back
from magsim.loading import load_scenario
from magsim.streams import stream
from magsim.units import MU0, NT_PER_T
from tests.benchmarks.rows import Row, at_most
from tests.support.crust import gradient_of
from tests.truth import test_igrf as official


def main_field() -> list[Row]:
    """Official values, and what Laplace's equation demands."""
    rows = []
    for name, bound, tables, model in (
        ("wmm2025_max_nt", 0.002, official.wmm_tables(), official.read_wmm2025()),
        ("igrf14_max_nt", 0.1, official.iaga_tables(), None),
    ):
        table = tables[-1].values[0]
        year, alt, lat, lon = table[:, 0], table[:, 1] * 1e3, table[:, 2], np.radians(table[:, 3])
        lat = np.radians(lat if model else 90.0 - lat)  # IAGA's table has colatitudes
        error = igrf(lat, lon, alt, year, model=model) - table[:, 4:7]
        rows.append(at_most(name, float(np.abs(error).max()), "nT", bound))
    _, gradient = igrf(*official.random_places(1000), gradient=True)
    return rows + laplace("main", gradient)


def laplace(name: str, gradient: np.ndarray) -> list[Row]:
    """Trace and asymmetry of gradients relative to their largest entry."""
    biggest = np.abs(gradient).max(axis=(1, 2))
    trace = np.abs(np.trace(gradient, axis1=1, axis2=2)) / biggest
    odd = np.abs(gradient - np.swapaxes(gradient, 1, 2)).max(axis=(1, 2)) / biggest
    return [
        at_most(f"{name}_gradient_trace", float(trace.max()), "1", 1e-12),
        at_most(f"{name}_gradient_asymmetry", float(odd.max()), "1", 1e-12),
    ]


def crust_field() -> list[Row]:
    """Trace and symmetry, and the gradient against differences of the field."""
    modes = draw_modes(
        stream(1, "crust/modes"),
        shortest_m=116.7,
        longest_m=50_000.0,
        exponent=3.0,
        depth_m=100.0,
        rms_nt=60.0,
        count=256,
    )
    random, step = np.random.default_rng(5), 0.1
    places = np.column_stack([random.uniform(-40e3, 40e3, (1000, 2)), -random.uniform(0.0, 800.0, 1000)])
    gradient = gradient_of(modes, places)
    moves = [
        (modes.field(places + step * unit) - modes.field(places - step * unit)) / (2.0 * step) for unit in np.eye(3)
    ]
    error = np.abs(np.stack(moves, axis=2) - gradient).max() / np.abs(gradient).max()
    rows = laplace("crust", gradient)
    rows[0] = at_most("crust_trace", rows[0].value, "1", 1e-12)
    return [*rows, at_most("crust_gradient_difference", float(error), "1", 1e-5)]


def prism() -> list[Row]:
    """The closed form against an independent library."""
    half, magnetization = np.array([750.0, 10.0, 200.0]), np.array([0.3, -0.5, 1.0])
    points = np.random.default_rng(4).normal(size=(3000, 3)) * half * 3.0
    points = points[(np.abs(points) > 1.01 * half).any(axis=1)]
    magnet = magpy.magnet.Cuboid(dimension=2.0 * half, magnetization=magnetization)
    theirs = magnet.getB(points) * NT_PER_T * (MU0 / magpy.mu_0)
    error = np.linalg.norm(prism_field(half, magnetization, points) - theirs, axis=1) / np.linalg.norm(theirs, axis=1)
    return [at_most("prism_oracle_error", float(error.max()), "1", 1e-9)]


def splines() -> list[Row]:
    """Crust and targets of a line in moderate turbulence, against each mount's own place at every tenth sample."""
    short = ("pattern.lines=1", "pattern.ties=0", "recording.train_circuits=[1]")
    rough = ("air.turbulence_mps=0.0", "air.turbulence_severity=4")
    loaded = load_scenario("geology_c208b", (*short, *rough))
    scenario, aircraft, ground = loaded.scenario, loaded.aircraft, loaded.ground
    flight = fly(scenario, aircraft, ground=ground)
    background = backgrounds_of(scenario, flight, ground)["carrier"]
    reference_b = flight.carrier.reference_b
    arms_b = {mount: np.array(aircraft.mounts[mount]) - reference_b for mount in used_mounts(scenario)}
    parts, sources = background.at(arms_b), sources_of(scenario, ground)
    wanted = {"crust": [crust_of(scenario, ground).field_e], "target": [source.field_e for source in sources]}
    return [
        at_most(f"{name}_spline_nt", _missed(background.passage, parts[name], arms_b, fields_e), "nT", 1e-4)
        for name, fields_e in wanted.items()
    ]


def _missed(passage: Passage, part: np.ndarray, arms_b: dict[str, np.ndarray], fields_e: list[FieldE]) -> float:
    """Largest difference [nT] of a part from fields evaluated at each mount; the filters' run-in is left out."""
    keep = slice(480, -480, 10)
    path = passage.path.at(passage.time_s[keep])
    rot_nb, rot_ne = rot_nb_from_attitude(path.attitude), rot_ne_at(path.lat_rad, path.lon_rad)
    center_e = ecef_from_geodetic(path.lat_rad, path.lon_rad, path.alt_m)
    worst = 0.0
    for p, arm_b in enumerate(arms_b.values()):
        places_e = center_e + rotate_back(rot_ne, np.einsum("nij,j->ni", rot_nb, arm_b))
        exact_e = sum(field_e(places_e) for field_e in fields_e)
        exact = rotate_back(rot_nb, rotate(rot_ne, exact_e))
        worst = max(worst, float(np.abs(part[p, keep] - exact).max()))
    return worst


def rows() -> list[Row]:
    """All of them."""
    return [*main_field(), *crust_field(), *prism(), *splines()]
