"""Fitted methods in folders."""

import json

import numpy as np
import pytest

from magsim.compensation import Compensator, State, create, load
from magsim.compensation import registry as registry_module
from magsim.compensation.saving import ARRAYS, FILES, SETTINGS, read_settings, read_state, write
from magsim.errors import DataError, RequestError
from tests.support.worlds import World, calibration


@pytest.fixture(scope="module")
def recording():
    return calibration(World(circuits=1))


class Learner(Compensator):
    """A method of a user's own: what it learned ends in an underscore, and it does nothing about files."""

    name = "learner"
    requires = ("flux_{sensor}_{axis}_nt",)

    def __init__(self, factor: float = 1.0) -> None:
        self.factor = factor

    def learn(self, training, context):
        self.weights_ = np.arange(3.0)
        self.mean_ = 0.5
        self.count_ = 7
        self.word_ = "x"
        self.none_ = None
        self.flag_ = True
        self.mask_ = np.array([True, False])
        self.scratch = object()
        self._hidden_ = object()

    def estimate(self, recording):
        flux = recording.stack(f"flux_cabin_{axis}_nt" for axis in "xyz")
        return self.factor * (flux @ self.weights_ + self.mean_)


@pytest.fixture
def learner(monkeypatch):
    monkeypatch.setitem(registry_module._REGISTRY, "learner", registry_module.Entry(Learner))
    return Learner


def test_a_method_of_ones_own_is_saved_without_code_for_files(recording, tmp_path, learner):
    method = learner(factor=2.0).fit(recording)
    method.save(tmp_path / "run")
    assert {path.name for path in (tmp_path / "run").iterdir()} == {SETTINGS, ARRAYS}
    back = load(tmp_path / "run")
    np.testing.assert_array_equal(back.interference(recording), method.interference(recording))
    for name in ("mean_", "count_", "word_", "none_", "flag_", "sensor_", "factor"):
        assert getattr(back, name) == getattr(method, name)
    np.testing.assert_array_equal(back.mask_, [True, False])
    assert not hasattr(back, "scratch")
    assert not hasattr(back, "_hidden_")


@pytest.mark.parametrize("value", [object(), [1, 2], {"a": 1}, np.array(["a"]), np.array([None])])
def test_what_cannot_be_saved_is_named(recording, tmp_path, value):
    method = Learner().fit(recording)
    method.tree_ = value
    kind = type(value).__name__
    with pytest.raises(
        RequestError, match=rf"learner cannot be saved: tree_ is of type {kind}; allowed: arrays of num"
    ):
        method.save(tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("name", ["learn", "_secret_", "factor"])
def test_files_cannot_set_what_is_not_learned(name):
    with pytest.raises(ValueError, match="is nothing that fit learns"):
        Learner().set_state(State({name: 1.0}))
    with pytest.raises(ValueError, match="is nothing that fit learns"):
        Learner().set_state(State({}, {name: np.zeros(1)}))


def test_saving_replaces_a_method_only_with_force(recording, tmp_path, learner):
    method = learner().fit(recording)
    method.save(tmp_path)
    method.save(tmp_path)
    with pytest.raises(RequestError, match="exists"):
        method.save(tmp_path, force=False)
    (tmp_path / "file").write_text("")
    with pytest.raises(RequestError, match="cannot make the folder"):
        method.save(tmp_path / "file")
    with pytest.raises(RequestError, match="method learner is not fitted yet"):
        learner().save(tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.fixture
def run(recording, tmp_path):
    create("tl16").fit(recording).save(tmp_path)
    return tmp_path


def test_nothing_is_pickled(run):
    with np.load(run / ARRAYS, allow_pickle=False) as file:
        assert file["coefficients"].shape == (16,)
    assert set(json.loads((run / SETTINGS).read_text())) == {
        "format", "learned", "magsim", "method", "params", "rows", "sensor",
    }  # fmt: skip


def test_folders_without_a_method_are_refused(tmp_path):
    with pytest.raises(RequestError, match=r"holds no fitted method: compensator.json is missing"):
        load(tmp_path)
    with pytest.raises(RequestError, match="holds no fitted method"):
        load(tmp_path / "nothing")


@pytest.mark.parametrize("keep", [0, 100, -10])
def test_truncated_arrays_are_refused(run, keep):
    path = run / ARRAYS
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(DataError, match="the saved method cannot be read"):
        load(run)


def test_pickled_arrays_are_refused(run):
    np.savez(run / ARRAYS, coefficients=np.array([print], dtype=object), allow_pickle=True)
    with pytest.raises(DataError, match="the saved method cannot be read"):
        load(run)


def test_missing_and_misshaped_arrays_are_refused(run):
    for arrays, text in (({}, "coefficients"), ({"coefficients": np.zeros(3)}, r"\(3,\) coefficients for 16 columns")):
        np.savez(run / ARRAYS, **arrays)
        with pytest.raises(DataError, match=f"the saved method cannot be read: .*{text}"):
            load(run)
    (run / ARRAYS).unlink()
    with pytest.raises(DataError, match="the saved method cannot be read"):
        load(run)


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        ({"format": 99}, DataError, "is of format 99"),
        ({"method": "tl99"}, RequestError, "unknown method 'tl99'"),
        ({"method": 3}, DataError, "broken"),
        ({"params": [1]}, DataError, "broken"),
        ({"params": {"terms": 16, "order": "x"}}, RequestError, "order"),
        ({"learned": {}}, DataError, "the saved method cannot be read"),
        ({"learned": 3}, DataError, "the saved method cannot be read"),
    ],
)
def test_changed_settings_are_refused(run, change, error, text):
    settings = json.loads((run / SETTINGS).read_text())
    (run / SETTINGS).write_text(json.dumps(settings | change))
    with pytest.raises(error, match=text):
        load(run)


