"""Training on flights one at a time: what is learned, what judges, what it is a start for, what is refused."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation import FitContext, create, load
from magsim.compensation.networks.pretraining import SpooledLesson, SpooledParts, spread
from magsim.compensation.networks.scaling import Standardizer
from magsim.compensation.networks.settings import NetworkSettings
from magsim.compensation.networks.spooling import SpooledFlights
from magsim.dataset import Dataset, flights_of, open_training
from magsim.errors import DataError, RequestError
from magsim.recording import Recording, write_recordings
from magsim.signals import in_band
from magsim.streams import stream
from tests.support.worlds import INDUCED, PERMANENT_NT, World, calibration

ONE = World(circuits=1)
BARE = {"inputs": ("attitude", "rates"), "first_stage": "none"}
QUICK = {"optimizer": "adam", "weight_decay": 0.0, "hidden": (4,), "steps": 8, "every": 4, "batch": 4}
FLIGHT = {**QUICK, "stage_for": "flight", "hold_out": "flights", "folds": 2}


def cut(recording, first, stop):
    """A part of a flight, without its splits."""
    part = recording.take(slice(first, stop))
    return replace(part, data={name: v for name, v in part.data.items() if name != "split"})


@pytest.fixture(scope="module")
def flights():
    """Three flights; the second has a gap, and a dropout in which the reading is nothing to learn from."""
    found = [replace(cut(calibration(ONE, seed), 0, 2400 + 300 * seed), name=f"f{seed}") for seed in (1, 2, 3)]
    valid = np.ones(len(found[1]))
    valid[1000:1100] = 0.0
    label = found[1]["interference_cabin_nt"] + np.where(valid == 0.0, 1e4, 0.0)
    gap = np.r_[0:1900, 2100 : len(found[1])]
    found[1] = replace(found[1], data={**found[1].data, "mag_cabin_valid": valid, "interference_cabin_nt": label}).take(
        gap
    )
    return found


@pytest.fixture(scope="module")
def folder(flights, tmp_path_factory):
    """A shard of two flights, and a file of one."""
    path = tmp_path_factory.mktemp("sweep")
    write_recordings(path / "shard_0.h5", flights[:2])
    flights[2].write(path / "shard_1.h5")
    return path


def spooled_of(settings, flights, tmp_path):
    spooled = SpooledFlights(settings, "cabin", tmp_path)
    for flight in flights:
        spooled.add(flight, None)
    return spooled


def test_without_a_stage_it_is_the_training_in_memory(folder, flights):
    """The same rows in other hands: losses and validation values agree as float32 does, and so do estimates."""
    held = create("bp", **BARE, **FLIGHT | {"stage_for": "all", "refit": False}).fit(flights)
    streamed = create("bp", **BARE, **FLIGHT).fit(folder)
    # the folds in memory are two, of which the first holds out the same flights
    one, other = held.outcomes_["fold 1"], streamed.outcomes_["fold 1"]
    assert list(streamed.outcomes_) == ["fold 1"]
    np.testing.assert_allclose(np.array(other.history), np.array(one.history), rtol=1e-4)
    assert other.best_step > 0
    np.testing.assert_allclose(streamed._fitted.standardizer.mean, held._fitted.standardizer.mean, rtol=1e-12)
    np.testing.assert_allclose(streamed._fitted.standardizer.scale, held._fitted.standardizer.scale, rtol=1e-12)
    assert streamed._fitted.mean == pytest.approx(held._fitted.mean, rel=1e-12)
    assert streamed._fitted.scale == pytest.approx(held._fitted.scale, rel=1e-12)
    member = held._fitted.module.members[0]
    mine, theirs = (f.output(m, f.inputs(flights[0]), flights[0].time_s) for f, m in (
        (streamed._fitted, streamed._fitted.module), (held._fitted, member)
    ))  # fmt: skip
    np.testing.assert_allclose(mine, theirs, atol=1e-4)
    estimate = streamed.interference(flights[0])
    np.testing.assert_allclose(estimate, streamed._fitted.mean + streamed._fitted.gain_nt * mine, rtol=1e-5)


def test_each_flight_has_its_own_stage_and_mean_and_scales_are_of_all(flights, tmp_path):
    """By hand, from each flight's Tolles-Lawson fit."""
    settings = NetworkSettings(inputs=("tl16", "attitude"), window=50, stage_for="flight", hold_out="flights")
    left, matrices = [], []
    for flight in flights:
        stage = create("tl16").fit(flight)
        rest = flight["interference_cabin_nt"] - stage.interference(flight)
        reads = flight.reads("cabin")
        rest = np.interp(flight.time_s, flight.time_s[reads], rest[reads])
        left.append((rest - rest[reads].mean(), reads))
        tl = create("bp", inputs=("tl16", "attitude"), steps=1, folds=0, band_weight=0.0, hidden=(1,)).fit(flight)
        matrices.append(tl._fitted.columns(flight).matrix)
    with spooled_of(settings, flights, tmp_path) as spooled:
        fitted = spooled.fitted(None)
        assert fitted.is_start
        expected = Standardizer.of([np.concatenate(matrices)])
        np.testing.assert_allclose(fitted.standardizer.mean, expected.mean, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(fitted.standardizer.scale, expected.scale, rtol=1e-9)
        assert fitted.scale == pytest.approx(np.concatenate([rest[reads] for rest, reads in left]).std(), rel=1e-9)
        lesson = SpooledLesson(spooled, fitted, spooled.flights[1:])
        inside = np.concatenate([in_band(left[i][0], flights[i].time_s) for i in (1, 2)])
        assert lesson.band_variance() == pytest.approx(inside.var() / fitted.scale**2, rel=1e-9)
        inputs, targets = lesson.sources(50)
        # of flight 1: pieces of 1900 and 900 rows; then flight 2
        for window, (number, first) in {0: (1, 0), 1850: (1, 1850), 1851: (1, 1900), 1851 + 851: (2, 0)}.items():
            rows = slice(first, first + 50)
            np.testing.assert_allclose(inputs.take([window])[0], expected(matrices[number][rows]), rtol=0, atol=1e-5)
            rest, reads = left[number]
            np.testing.assert_allclose(
                targets.take([window])[0], np.column_stack([rest / fitted.scale, reads])[rows], rtol=0, atol=1e-5
            )
        (first, second, third, *_) = SpooledParts(spooled, fitted, spooled.flights)
        np.testing.assert_allclose(second.rest, left[1][0][:1900], rtol=0, atol=1e-3)
        np.testing.assert_allclose(second.inputs, expected(matrices[1][:1900]), rtol=0, atol=1e-5)
        np.testing.assert_array_equal(second.numbers[[0, 295, 305, 1050]], [0, 0, 1, -1])
        assert [len(part.rest) for part in (first, second, third)] == [2700, 1900, 900]


def test_a_start_for_others(folder, flights, tmp_path):
    """It is saved and read again, has no estimate, and an adaptation takes its weights and scales."""
    method = create("bp", **FLIGHT).fit(folder)
    method.save(tmp_path / "start")
    again = load(tmp_path / "start")
    for one in (method, again):
        text = "bp was trained on flights with a first stage each .* adapt it to a calibration flight: .* --init RUN"
        with pytest.raises(RequestError, match=text):
            one.interference(flights[0])
        with pytest.raises(RequestError, match=text):
            one.stream()
    assert "a start for others" in str(again.report_)
    adapted = create("bp", **QUICK | {"steps": 1, "every": 1, "learning_rate": 1e-9}, folds=0)
    adapted.fit(flights[0], context=FitContext(init=tmp_path / "start"))
    assert adapted._fitted.scale == method._fitted.scale
    for name, tensor in method._fitted.module.state_dict().items():
        np.testing.assert_allclose(adapted._fitted.module.state_dict()[name], tensor, rtol=0, atol=1e-6)
    assert np.isfinite(adapted.interference(flights[0])).all()
    stage = create("tl16").fit(flights[0])
    np.testing.assert_array_equal(adapted._fitted.stage.coefficients_, stage.coefficients_)


def test_whole_groups_judge(flights, tmp_path):
    """Individuals 1 and 3 of three: every second group, from the first on."""
    metas = [{"aircraft": "x", "individual": i, "start_utc": f"2025-03-1{i}T00:00:00Z"} for i in (1, 2, 1)]
    told = [replace(flight, meta=meta) for flight, meta in zip(flights, metas, strict=True)]
    judged = {}
    for hold_out in ("flights", "individuals", "days"):
        settings = FLIGHT | BARE | {"hold_out": hold_out, "steps": 1, "every": 1}
        judged[hold_out] = create("bp", **settings).fit(told).outcomes_["fold 1"].history[0][2]
    # flights 0 and 2 are held out each time
    assert judged["flights"] == judged["individuals"] == judged["days"]
    everything = create("bp", **FLIGHT | BARE | {"folds": 0, "steps": 1, "every": 1}).fit(told).outcomes_
    assert list(everything) == ["all"]
    assert everything["all"].history[0][2] != judged["flights"]


def test_what_judges_is_spread_evenly():
    assert spread([(0, 400), (400, 30), (430, 300)], 1000, 100, 50) == [(0, 400), (430, 300)]
    pieces = [(1000 * number, 1000) for number in range(50)]
    found = spread(pieces, 5000, 300, 50)
    assert len(found) == 16
    assert sum(rows for _, rows in found) == 5000
    assert {rows for _, rows in found} <= {312, 313}
    flights = [first // 1000 for first, _ in found]
    assert np.diff(flights).min() >= 3
    assert flights[0] == 0
    assert flights[-1] == 49
    places = np.sort([first % 1000 for first, _ in found])
    assert places[0] < 60
    assert places[-1] > 620
    assert all(first % 1000 + rows <= 1000 for first, rows in found)
    assert np.diff(places).max() < 130
    assert spread([(0, 10_000)], 500, 300, 50) == [(4750, 500)]


def test_a_run_that_was_broken_off_ends_as_one_without_a_break(folder, tmp_path):
    class Broken(Exception):
        pass

    def breaks(progress):
        if progress.step == 4:
            raise Broken

    whole = create("bp", **FLIGHT).fit(folder)
    (tmp_path / "run").mkdir()
    with pytest.raises(Broken):
        create("bp", **FLIGHT).fit(folder, context=FitContext(progress=breaks, checkpoint=tmp_path / "run" / "state"))
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["state"]
    seen = []
    context = FitContext(progress=seen.append, checkpoint=tmp_path / "run" / "state")
    resumed = create("bp", **FLIGHT).fit(folder, context=context)
    assert [progress.step for progress in seen] == [4, 8]
    for name, tensor in whole._fitted.module.state_dict().items():
        assert (tensor == resumed._fitted.module.state_dict()[name]).all()
    with pytest.raises(RequestError, match="other settings or other recordings"):
        create("bp", **FLIGHT).fit(list(Dataset(folder))[:2], context=replace(context, progress=None))


def test_flights_that_do_not_fit_are_refused_by_name(flights):
    def refused(other, error, text, **settings):
        training = open_training(flights_of([flights[0], other]))
        with pytest.raises(error, match=text):
            create("bp", **FLIGHT | settings).fit_rows(training)

    slow = replace(flights[1].take(slice(None, None, 2)), name="slow")
    refused(slow, DataError, "recording 'slow' has 5 rows a second; the network learned from 10")
    short = replace(flights[1].take(slice(0, 600)), name="short")
    text = "recording 'short' is too short: its longest piece without a gap has 600 training rows; allowed: 602 or more"
    refused(short, DataError, text)
    refused(short, DataError, "allowed: 700 or more", window=700)
    deaf = replace(flights[1], name="deaf", data={n: v for n, v in flights[1].data.items() if "cabin" not in n})
    refused(deaf, RequestError, "recording 'deaf' has no scalar magnetometer 'cabin'")
    silent = replace(flights[2], name="silent", data={**flights[2].data, "mag_cabin_valid": np.zeros(len(flights[2]))})
    refused(silent, DataError, "'silent'")
    bare = replace(flights[2], name="bare", data={n: v for n, v in flights[2].data.items() if "interf" not in n})
    refused(bare, RequestError, "recording 'bare' has no label 'interference_cabin_nt'")


def test_flights_with_other_inputs_are_refused(flights):
    wave = np.sin(np.arange(len(flights[0])) / 30.0)
    pumps = replace(flights[0], data={**flights[0].data, "cur_pump_a": wave, "cur_strobe_a": wave**2})
    other = replace(pumps, name="other", data={**flights[0].data, "cur_pump_a": wave, "cur_heat_a": wave})
    text = "recording 'other' has other inputs than 'f1': it has cur_heat_a and lacks cur_strobe_a; allowed: flights"
    with pytest.raises(RequestError, match=text):
        create("bp", **FLIGHT | {"inputs": ("tl16", "currents")}).fit([pumps, other])


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"optimizer": "lm"}, "optimizer 'lm' takes all rows at once; allowed: optimizer 'adam'"),
        ({"hold_out": "blocks"}, "hold_out 'blocks' is not allowed with stage_for 'flight', which holds out whole"),
        ({"hold_out": "individuals"}, "does not tell its aircraft and individual"),
        ({"hold_out": "days"}, "hold_out 'days' needs recordings of two days or more, .* allowed for these: folds = 0"),
    ],
)
def test_settings_that_do_not_fit_are_refused(flights, settings, text):
    with pytest.raises(RequestError, match=text):
        create("bp", **FLIGHT | settings).fit(flights)


