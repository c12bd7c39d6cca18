"""What every method of the registry must keep, and what the base class keeps for methods of one's own."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from magsim import columns
from magsim.compensation import Compensator, FitContext, create, load, names
from magsim.compensation.networks import NetworkCompensator
from magsim.dataset import Dataset
from magsim.errors import DataError, RequestError
from tests.support.inertial import flown
from tests.support.methods import without
from tests.support.worlds import World, calibration, parts

LM = {"steps": 2, "every": 1, "folds": 0, "band_weight": 0.0}
QUICK = {"steps": 6, "every": 3, "batch": 4, "folds": 0}
METHODS = {
    "none": {},
    "tl16": {},
    "tl18": {"scale": "sample", "derivative": "spline"},
    "tl16_measured": {},
    "tl18_measured": {},
    "tl16_gradient": {},
    "tl16_gradient plain": {"order": 0, "vertical": False, "derivative": "spline"},
    "tolles_lawson": {"terms": 3, "solver": "truncated_svd", "band": "broad"},
    "tolles_lawson field": {"eddy": "field", "scale": "sample", "terms": 18},
    "tl3": {"bias": False},
    "tl8": {},
    "tl9": {"scale": "sample"},
    "tl3_measured": {},
    "tl8_measured": {},
    "tl9_measured": {"solver": "principal_components", "variance": 0.999},
    "tl16_ins": {},
    "tl16_calibrated": {},
    "tl16_auxiliary": {},
    "tl16_auxiliary ins": {"direction": "ins", "eddy": "field"},
    "tl16_recursive": {},
    "tl16_recursive short": {"target": "measured", "forgetting_s": 60.0, "anchor_s": 5.0},
    "vector_tl": {"second_derivative": True},
    "vector_tl central": {"target": "measured", "derivative": "central"},
    "exact_norm": {},
    "exact_norm_whole": {},
    "exact_norm fluxgate": {"direction": "fluxgate", "memory": False},
    "exact_norm_model": {"direction": "ins"},
    "exact_norm_measured": {"lookahead": 3},
    "exact_norm_causal": {},
    "exact_norm_adaptive": {},
    "magtcn": {**QUICK, "width": 2, "kernel": 11},
    "magtcn causal": {**QUICK, "width": 2, "kernel": 11, "causal": True},
    "magtcn last": {**QUICK, "width": 2, "kernel": 11, "window": 50, "head": "last"},
    "bp": LM,
    "bpnn": {**QUICK, "window": 50, "hidden": (4,)},
    "bp wide": {
        **LM,
        "inputs": ("tl18", "auxiliary", "attitude", "rates", "currents", "surfaces", "travel", "height"),
        "direction": "calibrated",
        "first_stage": "exact_norm",
    },
    "bpnn ins": {
        **QUICK,
        "window": 50,
        "hidden": (4,),
        "inputs": ("tl16", "position", "time"),
        "direction": "ins",
        "first_stage": "tl16_auxiliary",
    },
    "williams": {**LM, "hidden": 2},
    "resnet": {**QUICK, "width": 2, "blocks": 1},
    "resnet causal": {**QUICK, "width": 2, "blocks": 1, "causal": True},
    "resnet last": {**QUICK, "width": 2, "blocks": 1, "window": 50, "head": "last"},
    "res_bp": {**LM, "width": 4, "layers": 1},
    "lstm_bp": {**QUICK, "hidden": 2, "dense": (2,), "taps": 8, "window": 140},
    "lstm_bp sigmoid": {**QUICK, "hidden": 2, "taps": 8, "window": 8, "layers": 2, "activation": "sigmoid"},
    "gru_bp": {**QUICK, "hidden": 2, "dense": (2,), "taps": 8, "window": 30, "band_weight": 0.0},
    "lstm": {**QUICK, "hidden": 2, "taps": 8, "window": 30, "band_weight": 0.0},
    "lstm lm": {**LM, "optimizer": "lm", "hidden": 2, "taps": 4},
    "pg_tlnet": {**QUICK, "hidden": (4,)},
    "pg_tlnet coefficients": {**QUICK, "hidden": (4,), "nonlinear": "coefficients"},
    "ga_bp": {**LM, "hidden": (4,)},
    "wavelet_bilstm": {**QUICK, "hidden": 2, "levels": 2, "window": 30, "band_weight": 0.0},
    "subnetworks": LM,
    "subnetworks field": {
        **QUICK,
        "optimizer": "adam",
        "inputs": ("tl16", "time", "position", "travel"),
        "target": "measured",
    },
    "williams field": {**LM, "mode": "field", "inputs": ("attitude", "rates", "position", "height"), "taps": 1},
}
REAL_FIELD = {"tl16_ins", "tl16_calibrated", "tl16_auxiliary", "bp wide", "bpnn ins"}
READ_THE_READING = {"tl16_recursive", "vector_tl", "exact_norm_adaptive"}
WORLD = World(eddy_tau_s=0.01)


def learn(method, recording):
    """Fit, and shift the weights of a network, since one that is trained so little may still return nothing."""
    method.fit(recording)
    if isinstance(method, NetworkCompensator):
        generator = torch.Generator().manual_seed(0)
        with torch.no_grad():
            for parameter in method._fitted.module.parameters():
                parameter.add_(0.1 * torch.randn(parameter.shape, generator=generator))
    return method


def recording_for(name):
    """What a method is fitted to: those of a model field need one that is real."""
    if name.startswith("exact_norm"):
        return without(flown(name="world"), "cur_", "surface_")
    return flown(name="world") if {name, name.split()[0]} & REAL_FIELD else calibration(WORLD)


@pytest.fixture(scope="module", params=METHODS)
def case(request):
    """A method that is not fitted, and what it is fitted to."""
    return create(request.param.split()[0], **METHODS[request.param]), recording_for(request.param)


@pytest.fixture(scope="module")
def recording():
    return calibration(WORLD)


@pytest.fixture(scope="module")
def learned(case):
    return case[1]


@pytest.fixture(scope="module")
def test_rows(learned):
    return learned.where(split="test").take(slice(0, 1500))


@pytest.fixture(scope="module")
def fitted(case):
    return learn(*case)


def test_every_method_of_the_package_is_checked():
    assert {name.split()[0] for name in METHODS} == set(names())


def test_estimate_has_one_value_for_each_row_after_the_warmup(fitted, test_rows):
    estimate = fitted.interference(test_rows)
    assert estimate.shape == (len(test_rows),)
    assert estimate.dtype == float
    late = test_rows.time_s - test_rows.time_s[0] >= fitted.warmup_s - 1e-9
    assert np.isfinite(estimate[late]).all()
    assert np.isnan(estimate[~late]).all()
    np.testing.assert_array_equal(fitted.compensate(test_rows)[late], (test_rows["mag_cabin_nt"] - estimate)[late])


def test_estimate_does_not_depend_on_reading_labels_or_truth(fitted, test_rows):
    """From a copy in which everything but the declared inputs is nonsense, and from one without it."""
    assert any(pattern.startswith("mag") for pattern in fitted.requires) == (fitted.name in READ_THE_READING)
    declared = set(fitted.requires)
    wrong = {
        name: values if columns.family_of(name).pattern in declared else 1e6 + 1000.0 * test_rows.time_s
        for name, values in test_rows.data.items()
    }
    expected = fitted.interference(test_rows)
    np.testing.assert_array_equal(fitted.interference(replace(test_rows, data=wrong)), expected)
    np.testing.assert_array_equal(fitted.interference(test_rows.blind(fitted.requires)), expected)


def test_every_declared_family_is_needed(fitted, learned, test_rows):
    for pattern in fitted.requires:
        family = columns.family_of(next(n for n in test_rows.data if columns.family_of(n).pattern == pattern))
        bare, short = (
            replace(r, data={n: v for n, v in r.data.items() if columns.family_of(n) != family})
            for r in (learned, test_rows)
        )
        with pytest.raises(RequestError, match=r"'world' has no column .*, which method .* requires") as error:
            fitted.interference(short)
        assert pattern in str(error.value)
        if pattern not in fitted.unfitted().requires:
            continue  # channels that are found while fitting
        with pytest.raises(RequestError, match=r"'world' has no (column .*, which method .* requires|scalar magnet)"):
            fitted.unfitted().fit(bare)


def test_causal_methods_do_not_look_ahead(fitted, test_rows):
    blind = test_rows.blind()
    changed = {k: np.where(np.arange(1500) < 1000, v, v[::-1]) for k, v in blind.data.items()}
    first = 999 - max(fitted.lookahead_rows or 0, 1)
    before = fitted.interference(blind)[:first]
    after = fitted.interference(replace(blind, data=changed))[:first]
    if fitted.causal:
        np.testing.assert_array_equal(after, before)
    else:
        assert np.abs(after - before).max() > 1e-6


def test_same_seed_same_answer_and_nothing_is_changed(fitted, learned, test_rows):
    copy = {k: v.copy() for k, v in learned.data.items()}
    again = learn(fitted.unfitted(), learned)
    np.testing.assert_array_equal(again.interference(test_rows), fitted.interference(test_rows))
    for name, column in copy.items():
        np.testing.assert_array_equal(learned[name], column)


def test_saved_and_loaded_gives_the_same_bits(fitted, test_rows, tmp_path):
    fitted.save(tmp_path / "a")
    fitted.save(tmp_path / "b")
    back = load(tmp_path / "a")
    assert type(back) is type(fitted)
    assert back.name == fitted.name
    assert back.get_params() == fitted.get_params()
    assert back.sensor_ == "cabin"
    np.testing.assert_array_equal(back.interference(test_rows), fitted.interference(test_rows))
    assert back.warmup_s == fitted.warmup_s
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
    assert len({path.stat().st_mode for path in (tmp_path / "a").iterdir()}) == 1


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("tl16_measured", {}),
        ("magtcn", {"first_stage": "none", "steps": 40, "every": 10}),
        ("bp", {"first_stage": "none", "steps": 4}),
    ],
)
def test_rows_without_a_reading_are_not_learned(name, settings, recording):
    """What stands in these rows does not matter to the fit; the estimate has a value for each row."""
    sides = parts(recording)[:2]
    valid = [np.where((np.arange(len(side)) % 900) < 4, 0.0, 1.0) for side in sides]
    wrong = ("mag_cabin_nt", "interference_cabin_nt")

    def holed(value):
        pairs = zip(sides, valid, strict=True)
        return [
            replace(r, data={**r.data, **{n: np.where(v == 1.0, r[n], value) for n in wrong}, "mag_cabin_valid": v})
            for r, v in pairs
        ]

    quick = METHODS[name] | settings
    one, other = (create(name, **quick).fit(holed(value)) for value in (1e3, -5.0))
    estimate = one.interference(sides[0])
    np.testing.assert_array_equal(estimate, other.interference(sides[0]))
    assert len(estimate) == len(sides[0])
    whole = create(name, **quick).fit(sides).interference(sides[0])
    assert np.abs(estimate - whole).max() > 0.0


class Probe(Compensator):
    """A method that keeps what it is given and answers with one function of the recording."""

    name = "probe"

    def __init__(self, *, function=None):
        self.function = function

    def learn(self, training, context):
        self.training, self.context = training, context

    def estimate(self, recording):
        self.seen = recording
        return np.zeros(len(recording)) if self.function is None else self.function(recording)


class FluxProbe(Probe):
    requires = ("flux_{sensor}_{axis}_nt",)


class ReadingProbe(Probe):
    requires = ("mag_{sensor}_nt", "ins_{angle}_deg")


def test_estimate_is_given_the_declared_families_alone(recording):
    assert FluxProbe().fit(recording).interference(recording).tolist() == [0.0] * len(recording)
    for probe, stems in ((Probe(), ()), (FluxProbe(), ("flux",)), (ReadingProbe(), ("mag", "ins"))):
        probe.fit(recording).interference(recording)
        expected = {n for n in recording.names("input") if n.startswith(stems) and n != "ins_alt_m"} if stems else set()
        assert set(probe.seen.data) == expected
        assert dict(probe.seen.meta) == {"start_utc": recording.meta["start_utc"]}


def test_reading_what_is_not_declared_names_the_declaration(recording):
    method = FluxProbe(function=lambda r: r["mag_cabin_nt"]).fit(recording)
    with pytest.raises(
        RequestError, match=r"method probe: .*no column 'mag_cabin_nt'; .*requires alone: flux_\{sensor"
    ):
        method.interference(recording)
    method = Probe(function=lambda r: r["clean_cabin_nt"]).fit(recording)
    with pytest.raises(RequestError, match=r"no column 'clean_cabin_nt'.*requires alone: none"):
        method.interference(recording)


def test_learning_gets_labels_and_segments_but_no_truth(recording):
    method = FluxProbe().fit(recording)
    training = method.training
    (given,) = training.recordings
    assert training.sensor == method.sensor_ == "cabin"
    assert {columns.role_of(name) for name in given.data} == {"input", "label", "segment"}
    assert dict(given.meta) == {"start_utc": recording.meta["start_utc"]}
    # training and validation rows touch and stay one piece; test rows are not among them
    np.testing.assert_array_equal(given.time_s, recording.time_s[:6400])
    np.testing.assert_array_equal(training.valid[0], recording["split"][:6400] == 1.0)
    assert method.context == FitContext(seed=0, progress=None, checkpoint=None)
    context = FitContext(seed=4)
    assert FluxProbe().fit(recording, context=context).context is context


def test_recordings_lists_files_folders_and_data_sets_can_be_fitted(recording, tmp_path):
    short = recording.take(slice(0, 40))
    short.write(tmp_path / "flight.h5")
    expected = short.labeled()
    given = (short, [short], (short,), tmp_path / "flight.h5", str(tmp_path), [tmp_path], Dataset(tmp_path))
    for data in given:
        assert Probe().fit(data).training.recordings == (expected,)
    assert len(Probe().fit([short, tmp_path, Dataset(tmp_path)]).training.recordings) == 3
    with pytest.raises(RequestError, match="int holds no recordings; allowed: a Recording, a Dataset, the path of a"):
        Probe().fit(3)


def test_the_sensor_is_the_first_one_unless_it_is_named(recording):
    two = replace(recording, data={"mag_wing_nt": recording["mag_cabin_nt"], **recording.data})
    assert Probe().fit(two).sensor_ == "wing"
    method = Probe().fit(two, sensor="cabin")
    assert method.sensor_ == "cabin"
    np.testing.assert_array_equal(method.compensate(two), two["mag_cabin_nt"])
    bare = replace(two, data={"mag_wing_nt": two["mag_wing_nt"]})
    with pytest.raises(RequestError, match="recording 'world' has no column mag_cabin_nt"):
        method.compensate(bare)


def test_estimates_of_another_shape_are_refused(recording):
    with pytest.raises(DataError, match=r"method probe returned shape \(3,\) for 12800 rows"):
        Probe(function=lambda r: np.zeros(3)).fit(recording).interference(recording)


def test_a_fit_that_fails_leaves_a_method_unfitted(recording):
    method = create("tl16").fit(recording)
    assert method.is_fitted
    assert repr(method) == "TollesLawson() fitted for 'cabin'"
    with pytest.raises(DataError):
        method.fit(recording.take(slice(0, 500)))
    assert not method.is_fitted
    for call in (method.interference, method.compensate):
        with pytest.raises(RequestError, match="method tl16 is not fitted yet: call fit first"):
            call(recording)


def test_an_unfitted_copy_has_the_same_name_and_parameters(recording):
    method = create("tl16_gradient", order=2).fit(recording)
    copy = method.unfitted()
    assert not copy.is_fitted
    assert (copy.name, copy.get_params()) == ("tl16_gradient", method.get_params())
    assert method.is_fitted


class Loose(Probe):
    """Parameters without types, one of which must be given."""

    def __init__(self, factor, shift=0.0, *, many=()):
        super().__init__()
        self.factor, self.shift, self.many = factor, shift, many


def test_parameters_without_types_may_be_anything(recording):
    method = Loose([1, 2], shift=None).fit(recording)
    assert method.unfitted().get_params() == {"factor": [1, 2], "shift": None, "many": ()}
    with pytest.raises(RequestError, match=r"method probe: fctor: unknown key \(did you mean 'factor'\?\)"):
        method.set_params(fctor=1)


def test_parameters_can_be_changed_and_are_checked():
    method = create("tl16").set_params(scale="sample")
    assert method.scale == "sample"
    assert method.get_params()["terms"] == 16
    with pytest.raises(RequestError, match="scale"):
        method.set_params(scale="meter")
    with pytest.raises(RequestError, match="unknown key"):
        method.set_params(scael="sample")
    network = create("bp").set_params(steps=7, hidden=[3, 2])
    assert (network.settings.steps, network.settings.hidden) == (7, (3, 2))
    assert repr(create("bp", steps=7)) == "BPCompensator(steps=7)"
    # a value that was set around the check is found when fitting
    method.scale = "meter"
    with pytest.raises(RequestError, match="scale: 'meter' is not allowed"):
        method.fit(calibration(WORLD))


@pytest.mark.parametrize("name", ["fit", "fit_rows", "interference", "compensate", "save", "get_params", "unfitted"])
def test_what_users_call_is_marked_as_final(name):
    assert getattr(getattr(Compensator, name), "__final__", False)