@pytest.mark.parametrize("text", ["{", "", "[]", "3", "null", '{"format": 1}', "[" * 100_000])
def test_settings_that_are_none_are_refused(run, text):
    (run / SETTINGS).write_text(text)
    with pytest.raises(DataError, match="broken"):
        load(run)


def test_weights_come_back_in_any_memory_order(recording, tmp_path):
    """Weights of a network lie in safetensors, and damaged ones are refused."""
    quick = {"steps": 2, "every": 1, "hidden": (3, 2), "refit": True, "folds": 2}
    method = create("bp", **quick).fit(recording)
    layer = method._fitted.module.layers[0]
    layer.weight.data = layer.weight.data.T.contiguous().T
    method.save(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == set(FILES)
    np.testing.assert_array_equal(load(tmp_path).interference(recording), method.interference(recording))
    data = (tmp_path / "weights.safetensors").read_bytes()
    (tmp_path / "weights.safetensors").write_bytes(data[:-20])
    with pytest.raises(DataError, match=r"the saved method cannot be read: weights.safetensors"):
        load(tmp_path)
    (tmp_path / "weights.safetensors").write_bytes(data[:-3] + bytes([data[-3] ^ 1]) + data[-2:])
    with pytest.raises(DataError, match=r"weights\.safetensors: the weights are not those that were written"):
        load(tmp_path)
    (tmp_path / "weights.safetensors").unlink()
    with pytest.raises(DataError, match=r"cannot be read: .*weights\.safetensors"):
        load(tmp_path)


def test_weights_keep_their_shapes(tmp_path):
    """One number is not a list of one: it has no axis."""
    weights = {"number": np.array(3.0), "one": np.ones(1), "turned": np.arange(6.0).reshape(2, 3).T}
    write(tmp_path, {"method": "x", "params": {}, "sensor": "s"}, State(weights=weights), force=False)
    found = read_state(tmp_path, read_settings(tmp_path)).weights
    assert {name: array.shape for name, array in found.items()} == {"number": (), "one": (1,), "turned": (3, 2)}
    np.testing.assert_array_equal(found["turned"], weights["turned"])
