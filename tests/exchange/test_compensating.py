"""Survey files and feeds that are compensated: numbers that mean nothing, dates, lines."""

import io
from datetime import UTC, datetime

import numpy as np
import pytest

from magsim.compensation import create
from magsim.errors import RequestError
from magsim.exchange import ColumnMap, compensating
from magsim.exchange.compensating import LineFeed, PickedLines
from magsim.recording.channels import problems_of
from tests.support.worlds import World, calibration

FLUX = [f"flux_cabin_{axis}_nt" for axis in "xyz"]


@pytest.fixture(scope="module")
def rows():
    return calibration(World(circuits=2)).take(slice(0, 400))


@pytest.fixture(scope="module")
def method():
    return create("tl16").fit(calibration(World(circuits=2)))


def table(rows, holes):
    """A CSV table in which single values are numbers that stand for missing ones."""
    names = ["time_s", "mag_cabin_nt", *FLUX]
    values = [[repr(float(v)) for v in row] for row in rows.stack(names)]
    for row, column, text in holes:
        values[row][column] = text
    return "\n".join([",".join(names), *map(",".join, values)]) + "\n"


def fed(method, text, mapping, kind="csv", **options):
    """What a feed writes, line by line, and the instants that it made its stream with."""
    starts, out = [], []

    def make(start_utc):
        starts.append(start_utc)
        return method.stream()

    LineFeed(make, kind, mapping, out.append, **options).run(io.BytesIO(text.encode()))
    return b"".join(out).decode().splitlines(), starts


def test_numbers_that_stand_for_missing_values_are_missing(rows, method, tmp_path):
    holes = [(50, 2, "-99999"), (51, 3, "-1.0E+32"), (120, 1, "-99999.0")]
    text = table(rows, holes)
    mapping = ColumnMap(nulls=(-99999.0, -1e32))
    path = tmp_path / "in.csv"
    path.write_text(text)
    found = compensating.read_survey(path, None, mapping)
    (values,) = compensating.compensate(method, found.surveys, None, "--lines")
    missing = [50, 51, 120]
    assert np.flatnonzero(np.isnan(values[:, 0])).tolist() == missing
    kept = rows.take(np.setdiff1d(np.arange(len(rows)), missing))
    np.testing.assert_allclose(values[np.isfinite(values[:, 1]), 1], method.interference(kept), rtol=0.0, atol=1e-6)
    lines, _ = fed(method, text, mapping)
    assert [i for i, line in enumerate(lines[1:]) if line.endswith(",,")] == missing
    assert lines[51].split(",")[2] == "-99999"


@pytest.mark.parametrize(
    ("mapping", "head", "expected"),
    [
        ({}, "", [None]),
        ({"start_utc": datetime(2024, 5, 1, 6, tzinfo=UTC)}, "", ["2024-05-01T06:00:00+00:00"]),
        ({}, "YEAR DOY", ["2024-02-29T00:00:00+00:00"]),
    ],
)
def test_a_feed_tells_its_stream_the_instant_of_time_zero(mapping, head, expected, rows, method):
    names = dict(zip(["mag_cabin_nt", *FLUX], ["UNCOMPMAG1", "FLUXA_X", "FLUXA_Y", "FLUXA_Z"], strict=True))
    date = " 2024 60" if head else ""
    values = rows.stack(names)[:20]
    text = f"/ TIME {' '.join(names.values())} {head}\n" + "".join(
        f"{t:.1f} {' '.join(map(repr, row))}{date}\n"
        for t, row in zip(rows.time_s + 40_000.0, values.tolist(), strict=False)
    )
    lines, starts = fed(method, text, ColumnMap.model_validate({**mapping, "columns": names}), "sgl-xyz")
    assert starts == expected
    assert lines[0].endswith(" compensated_cabin_nt removed_cabin_nt")
    assert len(lines) == 21


def test_lines_are_numbers_and_ranges_in_hundredths():
    lines = PickedLines.parse("1001.1, 1003-1005.5", "--lines")
    picked = [1001.1, 1001.10, 1003.0, 1004.99, 1005.5]
    others = [1001.0, 1001.11, 1002.99, 1005.51, np.nan]
    assert lines.mask(np.array([*picked, *others])).tolist() == [True] * 5 + [False] * 5
    assert all(number in lines for number in picked)
    assert not any(number in lines for number in others)
    for wrong in ("", "a", "1,", "-3", "5-4", "1.234", "1e3", "1--2"):
        with pytest.raises(RequestError, match=r"--lines .*is no line; allowed: numbers and ranges"):
            PickedLines.parse(wrong, "--lines")


def test_level_flight_north_in_degrees_is_not_taken_for_radians():
    angles = {"ins_roll_deg": 0.8, "ins_pitch_deg": 2.5, "ins_heading_deg": 3.0}
    assert problems_of({name: np.full(200, value) for name, value in angles.items()}) == []
    assert len(problems_of({name: np.radians(np.full(200, value)) for name, value in angles.items()})) == 1
