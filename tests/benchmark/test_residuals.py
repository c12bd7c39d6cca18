"""Residuals: files, joining, and rows of them."""

import json
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from magsim.benchmark import Judged, Residuals, judge, pooled, report_of, scores_of
from magsim.compensation import create
from magsim.errors import DataError, RequestError
from magsim.recording.segments import headings_and_maneuvers
from tests.support.methods import stub, without
from tests.support.worlds import World, calibration

JUDGED = Judged("flight", "a.h5", "cabin", 3, 7, "tl16")
REQUIRED = (
    "time_s", "piece", "reading", "compensated", "injected", "change", "reading_high", "compensated_high", "far",
    "fourth",
)  # fmt: skip
OPTIONAL = (
    "interference", "error", "floor", "interference_raw", "error_raw", "slow", "heading_deg", "maneuver", "turn",
)  # fmt: skip


def made(rows=5, seed=0, names=REQUIRED + OPTIONAL, judged=JUDGED, **more):
    rng = np.random.default_rng(seed)
    table = {name: rng.normal(size=rows) for name in names}
    table |= {name: rng.normal(size=(rows, 3)) for name in names if name in ("injected", "change")}
    table |= {name: rng.integers(0, 4, rows).astype(float) for name in names if name in ("maneuver", "turn")}
    return Residuals(judged, **table | {"piece": np.zeros(rows), "far": np.ones(rows)} | more)


def same(one, other):
    """Whether two residuals are equal bit for bit."""
    names = [item.name for item in fields(one) if item.name != "judged"]
    pairs = [(getattr(one, name), getattr(other, name)) for name in names]
    return one.judged == other.judged and all(
        (a is None) == (b is None) and (a is None or a.tobytes() == b.tobytes()) for a, b in pairs
    )


@pytest.fixture(scope="module")
def recording():
    return calibration(World())


