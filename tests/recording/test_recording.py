"""A recording: its columns, rows and copies."""

from dataclasses import replace

import numpy as np
import pytest

from magsim import columns
from magsim.errors import RequestError
from magsim.recording import MissingColumnError, Recording


def recording(n=40, **extra):
    t = np.arange(n) / 10.0
    data = {
        "mag_cabin_nt": 43_000.0 + t,
        "mag_tail_nt": 42_000.0 + t,
        **{f"flux_a_{axis}_nt": t + k for k, axis in enumerate("xyz")},
        "ins_roll_deg": t,
        "surface_rudder_deg": -t,
        "interference_cabin_nt": t,
        "projection_cabin_nt": t,
        "clean_cabin_nt": 42_990.0 + t,
        "permanent_cabin_x_nt": t,
        "true_roll_deg": t,
        "circuit": np.where(t < 2.0, 1.0, 2.0),
        "leg": np.where(t % 2.0 < 1.0, 1.0, 2.0),
        "maneuver": np.where(t < 1.0, 2.0, 0.0),
        "split": np.where(t < 2.0, 0.0, 2.0),
        **extra,
    }
    meta = {"start_utc": "2025-03-13T00:00:00Z", "rate_hz": 10, "seed": 4, "digest": "ab", "scenario_text": "x = 1"}
    return Recording("box", t, data, meta)


def test_columns_are_reached_by_name():
    rec = recording()
    assert len(rec) == 40
    assert rec["time_s"] is rec.time_s
    np.testing.assert_array_equal(rec.stack(["mag_cabin_nt", "time_s"])[:, 1], rec.time_s)
    assert rec.scalars == ("cabin", "tail")
    assert rec.fluxgates == ("a",)
    assert "mag_cabin_nt" in rec
    assert rec.rate_hz == pytest.approx(10.0)
    with pytest.raises(MissingColumnError) as error:
        rec["mag_nose_nt"]
    assert str(error.value) == "recording 'box' has no column 'mag_nose_nt'; it has mag_cabin_nt, mag_tail_nt"
    assert isinstance(error.value, KeyError)


def test_vectors():
    rec = recording()
    np.testing.assert_array_equal(
        rec.vector(columns.FLUX, sensor="a"), np.column_stack([rec[f"flux_a_{axis}_nt"] for axis in "xyz"])
    )


def test_roles():
    rec = recording()
    assert rec.names("label") == ("interference_cabin_nt", "projection_cabin_nt")
    assert rec.names("segment") == ("circuit", "leg", "maneuver", "split")
    assert sum(len(rec.names(role)) for role in ("input", "label", "truth", "segment")) == len(rec.data)


def test_labeled_and_blind_copies_hold_nothing_else():
    rec = recording()
    labeled, blind = rec.labeled(), rec.blind()
    assert set(labeled.data) == {n for role in ("input", "label", "segment") for n in rec.names(role)}
    assert set(blind.data) == set(rec.names("input"))
    for copy in (labeled, blind):
        assert copy.meta == {"start_utc": "2025-03-13T00:00:00Z", "rate_hz": 10}
        assert "clean_cabin_nt" not in copy
        assert copy["mag_cabin_nt"] is rec["mag_cabin_nt"]


@pytest.mark.parametrize(
    ("patterns", "names"),
    [
        ((), ()),
        (("mag_{sensor}_nt",), ("mag_cabin_nt", "mag_tail_nt")),
        (("ins_{angle}_deg", "flux_{sensor}_{axis}_nt"), ("flux_a_x_nt", "flux_a_y_nt", "flux_a_z_nt", "ins_roll_deg")),
        # labels, truth and segments are never among them, and names of columns are no patterns
        (("interference_{sensor}_nt", "clean_{sensor}_nt", "split", "mag_cabin_nt"), ()),
    ],
)
def test_a_blind_copy_may_be_restricted_to_column_families(patterns, names):
    assert tuple(recording().blind(patterns).data) == names


