"""A recording cannot be changed, answers ``==``, and survives pickling."""

import copy
import dataclasses
import pickle
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from magsim.recording import Recording
from tests.recording.test_recording import recording


def test_values_do_not_follow_their_source():
    source, times = np.arange(40.0), np.arange(40) / 10.0
    rec = Recording("r", times, {"mag_spare_nt": source})
    source[:] = times[:] = -1.0
    np.testing.assert_array_equal(rec["mag_spare_nt"], np.arange(40.0))
    np.testing.assert_array_equal(rec.time_s, np.arange(40) / 10.0)


COPIES = {
    "itself": lambda rec: rec,
    "where": lambda rec: rec.where(circuit=1),
    "take": lambda rec: rec.take(slice(None, None, 2)),
    "pieces": lambda rec: rec.take(rec.mask(leg=1)).pieces()[1],
    "blind": lambda rec: rec.blind(),
    "labeled": lambda rec: rec.labeled(),
    "pickle": lambda rec: pickle.loads(pickle.dumps(rec)),
    "deepcopy": copy.deepcopy,
    "replace": lambda rec: dataclasses.replace(rec, name="other"),
}


@pytest.mark.parametrize("make", COPIES.values(), ids=COPIES)
def test_arrays_cannot_be_written_to_nor_made_writable(make):
    rec = make(recording())
    for values in (rec.time_s, *rec.data.values(), rec["mag_cabin_nt"][2:], rec["mag_cabin_nt"].view()):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = 0.0
        with pytest.raises(ValueError, match="cannot set WRITEABLE flag"):
            values.flags.writeable = True
        with pytest.raises(ValueError, match="cannot set WRITEABLE flag"):
            values.setflags(write=True)
        base = values.base
        while isinstance(base, np.ndarray):
            assert not base.flags.writeable
            base = base.base


@pytest.mark.parametrize("make", COPIES.values(), ids=COPIES)
def test_columns_cannot_be_swapped(make):
    rec = make(recording())
    with pytest.raises(TypeError, match="does not support item assignment"):
        rec.data["mag_cabin_nt"] = np.zeros(40)
    with pytest.raises(TypeError, match="does not support item deletion"):
        del rec.data["mag_cabin_nt"]
    assert not hasattr(rec.data, "update")
    for name in ("name", "time_s", "data", "meta"):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(rec, name, None)


def test_the_table_does_not_follow_the_mapping_that_it_came_from():
    data = {"mag_a_nt": np.zeros(3)}
    meta = {"seed": 1}
    rec = Recording("r", np.arange(3.0), data, meta)
    data["mag_b_nt"] = np.ones(3)
    meta["seed"] = 2
    assert set(rec.data) == {"mag_a_nt"}
    assert rec.meta == {"seed": 1}


def test_frames_are_copies():
    rec = recording()
    frame = rec.to_frame()
    assert frame.index.name == "time_s"
    assert list(frame.columns) == list(rec.data)
    np.testing.assert_array_equal(frame["mag_cabin_nt"].to_numpy(), rec["mag_cabin_nt"])
    frame.loc[0.0, "mag_cabin_nt"] = 1.0
    assert rec["mag_cabin_nt"][0] == 43_000.0


def test_equal_recordings():
    rec = recording()
    assert rec == recording()
    assert (rec == recording()) is True
    assert rec == rec.take(slice(None))
    holed = recording(ins_roll_deg=np.full(40, np.nan))
    assert holed == recording(ins_roll_deg=np.full(40, np.nan))
    assert holed != rec


@pytest.mark.parametrize(
    "change",
    [
        {"name": "other"},
        {"time_s": np.arange(40) / 10.0 + 1e-12},
        {"meta": {}},
        {"data": {}},
        {"data": {**recording().data, "ins_alt_m": np.zeros(40)}},
        {"data": {**recording().data, "ins_roll_deg": np.nextafter(recording()["ins_roll_deg"], np.inf)}},
    ],
)
def test_one_difference_is_enough(change):
    other = dataclasses.replace(recording(), **change)
    assert (recording() == other) is False
    assert (recording() != other) is True


def test_other_things_are_not_equal_and_a_recording_has_no_hash():
    rec = recording()
    assert (rec == 3) is False
    assert (rec == rec.name) is False
    assert rec in [3, rec]
    with pytest.raises(TypeError, match="unhashable"):
        hash(rec)


def test_pickled_and_read_back():
    rec = recording()
    back = pickle.loads(pickle.dumps(rec))
    assert back == rec
    assert list(back.data) == list(rec.data)
    assert back.rate_hz == rec.rate_hz
    assert copy.copy(rec) == copy.deepcopy(rec) == rec


def test_sent_to_another_process_and_back():
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        assert pool.submit(Recording.labeled, recording()).result() == recording().labeled()