def individual(number, flight):
    """A flight of an individual: permanent and induced field of its own, and a nonlinear part that all have."""
    rng = stream(number, "tests/pretraining/individual")
    permanent = tuple(PERMANENT_NT + 40.0 * rng.normal(size=3))
    induced = tuple(map(tuple, INDUCED * (1.0 + 0.5 * rng.normal(size=(3, 3)))))
    flown = cut(calibration(World(circuits=1, permanent_nt=permanent, induced=induced), flight), 0, 6400)
    shared = 10.0 * np.tanh(flown["ins_roll_deg"] / 4.0) * np.cos(np.radians(6.0 * flown["ins_pitch_deg"]))
    changed = {name: flown[name] + shared for name in ("mag_cabin_nt", "interference_cabin_nt")}
    about = {**flown.meta, "aircraft": "x", "individual": number}
    return replace(flown, name=f"i{number}", data={**flown.data, **changed}, meta=about)


def test_what_many_individuals_share_helps_a_new_one_in_few_steps(tmp_path):
    """Judged on another flight of an individual that was in no training; the rest of the stage is 2.6 nT."""
    settings = {**QUICK, "inputs": ("attitude",), "hidden": (16,), "batch": 8, "window": 160}
    many = settings | {"steps": 400, "every": 100, "learning_rate": 0.01, "hold_out": "individuals", "folds": 4}
    create("bp", **many, stage_for="flight").fit([individual(n, n) for n in range(4)]).save(tmp_path)
    few = settings | {"steps": 10, "every": 10, "learning_rate": 0.002, "folds": 0}
    calibrates, later = individual(9, 9), individual(9, 19)
    errors = []
    for init in (None, tmp_path):
        method = create("bp", **few).fit(calibrates, context=FitContext(init=init))
        error = later["interference_cabin_nt"] - method.interference(later)
        errors.append(in_band(error, later.time_s).std())
    scratch, adapted = errors
    assert adapted < 0.5 * scratch


def test_flights_are_read_one_at_a_time(folder, monkeypatch):
    """Whatever is read is forgotten before the next is: any number of flights will do."""
    read, alive = [], []
    original = Recording.labeled

    def spy(recording):
        gc.collect()
        assert not any(reference() is not None for reference in alive)
        read.append(recording.name)
        labeled = original(recording)
        alive.append(weakref.ref(labeled))
        return labeled

    monkeypatch.setattr(Recording, "labeled", spy)
    create("bp", **FLIGHT).fit(folder)
    # once for the training, and the first once more for its columns
    assert read == ["f1", "f2", "f3", "f1"]