def test_copies_with_less_truth():
    rec = recording()
    assert rec.with_truth("full") == rec
    assert set(rec.data) - set(rec.with_truth("sum").data) == {"permanent_cabin_x_nt"}
    assert set(rec.with_truth("none").data) == {*rec.names("input"), *rec.names("segment")}
    assert rec.with_truth("none").meta == rec.meta
    with pytest.raises(ValueError, match="truth cannot be 'some'; allowed: full, sum, none"):
        rec.with_truth("some")


def test_rows_by_segment():
    rec = recording()
    assert len(rec.where(circuit=1)) == 20
    assert len(rec.where(circuit=2, leg=1)) == 10
    assert set(rec.where(split="test")["split"]) == {2.0}
    assert rec.mask(maneuver="roll").sum() == 10
    np.testing.assert_array_equal(rec.take(rec.mask(circuit=2)).time_s, rec.time_s[20:])
    assert rec.where(circuit=1).meta == rec.meta


def test_rows_that_do_not_exist():
    rec = recording()
    with pytest.raises(ValueError, match="'box' has no rows with circuit=9, leg=1"):
        rec.where(circuit=9, leg=1)
    with pytest.raises(ValueError, match="'split' cannot be 'exam'; allowed: train, valid, test"):
        rec.where(split="exam")
    with pytest.raises(ValueError, match="'circuit' cannot be 'one'; allowed: numbers"):
        rec.where(circuit="one")
    with pytest.raises(MissingColumnError, match="no column 'cycle'"):
        rec.where(cycle=1)


def test_rows_by_number():
    rec = recording()
    for rows in (slice(3, 9), np.arange(3, 9), np.isin(np.arange(40), np.arange(3, 9))):
        taken = rec.take(rows)
        np.testing.assert_array_equal(taken.time_s, rec.time_s[3:9])
        np.testing.assert_array_equal(taken["ins_roll_deg"], rec["ins_roll_deg"][3:9])
        assert (taken.name, taken.meta) == (rec.name, rec.meta)


def test_pieces():
    rec = recording()
    assert rec.pieces() == (rec,)
    assert rec.pieces()[0] is rec
    cut = rec.take(rec.mask(leg=1))
    assert [len(piece) for piece in cut.pieces()] == [10, 10]
    assert cut.pieces()[1].time_s[0] == 2.0
    # A row all alone between two jumps cannot be filtered.
    lonely = rec.take(np.r_[0:10, 20, 30:40])
    assert [piece.time_s[0] for piece in lonely.pieces()] == [0.0, 3.0]


def test_rows_in_which_a_magnetometer_reads():
    valid = np.where(np.arange(40) % 7 == 0, 0.0, 1.0)
    rec = recording(mag_tail_valid=valid)
    np.testing.assert_array_equal(rec.reads("tail"), valid == 1.0)
    assert rec.reads("cabin").all()
    assert rec.reads("cabin").shape == (40,)


def test_a_magnetometer_that_is_not_there_does_not_read_everywhere():
    rec = recording(mag_nose_valid=np.ones(40))
    for sensor in ("nose", "a", "", "{sensor}"):
        with pytest.raises(
            RequestError, match=f"recording 'box' has no scalar magnetometer '{sensor}'; it has cabin, tail"
        ):
            rec.reads(sensor)
    bare = replace(rec, data={"ins_roll_deg": rec["ins_roll_deg"]})
    with pytest.raises(RequestError, match="no scalar magnetometer 'cabin'; it has none"):
        bare.reads("cabin")


@pytest.mark.parametrize("times", [[0.0, 0.0, 1.0], [1.0, 0.5], [0.0], [0.0, np.nan], [0.0, np.inf], [[0.0, 1.0]]])
def test_bad_times(times):
    with pytest.raises(ValueError, match="strictly increasing"):
        Recording("x", np.array(times), {})


def test_bad_columns():
    with pytest.raises(KeyError, match="no column family has the name 'speed'"):
        recording(speed=np.zeros(40))
    with pytest.raises(ValueError, match=r"'leg' of 'box' has shape \(3,\), expected \(40,\)"):
        recording(leg=np.zeros(3))
