"""The crust against its own potential, differentiated in Earth-fixed axes, and against what its spectrum demands."""

from itertools import pairwise

import numpy as np
import pytest

from magsim.earth import LocalFrame, ecef_from_geodetic, rot_ne_at
from magsim.field.background.crust import CrustField, CrustModes, draw_modes
from magsim.streams import stream
from tests.support.crust import gradient_of

SETTINGS = {
    "shortest_m": 116.7,
    "longest_m": 50_000.0,
    "exponent": 3.0,
    "depth_m": 100.0,
    "rms_nt": 60.0,
    "count": 256,
}


def drawn(seed: int = 1, **settings: float) -> CrustModes:
    return draw_modes(stream(seed, "crust/modes"), **(SETTINGS | settings))


def potential(modes: CrustModes, place_n: np.ndarray) -> np.ndarray:
    """Reference, section 2.1, in its axes east, north, up: sum A/k exp(-k z) cos(kx x + ky y + p)."""
    north, east, down = place_n.T
    kx, ky = modes.wavenumber * modes.direction[:, 1], modes.wavenumber * modes.direction[:, 0]
    waves = np.cos(np.outer(east, kx) + np.outer(north, ky) + modes.phase)
    size = modes.amplitude_nt / modes.wavenumber
    return (size * np.exp(np.outer(down, modes.wavenumber)) * waves).sum(axis=1)


@pytest.fixture(scope="module")
def places() -> np.ndarray:
    random = np.random.default_rng(5)
    return np.column_stack([random.uniform(-40e3, 40e3, (300, 2)), -random.uniform(0.0, 800.0, 300)])


def test_gradient_is_symmetric_and_without_trace(places):
    gradient = gradient_of(drawn(), places)
    biggest = np.abs(gradient).max(axis=(1, 2))
    assert (np.abs(np.trace(gradient, axis1=1, axis2=2)) / biggest).max() < 1e-12
    assert np.abs(gradient - np.swapaxes(gradient, 1, 2)).max() == 0.0


def test_field_and_gradient_are_derivatives_of_the_potential(places):
    modes, step = drawn(), 0.5
    field, gradient = modes.field(places), gradient_of(modes, places)
    np.testing.assert_allclose(field, modes.field(places), rtol=0, atol=1e-11)
    for axis, unit in enumerate(np.eye(3)):
        ahead, behind = (places + sign * step * unit for sign in (1.0, -1.0))
        slope = -(potential(modes, ahead) - potential(modes, behind)) / (2.0 * step)
        np.testing.assert_allclose(slope, field[:, axis], rtol=0, atol=1e-5 * np.abs(field).max())
        numeric = (modes.field(ahead) - modes.field(behind)) / (2.0 * step)
        np.testing.assert_allclose(numeric, gradient[:, :, axis], rtol=0, atol=1e-4 * np.abs(gradient).max())


def test_vectors_stand_right_far_from_the_start():
    """40 km away north, east and down have turned by 0.4 degrees: the potential's slopes along the axes there."""
    crust = CrustField(LocalFrame(np.radians(52.2), np.radians(9.8), 124.0), drawn(rms_nt=1000.0))
    lat, lon, alt = np.radians([52.45, 51.9]), np.radians([10.3, 9.3]), np.array([800.0, 700.0])
    position_e, rot_ne, step = ecef_from_geodetic(lat, lon, alt), rot_ne_at(lat, lon), 0.5
    got = np.einsum("nij,nj->ni", rot_ne, crust.field_e(position_e))
    for axis in range(3):
        ahead, behind = (
            potential(crust.modes, crust.frame.place(position_e + sign * step * rot_ne[:, axis]))
            for sign in (1.0, -1.0)
        )
        np.testing.assert_allclose(-(ahead - behind) / (2.0 * step), got[:, axis], rtol=0, atol=1e-3)
    unturned = crust.modes.field(crust.frame.place(position_e))
    assert np.abs(unturned - got).max() > 1.0


def test_rms_is_as_asked_and_power_falls_as_asked():
    modes = drawn(count=4096, depth_m=0.0)
    assert 0.5 * np.sum(modes.amplitude_nt**2) == pytest.approx(60.0**2, rel=1e-12)
    # Isotropic density: power of an octave over the area of its ring of wavenumbers.
    k, edges = modes.wavenumber, 2.0 * np.pi / 40_000.0 * 2.0 ** np.arange(9)
    density = [
        np.sum(modes.amplitude_nt[(k >= low) & (k < high)] ** 2) / (high**2 - low**2) for low, high in pairwise(edges)
    ]
    slopes = np.diff(np.log2(density))
    np.testing.assert_allclose(slopes, -3.0, atol=0.1)


def test_sources_at_a_depth_are_the_same_field_from_higher_up():
    """Upward continuation: sources 300 m deep, seen at 0, are those 100 m deep seen at 200 m, to scale."""
    low, deep = drawn(depth_m=100.0), drawn(depth_m=300.0)
    ratio = deep.amplitude_nt / (low.amplitude_nt * np.exp(-200.0 * low.wavenumber))
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-10)


def test_rms_over_an_area():
    """Over 200 longest waves the mean square of vertical and of both horizontal components is that of the modes."""
    modes = drawn(longest_m=5_000.0)
    random = np.random.default_rng(3)
    places = np.column_stack([random.uniform(-500e3, 500e3, (20_000, 2)), np.zeros(20_000)])
    square = np.mean(modes.field(places) ** 2, axis=0)
    assert np.sqrt(square[2]) == pytest.approx(60.0, rel=0.02)
    assert np.sqrt(square[0] + square[1]) == pytest.approx(60.0, rel=0.02)


def test_bounds_hold(places):
    modes = drawn()
    gradient = gradient_of(modes, places)
    assert (np.abs(gradient).max(axis=(1, 2)) <= modes.steepest(-places[:, 2], 1)).all()
    order = np.argsort(-places[:, 2])
    exact = [np.sum(modes.amplitude_nt * modes.wavenumber**4 * np.exp(modes.wavenumber * z)) for z in places[order, 2]]
    assert (modes.steepest(-places[order, 2], 4) >= np.array(exact) * (1.0 - 1e-12)).all()


def test_same_seed_same_crust_whatever_else_is_drawn(places):
    one, other, next_ = drawn(1), drawn(1, depth_m=250.0), drawn(2)
    np.testing.assert_array_equal(one.phase, other.phase)
    np.testing.assert_array_equal(one.wavenumber, other.wavenumber)
    assert np.abs(one.phase - next_.phase).max() > 0.1
    np.testing.assert_array_equal(one.field(places), drawn(1).field(places))


def test_chunks_do_not_matter(places):
    modes = drawn()
    np.testing.assert_allclose(modes.field(places)[7:9], modes.field(places[7:9]), rtol=0, atol=1e-11)
