"""What a fit is fitted to, and the rows that a fit takes."""

from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation.targets import Label, Reading, reading_rows, rows_to_fit
from magsim.dataset import training_rows
from magsim.errors import DataError, RequestError
from magsim.recording import Recording

TIME_S = np.arange(40) / 10.0
DATA = {"mag_cabin_nt": 45_000.0 + TIME_S, "mag_wing_nt": 44_000.0 - TIME_S, "interference_cabin_nt": np.sin(TIME_S)}


def recording(name="r", **columns):
    return Recording(name, TIME_S, {**DATA, **columns})


def test_targets_are_the_label_and_the_reading():
    r = recording()
    np.testing.assert_array_equal(Label().values(r, "cabin"), DATA["interference_cabin_nt"])
    np.testing.assert_array_equal(Reading().values(r, "wing"), DATA["mag_wing_nt"])
    assert not Label().measured
    assert Reading().measured


def test_missing_labels_name_the_targets_that_need_none():
    with pytest.raises(RequestError, match=r"'r' has no label 'interference_wing_nt': .*'crossings' or 'reference'"):
        Label().values(recording(), "wing")


@pytest.mark.parametrize(
    ("target", "column", "text"),
    [(Label(), "interference_cabin_nt", "interference_cabin_nt"), (Reading(), "mag_cabin_nt", "scalar .*cab")],
)
def test_values_that_are_not_finite_are_refused_with_their_time(target, column, text):
    broken = DATA[column].copy()
    broken[12] = np.nan
    with pytest.raises(DataError, match=rf"recording 'r': {text}.* is not finite at 1\.2 s"):
        target.values(recording(**{column: broken}), "cabin")


def test_only_a_fit_to_the_reading_cuts_dropouts():
    valid = np.where((TIME_S > 1.05) & (TIME_S < 1.55), 0.0, 1.0)
    training = training_rows([recording(mag_cabin_valid=valid)], "cabin")
    (whole,) = rows_to_fit(Label(), training, "tl16")
    assert whole is training.recordings[0]
    (cut,) = rows_to_fit(Reading(), training, "tl16")
    np.testing.assert_array_equal(cut.time_s, TIME_S[valid == 1.0])
    assert [len(piece) for piece in cut.pieces()] == [11, 24]


def test_rows_that_read():
    whole, other = recording(), recording("other", mag_cabin_valid=np.zeros(40))
    # one that reads throughout is the same object, one without a reading is left out, and so is a single row
    (kept,) = reading_rows([whole, other], "cabin")
    assert kept is whole
    single = replace(other, data={**other.data, "mag_cabin_valid": np.eye(40)[3]})
    assert reading_rows([whole, single], "cabin") == [whole]
    with pytest.raises(DataError, match="'cabin' does not read in any row of 'other', 'other' that is to be learned"):
        reading_rows([other, single], "cabin")
    assert reading_rows([other], "wing") == [other]
