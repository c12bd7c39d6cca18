"""How a recording shows itself."""

from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from magsim import columns
from magsim.errors import RequestError
from magsim.recording import Recording
from tests.recording.test_recording import recording


def test_one_line():
    assert repr(recording()) == "<Recording 'box': 40 rows, 3.9 s, 16 columns>"
    assert str(recording().blind()) == "<Recording 'box': 40 rows, 3.9 s, 7 columns>"


class Table(HTMLParser):
    """Tags and texts of a page."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.texts = [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)

    def handle_data(self, data):
        self.texts.append(data)


def test_a_table_of_columns_by_role():
    table = Table(recording()._repr_html_())
    assert set(table.tags) == {"table", "caption", "tr", "th", "td"}
    assert table.texts[0] == "box: 40 rows, 3.9 s, from 2025-03-13T00:00:00Z"
    rows = [table.texts[i : i + 3] for i in range(1, len(table.texts), 3)]
    shown = "mag_cabin_nt, mag_tail_nt, flux_a_x_nt, flux_a_y_nt, flux_a_z_nt, ins_roll_deg, ... (1 more)"
    assert ["input", "7", shown] in rows
    assert ["label", "2", "interference_cabin_nt, projection_cabin_nt"] in rows
    assert ["segment", "4", "circuit, leg, maneuver, split"] in rows
    assert [row[0] for row in rows] == [role for role in columns.ROLES if recording().names(role)]


HOSTILE = '"><script>alert(1)</script><img src=x onerror=alert(1)>&lt;b'


def test_hostile_names_are_escaped():
    """Name and start time come from a file of anyone's; names of columns are those of families."""
    rec = replace(recording(), name=HOSTILE, meta={"start_utc": HOSTILE})
    table = Table(rec._repr_html_())
    assert set(table.tags) == {"table", "caption", "tr", "th", "td"}
    assert table.texts[0] == f"{HOSTILE}: 40 rows, 3.9 s, from {HOSTILE}"
    assert "from" not in Table(replace(rec, meta={"start_utc": 3})._repr_html_()).texts[0]
    with pytest.raises(KeyError, match="no column family has the name"):
        Recording("r", rec.time_s, {"<script>": np.zeros(40)})


def test_an_xarray_dataset():
    rec = recording()
    found = rec.to_xarray()
    assert list(found.data_vars) == list(rec.data)
    assert dict(found.sizes) == {"time_s": 40}
    np.testing.assert_array_equal(found["time_s"], rec.time_s)
    for name, column in rec.data.items():
        np.testing.assert_array_equal(found[name], column)
        family = columns.family_of(name)
        assert found[name].attrs["role"] == family.role
        assert found[name].attrs["long_name"] == family.meaning
        assert found[name].attrs.get("units", "") == family.unit
        assert found[name].attrs.get("frame", "") == family.frame
    assert found["mag_cabin_nt"].attrs["units"] == "nT"
    assert found.attrs == {"name": "box", **rec.meta}
    assert "table" not in replace(rec, meta={"table": [1]}).to_xarray().attrs


def test_without_xarray_its_package_is_named(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    with pytest.raises(RequestError, match="to_xarray needs xarray, which is not installed: pip install xarray"):
        recording().to_xarray()


def test_a_recording_plots_itself():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.figure import Figure

    from tests.support.worlds import World, calibration

    figure = calibration(World(circuits=1)).plot("field", "cabin")
    assert isinstance(figure, Figure)
    assert figure.axes
    plt.close(figure)
    with pytest.raises(RequestError, match="'nothing'"):
        recording().plot("nothing")
