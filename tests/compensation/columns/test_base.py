"""Column sets side by side."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.columns import AttitudeColumns, Joined, TollesLawsonColumns, require
from magsim.errors import DataError, RequestError
from tests.support.worlds import VECTOR, calibration

SETS = (TollesLawsonColumns(16, "cabin"), AttitudeColumns())


def test_columns_names_and_units_are_in_the_order_of_the_sets():
    r = calibration(VECTOR)
    parts = [one(r) for one in SETS]
    whole = Joined(SETS)(r)
    np.testing.assert_array_equal(whole.matrix, np.hstack([part.matrix for part in parts]))
    assert whole.names == parts[0].names + parts[1].names
    assert whole.units == parts[0].units + parts[1].units
    np.testing.assert_array_equal(Joined(SETS[:1])(r).matrix, parts[0].matrix)


def test_each_family_that_is_read_is_listed_once():
    assert Joined((*SETS, *SETS)).reads == ("flux_{sensor}_{axis}_nt", "ins_{angle}_deg")


def test_values_that_are_not_finite_are_named_with_their_time():
    r = calibration(VECTOR)
    pitch = r["ins_pitch_deg"].copy()
    pitch[250] = np.nan
    with pytest.raises(DataError, match=r"recording 'world': pitch is not finite at 25 s"):
        Joined(SETS)(replace(r, data={**r.data, "ins_pitch_deg": pitch}))


def test_all_missing_columns_are_named():
    r = calibration(VECTOR)
    require(r, ["mag_cabin_nt", "ins_roll_deg"])
    with pytest.raises(RequestError, match=r"recording 'world' has no column mag_wing_nt, baro_nothing$"):
        require(r, ["mag_wing_nt", "mag_cabin_nt", "baro_nothing"])
