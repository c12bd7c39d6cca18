import dataclasses

import numpy as np
import pytest

from magsim.recording import Recording


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
    with pytest.raises(KeyError, match=r"'box' has no column 'mag_nose_nt'; it has mag_cabin_nt, mag_tail_nt"):
        rec["mag_nose_nt"]


def test_vector():
    from magsim import columns

    rec = recording()
    np.testing.assert_array_equal(rec.vector(columns.FLUX, sensor="a")[:, 2], rec["flux_a_z_nt"])


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
        assert set(copy.meta) == {"start_utc", "rate_hz"}
        assert "clean_cabin_nt" not in copy
        np.testing.assert_array_equal(copy["mag_cabin_nt"], rec["mag_cabin_nt"])


def test_rows_by_segment():
    rec = recording()
    assert len(rec.where(circuit=1)) == 20
    assert len(rec.where(circuit=2, leg=1)) == 10
    assert set(rec.where(split="test")["split"]) == {2.0}
    assert rec.mask(maneuver="roll").sum() == 10
    np.testing.assert_array_equal(rec.take(rec.mask(circuit=2)).time_s, rec.time_s[20:])
    assert rec.where(circuit=1).meta == rec.meta


def test_rows_that_are_not_there():
    rec = recording()
    with pytest.raises(ValueError, match="'box' has no rows with circuit=9, leg=1"):
        rec.where(circuit=9, leg=1)
    with pytest.raises(ValueError, match="'split' cannot be 'exam'; allowed: train, valid, test"):
        rec.where(split="exam")
    with pytest.raises(ValueError, match="'circuit' cannot be 'one'; allowed: numbers"):
        rec.where(circuit="one")
    with pytest.raises(KeyError, match="no column 'cycle'"):
        rec.where(cycle=1)


def test_pieces():
    rec = recording()
    assert rec.pieces() == (rec,)
    cut = rec.take(rec.mask(leg=1))
    assert [len(piece) for piece in cut.pieces()] == [10, 10]
    assert cut.pieces()[1].time_s[0] == 2.0
    # A row all alone between two jumps cannot be filtered.
    lonely = rec.take(np.r_[0:10, 20, 30:40])
    assert [piece.time_s[0] for piece in lonely.pieces()] == [0.0, 3.0]


def test_frozen():
    source = np.arange(40.0)
    rec = recording(mag_spare_nt=source)
    source[:] = -1.0
    assert rec["mag_spare_nt"][3] == 3.0
    with pytest.raises(ValueError, match="read-only"):
        rec["mag_cabin_nt"][0] = 0.0
    with pytest.raises(ValueError, match="read-only"):
        rec.where(circuit=1)["mag_cabin_nt"][0] = 0.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        rec.name = "x"


@pytest.mark.parametrize("times", [[0.0, 0.0, 1.0], [1.0, 0.5], [0.0], [0.0, np.nan], [0.0, np.inf], [[0.0, 1.0]]])
def test_bad_times(times):
    with pytest.raises(ValueError, match="strictly increasing"):
        Recording("x", np.array(times), {})


def test_bad_columns():
    with pytest.raises(KeyError, match="no column family has the name 'speed'"):
        recording(speed=np.zeros(40))
    with pytest.raises(ValueError, match=r"'leg' of 'box' has shape \(3,\), expected \(40,\)"):
        recording(leg=np.zeros(3))


def test_to_frame():
    rec = recording()
    frame = rec.to_frame()
    assert frame.index.name == "time_s"
    assert list(frame.columns) == list(rec.data)
    np.testing.assert_array_equal(frame["mag_cabin_nt"].to_numpy(), rec["mag_cabin_nt"])
    frame.loc[0.0, "mag_cabin_nt"] = 1.0
    assert rec["mag_cabin_nt"][0] == 43_000.0
