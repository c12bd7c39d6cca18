"""The heading table of a recording that is made by hand."""

import numpy as np
import pytest

from magsim import cli
from magsim.errors import DataError
from magsim.recording import Recording
from magsim.recording.heading import has_heading_table, heading_table

ENTRY = {"circuit": 1, "leg": 2, "heading_deg": 270.0, "time_s": 1.25, "miss_m": 0.5, "height_error_m": -0.4}


def recording(passes: object) -> Recording:
    time = np.arange(40) / 10.0
    data = {
        "mag_cabin_nt": 43_000.0 + 10.0 * time,
        "mag_tail_nt": 42_000.0 + time,
        "interference_cabin_nt": 3.0 - time,
        "clean_cabin_nt": 42_997.0 + 11.0 * time,
        "true_alt_m": 3000.0 + time,
    }
    return Recording("cross", time, data, {"notes": {"center_passes": passes}})


def test_values_stand_at_the_time_of_the_pass() -> None:
    late = ENTRY | {"leg": 3, "time_s": 3.0}
    first, second = heading_table(recording([ENTRY, late, ENTRY | {"time_s": 9.0}]), "cabin")
    assert (first.circuit, first.leg, first.heading_deg, first.miss_m, first.height_error_m) == (1, 2, 270.0, 0.5, -0.4)
    assert first.reading_nt == pytest.approx(43_012.5)
    assert first.clean_nt == pytest.approx(43_010.75)
    assert first.interference_nt == pytest.approx(1.75)
    assert second.reading_nt == pytest.approx(43_030.0)


def test_what_a_recording_does_not_hold_is_left_out() -> None:
    (row,) = heading_table(recording([ENTRY]), "tail")
    assert (row.clean_nt, row.interference_nt) == (None, None)
    # A compensator is not given the times at which the center was passed.
    assert heading_table(recording([ENTRY]).blind(), "cabin") == ()
    assert not has_heading_table(recording("none"))
    assert heading_table(recording([]), "cabin") == ()
    with pytest.raises(KeyError):
        heading_table(recording([ENTRY]), "nose")
    with pytest.raises(DataError, match="its list of center passes is damaged"):
        heading_table(recording([{"time_s": "x"}]), "cabin")


def test_info_prints_the_table_and_its_spread(tmp_path, capsys) -> None:
    path = tmp_path / "cross.h5"
    recording([ENTRY, ENTRY | {"leg": 3, "heading_deg": 90.0, "time_s": 3.0}]).write(path)
    assert cli.main(["info", str(path)]) == 0
    out = capsys.readouterr().out
    assert "Heading table of cabin" in out
    assert "1        2    270          1.2     0.5     -0.4      43010.750  43012.500   1.750" in out
    spread = next(line for line in out.splitlines() if line.strip().startswith("spread"))
    assert spread.split() == ["spread", "19.250", "17.500", "1.750"]
