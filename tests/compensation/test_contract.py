"""What every method of the registry must keep."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from magsim.compensation import Compensator, create, load, names, parse_method, register
from magsim.compensation import registry as registry_module
from magsim.errors import DataError, RequestError
from tests.support.worlds import World, calibration, parts

QUICK = {"steps": 40, "every": 10, "batch": 4, "hold_out": "legs"}
METHODS = {
    "none": {},
    "tl16": {},
    "tl18": {"scale": "sample", "derivative": "spline"},
    "tl16_measured": {},
    "tl18_measured": {},
    "tl16_gradient": {},
    "tl16_gradient plain": {"order": 0, "vertical": False, "derivative": "spline"},
    "magtcn": {**QUICK, "width": 2, "kernel": 11},
    "magtcn last": {**QUICK, "width": 2, "kernel": 11, "window": 50, "head": "last"},
    "bp": QUICK,
    "bp window": {**QUICK, "per": "window", "window": 50, "hidden": (4,)},
}
WORLD = World(eddy_tau_s=0.01)


def learn(method, train, valid):
    """Fit, and shift the weights of a network, since one that is trained so little may still put out nothing."""
    method.fit([train, valid], sensor="cabin")
    if method.resumable:
        generator = torch.Generator().manual_seed(0)
        with torch.no_grad():
            for parameter in method._fitted.module.parameters():
                parameter.add_(0.1 * torch.randn(parameter.shape, generator=generator))
    return method


@pytest.fixture(scope="module", params=METHODS)
def fitted(request):
    method = create(request.param.split()[0], **METHODS[request.param])
    train, valid, test = parts(calibration(WORLD))
    return learn(method, train, valid), train, valid, test.take(slice(0, 1500))


def test_every_method_of_the_package_is_checked():
    assert {name.split()[0] for name in METHODS} == set(names())


def test_estimate_has_one_value_for_each_row_after_the_warmup(fitted):
    method, _, _, test = fitted
    estimate = method.interference(test.blind())
    assert estimate.shape == (len(test),)
    assert estimate.dtype == float
    late = test.time_s - test.time_s[0] >= method.warmup_s - 1e-9
    assert np.isfinite(estimate[late]).all()
    assert np.isnan(estimate[~late]).all()
    np.testing.assert_array_equal(method.compensate(test.blind())[late], (test["mag_cabin_nt"] - estimate)[late])


def test_estimate_does_not_depend_on_the_scalar_reading(fitted):
    method, _, _, test = fitted
    assert not any(pattern.startswith("mag") for pattern in method.requires)
    blind = test.blind()
    shifted = replace(blind, data={**blind.data, "mag_cabin_nt": blind["mag_cabin_nt"] + 1000.0 * blind.time_s})
    np.testing.assert_array_equal(method.interference(blind), method.interference(shifted))


def test_estimate_reads_what_it_declares_and_nothing_else(fitted):
    method, _, _, test = fitted
    blind = test.blind()
    stems = [pattern.split("{")[0] for pattern in method.requires]
    kept = {k: v for k, v in blind.data.items() if any(k.startswith(stem) for stem in stems)}
    if kept:
        np.testing.assert_array_equal(method.interference(replace(blind, data=kept)), method.interference(blind))


def test_causal_methods_do_not_look_ahead(fitted):
    method, _, _, test = fitted
    blind = test.blind()
    changed = {k: np.where(np.arange(1500) < 1000, v, v[::-1]) for k, v in blind.data.items()}
    before = method.interference(blind)[:998]
    after = method.interference(replace(blind, data=changed))[:998]
    if method.causal:
        np.testing.assert_array_equal(after, before)
    else:
        assert np.abs(after - before).max() > 1e-6


@pytest.mark.parametrize("name", ["tl16_measured", "magtcn", "bp"])
def test_rows_without_a_reading_are_not_learned(name):
    """The fit is that of the recordings without these rows; the estimate has a value for each row."""
    sides = parts(calibration(WORLD))[:2]
    valid = [np.where((np.arange(len(side)) % 900) < 4, 0.0, 1.0) for side in sides]
    wrong = ("mag_cabin_nt", "interference_cabin_nt")
    holed = [
        replace(r, data={**r.data, **{n: np.where(v == 1.0, r[n], 1e3) for n in wrong}, "mag_cabin_valid": v})
        for r, v in zip(sides, valid, strict=True)
    ]
    cut = [r.take(v == 1.0) for r, v in zip(sides, valid, strict=True)]
    quick = METHODS[name] | ({} if name.startswith("tl") else {"first_stage": "none"})
    one, other = (create(name, **quick).fit([a], sensor="cabin", valid=[b]) for a, b in (holed, cut))
    blind = holed[0].blind()
    np.testing.assert_array_equal(one.interference(blind), other.interference(blind))
    assert len(one.interference(blind)) == len(holed[0])


def test_same_seed_same_answer_and_nothing_is_changed(fitted):
    method, train, valid, test = fitted
    copies = [{k: v.copy() for k, v in r.data.items()} for r in (train, valid, test)]
    again = learn(type(method)(**method.get_params()), train, valid)
    np.testing.assert_array_equal(again.interference(test.blind()), method.interference(test.blind()))
    for r, copy in zip((train, valid, test), copies, strict=True):
        for name, column in copy.items():
            np.testing.assert_array_equal(r[name], column)


def test_saved_and_loaded_gives_the_same_bits(fitted, tmp_path):
    method, _, _, test = fitted
    method.save(tmp_path / "a")
    method.save(tmp_path / "b")
    back = load(tmp_path / "a")
    assert type(back) is type(method)
    assert back.get_params() == method.get_params()
    assert back.sensor_ == "cabin"
    np.testing.assert_array_equal(back.interference(test.blind()), method.interference(test.blind()))
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
    assert len({path.stat().st_mode for path in (tmp_path / "a").iterdir()}) == 1


def test_broken_runs_are_told(tmp_path):
    train, _, _ = parts(calibration(WORLD))
    with pytest.raises(RequestError, match="holds no fitted method"):
        load(tmp_path)
    with pytest.raises(RequestError, match="not fitted yet"):
        create("tl16").save(tmp_path)
    create("tl16").fit([train], sensor="cabin").save(tmp_path)
    arrays = (tmp_path / "arrays.npz").read_bytes()
    (tmp_path / "arrays.npz").write_bytes(arrays[:100])
    with pytest.raises(DataError, match="cannot be read"):
        load(tmp_path)
    (tmp_path / "arrays.npz").write_bytes(arrays)
    settings = json.loads((tmp_path / "compensator.json").read_text())
    (tmp_path / "compensator.json").write_text(json.dumps(settings | {"format": 99}))
    with pytest.raises(DataError, match="format 99"):
        load(tmp_path)
    (tmp_path / "compensator.json").write_text("{")
    with pytest.raises(DataError, match="is broken"):
        load(tmp_path)
    (tmp_path / "compensator.json").write_text(json.dumps(settings | {"method": "tl99"}))
    with pytest.raises(RequestError, match="unknown method 'tl99'"):
        load(tmp_path)


def test_names_and_parameters_are_checked():
    with pytest.raises(RequestError, match=r"unknown method 'magtnc' \(did you mean 'magtcn'\?\); known: none, tl16"):
        create("magtnc")
    with pytest.raises(RequestError, match=r"derivativ: unknown key \(did you mean 'derivative'\?\)"):
        create("tl16", derivativ="spline")
    with pytest.raises(RequestError, match="terms is 16 by its name"):
        create("tl16", terms=18)
    with pytest.raises(RequestError) as error:
        create("bp", steps=0, activation="rely")
    assert len(str(error.value).splitlines()) == 2
    with pytest.raises(RequestError, match=r"kernel: .*even"):
        create("magtcn", kernel=50)
    with pytest.raises(RequestError, match=r"no preset 'dmo' \(did you mean 'demo'\?\)"):
        create("magtcn", preset="dmo")
    with pytest.raises(RequestError, match="scale"):
        create("tl16").set_params(scale="meter")


@pytest.mark.parametrize("name", names())
def test_a_method_knows_the_name_that_makes_it(name):
    assert create(name).name == name


def test_a_method_in_one_line():
    assert parse_method("tl16") == ("tl16", {})
    text = " tl16_gradient: order = 2 :vertical=false:fluxgate=rear:scale='sample'"
    settings = {"order": 2, "vertical": False, "fluxgate": "rear", "scale": "sample"}
    assert parse_method(text) == ("tl16_gradient", settings)
    assert parse_method("bp:hidden=[8, 4]:learning_rate=1e-3")[1] == {"hidden": [8, 4], "learning_rate": 1e-3}
    assert parse_method("bp:preset=2")[1] == {"preset": "2"}
    for wrong in ("tl16:scale", "tl16:", "tl16:=3", "tl16:scale="):
        with pytest.raises(RequestError, match="is not of the form key=value, as in tl16_gradient:order=2"):
            parse_method(wrong)
    with pytest.raises(RequestError, match="method tl16:terms=16:terms=16: terms is given twice"):
        parse_method("tl16:terms=16:terms=16")
    # whatever the keys are called, it is the method that has to know them
    for key in ("name", "self", "cls"):
        with pytest.raises(RequestError, match=f"{key}: unknown key"):
            create("tl16", **{key: "x"})


@pytest.mark.parametrize("name", names())
def test_presets_are_valid(name):
    method = create(name)
    for preset, params in type(method).presets.items():
        assert create(name, preset=preset).get_params().items() >= params.items()


def test_a_method_of_ones_own(monkeypatch):
    monkeypatch.setattr(registry_module, "_REGISTRY", dict(registry_module._REGISTRY))

    @register("half")
    class Half(Compensator):
        name = "half"

        def __init__(self, factor: float = 0.5) -> None:
            self.factor = factor

        def fit(self, train, *, sensor, valid=(), seed=0):
            self.sensor_ = sensor
            return self

        def interference(self, recording):
            return self.factor * recording["flux_cabin_x_nt"]

    assert "half" in names()
    assert create("half", factor=2).factor == 2.0


class Learner(Compensator):
    """A method of a user's own: it names what it learned with an underscore and says nothing of files."""

    name = "learner"

    def fit(self, train, *, sensor, valid=(), seed=0):
        self.weights_ = np.arange(3.0)
        self.mean_ = 0.5
        self.sensor_ = sensor
        return self

    def interference(self, recording):
        flux = recording.stack(f"flux_cabin_{axis}_nt" for axis in "xyz")
        return flux @ self.weights_ + self.mean_


def test_a_users_own_method_is_saved_without_a_word_about_files(tmp_path, monkeypatch):
    test = calibration(World(circuits=1))
    monkeypatch.setitem(registry_module._REGISTRY, "learner", registry_module.Entry(Learner))
    method = Learner().fit([test], sensor="cabin")
    method.save(tmp_path / "run")
    back = load(tmp_path / "run")
    np.testing.assert_array_equal(back.interference(test.blind()), method.interference(test.blind()))


def test_what_cannot_be_saved_is_named(tmp_path):
    method = Learner().fit([calibration(World(circuits=1))], sensor="cabin")
    method.tree_ = object()
    with pytest.raises(RequestError, match=r"learner cannot be saved: tree_ is of type object"):
        method.save(tmp_path / "run")
