"""Tolles-Lawson beside other people's: MagNav.jl's matrix by its published equations, deinterf on the same rows."""

import numpy as np
import pytest
from deinterf.compensator.tmi.linear import Terms
from deinterf.compensator.tmi.linear import TollesLawson as Deinterf
from deinterf.foundation.sensors import MagVector
from deinterf.foundation.sensors import Tmi as Reading
from deinterf.utils.data_ioc import DataIoC

from magsim import signals
from magsim.compensation import TollesLawson
from magsim.compensation.columns import TollesLawsonColumns, tolles_lawson_columns
from magsim.compensation.columns.tolles_lawson import term_names, term_units
from tests.support import scores
from tests.support.worlds import VECTOR, World, calibration

BT_SCALE_NT = 50_000.0
"""What MagNav.jl divides induced and eddy columns by."""

RATE_HZ = 10.0


def flux_of(recording):
    return np.column_stack([recording[f"flux_cabin_{axis}_nt"] for axis in "xyz"])


def magnav(flux):
    """Its 18 columns under our names, written down from the equations of its model.

    With B_t the length of B: permanent B_i / B_t; induced B_i B_j / (B_t B_scale); eddy B_i dB_j / (B_t B_scale), where
    dB is by row and not by second: half of the next row minus the one before, one-sided at the ends.
    """
    total = np.sqrt(flux[:, 0] ** 2 + flux[:, 1] ** 2 + flux[:, 2] ** 2)
    slope = np.empty_like(flux)
    slope[1:-1] = (flux[2:] - flux[:-2]) / 2.0
    slope[0], slope[-1] = flux[1] - flux[0], flux[-1] - flux[-2]
    out = {f"u{i + 1}": flux[:, i] / total for i in range(3)}
    for i in range(3):
        for j in range(i, 3):
            out[f"B u{i + 1} u{j + 1}"] = flux[:, i] * flux[:, j] / (total * BT_SCALE_NT)
        for j in range(3):
            out[f"u{i + 1} B{j + 1}'"] = flux[:, i] * slope[:, j] / (total * BT_SCALE_NT)
    return out


def test_our_columns_are_those_of_magnav_but_for_their_units():
    """Field strength row by row, eddy columns of the field's derivative; coefficients in nT, 1 and s."""
    recording = calibration(VECTOR)
    flux = flux_of(recording)
    theirs = magnav(flux)
    made = TollesLawsonColumns(16, "cabin", eddy="field")(recording)
    factor = {"nT": 1.0, "1": BT_SCALE_NT, "s": BT_SCALE_NT * RATE_HZ}
    assert set(theirs) - set(made.names) == {"B u2 u2", "u2 B2'"}
    for name, unit, column in zip(made.names, made.units, made.matrix.T, strict=True):
        np.testing.assert_allclose(column, factor[unit] * theirs[name], rtol=1e-7, atol=1e-9 * np.abs(column).max())
    # all 18, before the trace is taken from columns that are scaled row by row
    length = np.linalg.norm(flux, axis=1)
    rates = np.gradient(flux, 1.0 / RATE_HZ, axis=0) / length[:, None]
    eighteen = tolles_lawson_columns(flux / length[:, None], rates, length, 18)
    for name, unit, column in zip(term_names(18, "field"), term_units(18), eighteen.T, strict=True):
        np.testing.assert_allclose(column, factor[unit] * theirs[name], rtol=1e-7, atol=1e-9 * np.abs(column).max())


def test_least_squares_on_the_columns_of_magnav_leave_the_same():
    """Its fit without ridge: band-passed columns and reading; of its 18 columns the 16 that are independent."""
    recording = calibration(World())
    theirs = magnav(flux_of(recording))
    matrix = np.column_stack([column for name, column in theirs.items() if name not in ("B u2 u2", "u2 B2'")])
    learned = recording["split"] < 2
    table = np.column_stack([matrix, recording["mag_cabin_nt"]])[learned]
    band = signals.band_pass(table, RATE_HZ)[300:-300]
    size = band[:, :-1].std(axis=0)
    found = np.linalg.lstsq(band[:, :-1] / size, band[:, -1])[0] / size
    settings = {"target": "measured", "scale": "sample", "eddy": "field", "solver": "least_squares"}
    method = TollesLawson(terms=16, **settings).fit(recording)
    ours = method.interference(recording) - method.offset_nt_
    apart = (ours - matrix @ found)[learned]
    assert scores.band_std(apart, RATE_HZ) < 1e-6


def test_what_is_left_of_the_reading_is_that_of_deinterf_within_a_hundredth():
    recording = calibration(World()).take(slice(0, 6000))
    flux, reading = flux_of(recording), recording["mag_cabin_nt"]
    data = DataIoC().with_data(MagVector(bx=flux[:, 0], by=flux[:, 1], bz=flux[:, 2]))
    theirs = Deinterf(terms=Terms.Terms_16).fit(data, Reading(tmi=reading))
    left = scores.band_std(reading - np.asarray(theirs.predict(data)).ravel(), RATE_HZ)
    ours = TollesLawson(terms=16, target="measured", scale="sample").fit(recording)
    own = scores.band_std(reading - ours.interference(recording), RATE_HZ)
    assert own == pytest.approx(left, rel=0.01)
    assert own < 0.01 * scores.band_std(reading, RATE_HZ)
