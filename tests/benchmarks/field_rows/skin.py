"""Eddy currents: shells and loops against exact answers, time stepping, and the skin of the C208B."""

import time

import numpy as np
from scipy.special import ellipe, ellipk
from threadpoolctl import threadpool_limits

from magsim.aircraft import load_aircraft
from magsim.aircraft.magnetics import Skin
from magsim.field import AircraftResponse, load_response
from magsim.field.geometry.meshes import TriangleMesh, disc_grid, icosphere
from magsim.field.metal.coils import Loop, inductance
from magsim.field.metal.eddy import states
from magsim.field.metal.skin.mesh import outline
from magsim.field.metal.skin.model import compute_skin, shells_of, truncation_error
from magsim.field.metal.skin.shells import ThinShells, driven_modes
from magsim.units import MU0
from tests.benchmarks.rows import Row, at_most, stated
from tests.support.skins import time_constants

RADIUS_M, CONDUCTANCE_S = 0.8, 1.74e4
LENGTH_M, SPAN_M, HEIGHT_M = 12.68, 15.87, 4.52
"""Published: facts.toml; height 14 ft 10 in (Cessna, Specification and Description of the 208)."""

NOWHERE = np.zeros((0, 3))


def _shell() -> list[Row]:
    shell = ThinShells(icosphere(3, RADIUS_M, keep="area"), CONDUCTANCE_S)
    exact = MU0 * CONDUCTANCE_S * RADIUS_M / np.array([3.0, 5.0, 7.0])
    tau = time_constants(shell, 15)
    rows = [at_most("shell_tau1_error_pct", 100.0 * np.abs(tau[:3] / exact[0] - 1.0).max(), "%", 0.2)]
    for degree, first in ((2, 3), (3, 8)):
        error = np.abs(tau[first : first + 2 * degree + 1] / exact[degree - 1] - 1.0).max()
        rows.append(stated(f"shell_tau{degree}_error_pct", 100.0 * error, "%"))
    modes = driven_modes(shell, 4)
    for frequency_hz, name in ((1.0, "shell_ac_moment_error_pct"), (100.0, "shell_ac_moment_100hz_error_pct")):
        omega = 2j * np.pi * frequency_hz
        moment = np.einsum("ki,k,kj->ij", modes.drive, -omega / (1.0 + omega * modes.tau_s), modes.drive)
        answer = -2.0 * np.pi * RADIUS_M**3 / MU0 * omega * exact[0] / (1.0 + omega * exact[0])
        rows.append(at_most(name, 100.0 * np.abs(moment / answer - np.eye(3)).max(), "%", 0.3))
    return rows


def _disc() -> Row:
    flat, triangles = disc_grid(16, RADIUS_M)
    disc = ThinShells(TriangleMesh(np.column_stack([flat, np.zeros(len(flat))]), triangles), CONDUCTANCE_S)
    moment = float((driven_modes(disc, 1).drive[:, 2] ** 2).sum())
    return stated(
        "disc_slow_moment_error_pct", 100.0 * abs(8.0 * moment / (np.pi * CONDUCTANCE_S * RADIUS_M**4) - 1.0), "%"
    )


def _circle(radius: float, height: float, sides: int = 64) -> Loop:
    """Regular polygon of the area of a circle."""
    corner = radius * np.sqrt(np.pi / (sides * np.sin(np.pi / sides) * np.cos(np.pi / sides)))
    angle = 2.0 * np.pi * np.arange(sides) / sides
    return Loop(np.column_stack([corner * np.cos(angle), corner * np.sin(angle), np.full(sides, height)]), 0.001)


def _loops() -> Row:
    """Coaxial circles as polygons of 64 corners against Maxwell, Treatise, art. 701."""
    a, b, z = 1.0, 0.6, 0.5
    m = 4.0 * a * b / ((a + b) ** 2 + z**2)
    k = np.sqrt(m)
    exact = MU0 * np.sqrt(a * b) * ((2.0 / k - k) * ellipk(m) - 2.0 / k * ellipe(m))
    return at_most("loop_mutual_error", abs(inductance(_circle(a, 0.0), _circle(b, z)) / exact - 1.0), "1", 1e-5)


def _hold(response: AircraftResponse, frequency_hz: float = 0.5, rate_hz: float = 120.0) -> float:
    """Largest error of the stepped eddy field over its amplitude, cabin and stinger, three directions, in percent."""
    rows, omega = response.rows(("cabin_center", "sgl_mag_1")), 2.0 * np.pi * frequency_hz
    time_s = np.arange(int(10.0 * rate_hz)) / rate_hz
    settled, worst = time_s > 2.0, 0.0
    for axis in np.eye(3):
        rate = omega * np.cos(omega * time_s)[:, None] * axis
        got = np.einsum("sik,nk->nsi", response.field[rows], states(response.modes, rate, 1.0 / rate_hz))
        gain = -1j * omega / (1.0 + 1j * omega * response.tau_s)
        phasor = np.einsum("sik,k,k->si", response.field[rows], gain, response.drive @ axis)
        exact = np.imag(phasor[None] * np.exp(1j * omega * time_s)[:, None, None])
        error = np.linalg.norm(got - exact, axis=-1)[settled].max(axis=0)
        worst = max(worst, float((error / np.linalg.norm(phasor, axis=-1)).max()))
    return 100.0 * worst


def _size(skin: Skin, ground: float) -> list[Row]:
    low, high = outline(skin).extent_m
    sizes = (
        ("skin_span_error_pct", high[1] - low[1], SPAN_M),
        ("skin_length_error_pct", high[0] - low[0], LENGTH_M),
        ("skin_height_error_pct", ground - low[2], HEIGHT_M),
    )
    return [at_most(name, 100.0 * abs(size / published - 1.0), "%", 2.0) for name, size, published in sizes]


def rows() -> list[Row]:
    """All figures; the skin of half the element has eleven thousand triangles and takes half a minute."""
    aircraft = load_aircraft("c208b")
    skin, places = aircraft.magnetics.skin, np.array(list(aircraft.mounts.values()))
    with threadpool_limits(limits=1):
        out = [*_shell(), _disc(), _loops()]
        response = load_response(aircraft, "skin")
        out.append(at_most("hold_error_pct", _hold(response), "%", 0.1))
        out += _size(skin, max(wheel.value[2] for wheel in aircraft.facts.geometry.wheels))
        start = time.process_time()
        model = compute_skin(skin, places)
        out.append(at_most("skin_cpu_s", time.process_time() - start, "s", 30.0))
        out.append(stated("skin_triangles", len(model.triangles), "1"))
        out.append(at_most("skin_truncation_error_pct", 100.0 * truncation_error(skin, places, places).max(), "%", 0.1))
        tau = [
            time_constants(shells_of(skin, NOWHERE, element_m=element), 1)[0]
            for element in (skin.element_m, 0.5 * skin.element_m)
        ]
    out.append(stated("skin_tau_slowest_ms", 1e3 * tau[0], "ms"))
    out.append(at_most("skin_tau_change_pct", 100.0 * abs(tau[1] / tau[0] - 1.0), "%", 2.0))
    return out
