"""Samples and statistics of data sets: written and read again, and compared with numpy."""

import numpy as np
import pytest

from magsim import Dataset, columns
from magsim.errors import DataError
from magsim.generation.description import samples, statistics
from magsim.generation.description.samples import SAMPLES, ColumnSample


def test_every_unit_has_a_tolerance():
    assert {family.unit for family in columns.FAMILIES} <= set(samples.TOLERANCES)


def test_angles_are_compared_around_the_circle():
    assert samples.distance("ins_heading_deg", 359.9999, 0.0001) == pytest.approx(0.0002)
    assert samples.distance("mag_cabin_nt", 360.0, 0.0) == 360.0


def test_samples_are_read_as_they_are_written(tmp_path):
    kept = {
        ("a", "mag_cabin_nt"): ColumnSample("ab" * 8, -12.5, (45000.123457, -0.25)),
        ("a", "leg"): ColumnSample("cd" * 8, 3.0, (1.0, 2.0)),
    }
    (tmp_path / SAMPLES).write_text(samples.to_text(kept))
    assert samples.read(tmp_path / SAMPLES) == kept


@pytest.mark.parametrize(
    ("module", "line"),
    [
        (samples, "a,mag_cabin_nt,00,x"),
        (samples, "a,no_such_column,00,1"),
        (samples, "a"),
        (samples, "," * 200_000),
        (statistics, "a.h5,train,mag_cabin_nt,nT,5,1,2,3"),
        (statistics, "a.h5,train,mag_cabin_nt,nT,five,1,2,3,4"),
    ],
)
def test_bad_lines_are_reported(tmp_path, module, line):
    (tmp_path / "table.csv").write_text(f"header\n{line}\n")
    with pytest.raises(DataError, match=r"table\.csv:2: is not a line of "):
        module.read(tmp_path / "table.csv")


def test_statistics_against_numpy():
    rng = np.random.default_rng(3)
    parts = [4.0e4 + rng.standard_normal(n) for n in (50, 70)]
    found = statistics.of_values(parts)
    values = np.concatenate(parts)
    assert found.rows == 120
    expected = [values.min(), values.max(), values.mean(), values.std()]
    assert [found.least, found.largest, found.mean, found.std] == pytest.approx(expected, rel=1e-8)


def test_statistics_are_those_of_the_splits(made):
    table = statistics.read(made / "data" / statistics.STATISTICS)
    dataset = Dataset(made / "data")
    for (file, split), names in {("one.h5", "train"): ["learn"], ("one.h5", "test"): ["judge"]}.items():
        values = np.concatenate([dataset[name]["mag_cabin_nt"] for name in names])
        found = table[file, split, "mag_cabin_nt"]
        assert found.rows == len(values)
        assert found.mean == pytest.approx(values.mean(), rel=1e-8)
        assert found.std == pytest.approx(values.std(), rel=1e-8)
    assert not any(split == "valid" for _, split, _ in table)
