import numpy as np
import pytest

from magsim.sensors import Acquisition


def grid(start, stop, rate=120.0):
    return np.arange(round(start * rate), round(stop * rate) + 1) / rate


def test_rows_from_zero_to_the_duration():
    acquisition = Acquisition.of(grid(-2.0, 12.0), 10.0, 120.0, 10.0)
    assert acquisition.rows == 101
    np.testing.assert_array_equal(acquisition.time_s, np.arange(101) / 10)
    slow = np.sin(0.5 * grid(-2.0, 12.0))
    np.testing.assert_allclose(acquisition(slow), np.sin(0.5 * acquisition.time_s), atol=1e-4)
    assert (acquisition.rate_in_hz, acquisition.rate_out_hz) == (120.0, 10.0)


def test_a_part_of_a_row_is_no_row():
    assert Acquisition.of(grid(-2.0, 12.0), 9.99, 120.0, 10.0).rows == 100


@pytest.mark.parametrize(("start", "stop"), [(-0.5, 12.0), (-2.0, 10.5)])
def test_run_in_is_asked_for(start, stop):
    with pytest.raises(ValueError, match=r"do not reach 1\.09167 s beyond the rows from 0 to 10 s"):
        Acquisition.of(grid(start, stop), 10.0, 120.0, 10.0)


@pytest.mark.parametrize("times", [grid(-2.0, 12.0) + 0.004, grid(-2.0, 12.0, 100.0)])
def test_another_grid_is_refused(times):
    with pytest.raises(ValueError, match="not spaced by 1/120 s with one at time 0"):
        Acquisition.of(times, 10.0, 120.0, 10.0)