def test_what_was_written_is_read_bit_for_bit(recording, tmp_path):
    bare = without(recording, "clean", "leg", "maneuver", "turn")
    for number, found in enumerate(
        [
            judge(create("tl16").fit(recording), recording, level=2, file="a.h5", seed=4),
            judge(None, recording),
            judge(create("none").fit(bare), bare),
            made(judged=replace(JUDGED, recording="Flug Ü", level=None)),
        ]
    ):
        found.write(tmp_path / f"{number}.npz")
        back = Residuals.read(tmp_path / f"{number}.npz")
        assert same(back, found)
        # as text NaN is equal to NaN
        assert repr(scores_of(back)) == repr(scores_of(found))
    found.write(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == (tmp_path / "3.npz").read_bytes()


def test_judged_in_another_process_the_scores_are_the_same(recording, tmp_path):
    found = judge(create("tl16").fit(recording), recording, level=2)
    found.write(tmp_path / "r.npz")
    program = (
        "import sys; from magsim.benchmark import Residuals, report_of; "
        "print(report_of([Residuals.read(sys.argv[1])]).to_json(), end='')"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "r.npz")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == report_of([found]).to_json()
    assert len(json.loads(done.stdout)["rows"]) == len(scores_of(found)) > 50


def test_files_are_not_replaced_without_force(tmp_path):
    made().write(tmp_path / "r.npz")
    with pytest.raises(RequestError, match="exists"):
        made(seed=1).write(tmp_path / "r.npz")
    assert same(Residuals.read(tmp_path / "r.npz"), made())
    made(seed=1).write(tmp_path / "r.npz", force=True)
    assert same(Residuals.read(tmp_path / "r.npz"), made(seed=1))


def arrays(path, **change):
    with np.load(path) as file:
        table = dict(file) | change
    np.savez(path, **{name: values for name, values in table.items() if values is not None})


def as_bytes(value):
    return np.frombuffer(json.dumps(value).encode(), dtype=np.uint8)


@pytest.mark.parametrize(
    "change",
    [
        {"judged": None},
        {"time_s": None},
        {"judged": as_bytes({"recording": "x"})},
        {"judged": as_bytes([1])},
        {"judged": np.frombuffer(b"[" * 100_000, dtype=np.uint8)},
        {"judged": np.frombuffer(b"\xff", dtype=np.uint8)},
        {"other": np.zeros(5)},
        {"error": np.zeros(4)},
        {"error": np.zeros((5, 1))},
        {"error": np.array(["a"] * 5)},
    ],
)
def test_files_that_hold_no_residuals_are_refused(tmp_path, change):
    path = tmp_path / "r.npz"
    made().write(path)
    arrays(path, **change)
    with pytest.raises(DataError, match=r"r\.npz: holds no residuals"):
        Residuals.read(path)


def test_damaged_files_and_pickles_are_refused(tmp_path):
    path = tmp_path / "r.npz"
    made().write(path)
    data = path.read_bytes()
    for broken in (b"", b"no zip", data[:100], data[:-30]):
        path.write_bytes(broken)
        with pytest.raises(DataError, match="holds no residuals"):
            Residuals.read(path)
    path.write_bytes(data)
    arrays(path, error=np.array([None] * 5))
    with pytest.raises(DataError, match="holds no residuals"):
        Residuals.read(path)
    with pytest.raises(RequestError, match="there is no such file"):
        Residuals.read(tmp_path / "nothing.npz")


def test_shapes_must_agree_and_arrays_cannot_be_written_to():
    with pytest.raises(ValueError, match=r"error of residuals has shape \(3,\), expected \(5,\)"):
        made(error=np.zeros(3))
    found = made()
    for name in REQUIRED + OPTIONAL:
        with pytest.raises(ValueError, match="read-only"):
            getattr(found, name)[0] = 1.0


def test_rows_may_be_taken_in_any_order():
    found = made(6)
    taken = found.take(np.array([4, 0, 0]))
    assert len(taken) == 3
    for name in REQUIRED + OPTIONAL:
        np.testing.assert_array_equal(getattr(taken, name), getattr(found, name)[[4, 0, 0]])
    mask = np.array([True, False, True, False, False, True])
    assert same(found.take(mask), found.take(np.array([0, 2, 5])))
    assert found.take(mask).judged == found.judged
    assert made(names=REQUIRED).take(np.array([1])).error is None


def test_joined_residuals_number_their_pieces_on():
    one, other = made(3, 0, piece=np.array([0.0, 1.0, 1.0])), made(2, 1, judged=replace(JUDGED, recording="other"))
    whole = pooled([one, other, one])
    np.testing.assert_array_equal(whole.piece, [0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 4.0, 4.0])
    np.testing.assert_array_equal(whole.error, np.concatenate([one.error, other.error, one.error]))
    assert whole.judged == one.judged
    named = replace(JUDGED, recording="all")
    assert pooled([one, other], named).judged == named
    assert same(pooled([made(3)]), made(3))
    empty = made(3).take(np.zeros(3, dtype=bool))
    np.testing.assert_array_equal(pooled([empty, made(2)]).piece, [0.0, 0.0])


def test_a_signal_that_one_lacks_is_missing_in_the_whole():
    whole = pooled([made(3), made(2, names=(*REQUIRED, "error", "turn"))])
    assert {name for name in OPTIONAL if whole.has(name)} == {"error", "turn"}
    with pytest.raises(ValueError, match="there are no residuals to join"):
        pooled([])


def test_scores_of_joined_residuals_are_of_all_their_rows(recording):
    """By hand: the STD over the rows of both flights."""
    found = [judge(stub().fit(r), r) for r in (recording, calibration(World(), 1, "other"))]
    scores = {(part, name): value for part, name, value in scores_of(pooled(found))}
    assert scores["test", "std_nt"] == pytest.approx(np.std(np.concatenate([one.error for one in found])), rel=1e-12)
    east = np.concatenate([one.error[(one.heading_deg == 90.0) & (one.maneuver == 2.0)] for one in found])
    assert scores["heading 90 roll", "peak_nt"] == np.ptp(east)


def test_parts_are_those_of_the_segment_columns(recording):
    found = judge(stub().fit(recording), recording)
    table = {name: recording[name][6400:12_500] for name in ("leg_heading_deg", "maneuver", "turn")}
    expected = headings_and_maneuvers(table)
    assert [part.name for part in found.segments] == [part.name for part in expected]
    for one, other in zip(found.segments, expected, strict=True):
        np.testing.assert_array_equal(one.rows, other.rows)
    assert len(found.cells) == 12
    assert made(names=REQUIRED).segments == made(names=REQUIRED).cells == []


def test_known_signals():
    found = made(3, names=(*REQUIRED, "error"), far=np.array([0.0, 1.0, 0.0]))
    assert found.has("error")
    assert not found.has("interference")
    assert found.has("far")
    assert not found.take(np.array([0, 2])).has("far")
    assert not found.has("cells")
