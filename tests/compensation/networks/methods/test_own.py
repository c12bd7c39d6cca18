"""Any torch module as a method: what it may be, how it starts, its files, and what is refused."""

from functools import partial

import numpy as np
import pytest
import torch
from torch import nn

from magsim import TorchCompensator
from magsim.compensation import create, load, register, registry
from magsim.errors import DataError, RequestError
from magsim.signals import spans
from tests.support.worlds import World, calibration

QUICK = {"steps": 6, "every": 3, "batch": 4, "window": 20, "inputs": ("tl16",)}


@pytest.fixture(autouse=True)
def _restored(monkeypatch):
    monkeypatch.setattr(registry, "_REGISTRY", dict(registry._REGISTRY))
    with torch.random.fork_rng():
        yield


@pytest.fixture(scope="module")
def recording():
    return calibration(World(circuits=1))


class Last(nn.Module):
    """The last sample of a window, from all of it."""

    def __init__(self, channels, window, hidden=3):
        super().__init__()
        self.layers = nn.Sequential(nn.Flatten(), nn.Linear(channels * window, hidden), nn.Tanh(), nn.Linear(hidden, 1))

    def forward(self, x):
        return self.layers(x)


class Convolution(nn.Module):
    """Every sample of a window, with dropout and batch statistics."""

    def __init__(self, channels):
        super().__init__()
        self.layers = nn.Sequential(
            nn.Conv1d(channels, 4, 5, padding=2), nn.BatchNorm1d(4), nn.Dropout(0.5), nn.ReLU(), nn.Conv1d(4, 1, 1)
        )

    def forward(self, x):
        return self.layers(x)


class Always(nn.Module):
    """Returns what a function makes of the windows."""

    def __init__(self, function):
        super().__init__()
        self.function, self.weight = function, nn.Parameter(torch.ones(()))

    def forward(self, x):
        return self.function(x)


def always(function):
    return lambda channels: Always(function)


def shaken(method):
    """The fitted method with other weights: one that is trained so little may return nothing."""
    with torch.no_grad():
        for parameter in method._fitted.module.parameters():
            parameter.add_(0.1 * torch.randn(parameter.shape, generator=torch.Generator().manual_seed(1)))
    return method


@pytest.mark.parametrize(("factory", "out"), [(Last, "last"), (Convolution, "seq")])
def test_a_module_is_a_method_like_any_other(factory, out, recording, tmp_path):
    register(factory.__name__)(factory)
    method = shaken(TorchCompensator(factory, out=out, band_weight=0.0, **QUICK).fit(recording))
    assert method.name == factory.__name__
    assert isinstance(method.module_, factory)
    estimate = method.interference(recording)
    warm = 19 if out == "last" else 0
    assert np.flatnonzero(np.isnan(estimate)).tolist() == list(range(warm))
    assert method.warmup_s == pytest.approx(warm / 10.0)
    assert method.causal == (out == "last")
    assert method.lookahead_rows == (1 if out == "last" else None)
    method.save(tmp_path)
    assert (tmp_path / "weights.safetensors").exists()
    back = load(tmp_path)
    np.testing.assert_array_equal(back.interference(recording), estimate)
    assert back.get_params() == method.get_params()
    again = shaken(method.unfitted().fit(recording))
    np.testing.assert_array_equal(again.interference(recording), estimate)


def test_the_untrained_module_returns_zeros_and_learns_from_the_first_step(recording):
    stage = create("tl16").fit(recording).interference(recording)
    method = TorchCompensator(Last, **QUICK | {"steps": 1, "learning_rate": 1e-12}).fit(recording)
    np.testing.assert_allclose(method.interference(recording)[19:], stage[19:], rtol=0, atol=1e-6)
    made = method.make_module(tuple("abc"))
    optimizer = torch.optim.Adam(made.parameters(), lr=0.05)
    x, first = torch.randn(64, 3, 20), None
    wanted = torch.tanh(x[:, :1, -1])
    for _ in range(200):
        optimizer.zero_grad()
        loss = ((made(x) - wanted) ** 2).mean()
        first = first or float(loss.detach())
        loss.backward()
        optimizer.step()
    assert first == pytest.approx(float((wanted**2).mean()))
    assert float(loss.detach()) < 0.2 * first


def test_a_module_that_starts_at_zero_by_itself_has_no_factor():
    class Own(Last):
        def start_at_zero(self):
            nn.init.zeros_(self.layers[-1].weight)
            nn.init.zeros_(self.layers[-1].bias)

    made = TorchCompensator(Own, **QUICK).make_module(tuple("abc"))
    assert made.gain is None
    made.start_at_zero()
    assert not made(torch.randn(2, 3, 20)).any()
    plain = TorchCompensator(Last, **QUICK).make_module(tuple("abc"))
    assert plain.gain.item() == 0.0
    with torch.no_grad():
        plain.gain.fill_(2.0)
    plain.start_at_zero()
    assert plain.gain.item() == 0.0


def test_a_stream_gives_what_the_recording_gives(recording):
    rows = recording.where(split="valid").take(slice(0, 120))
    method = shaken(TorchCompensator(Last, **QUICK).fit(recording))
    stream = method.stream()
    found = [stream.push({"time_s": t, **{n: float(rows[n][i]) for n in rows.data}}) for i, t in enumerate(rows.time_s)]
    got = [row.interference_nt for row in (*filter(None, found), *stream.finish())]
    np.testing.assert_allclose(got, method.interference(rows), rtol=0, atol=1e-9)


def test_dropout_is_decided_by_the_seed_and_by_the_step(recording, tmp_path):
    from magsim.compensation import FitContext

    params = {**QUICK, "out": "seq", "band_weight": 0.0, "first_stage": "none", "learning_rate": 0.05}

    class Broken(Exception):
        pass

    def breaks(progress):
        if progress.step == 3:
            raise Broken

    torch.manual_seed(5)
    whole = TorchCompensator(Convolution, **params).fit(recording)
    torch.manual_seed(6)
    with pytest.raises(Broken):
        TorchCompensator(Convolution, **params).fit(recording, context=FitContext(progress=breaks, checkpoint=tmp_path))
    torch.manual_seed(7)
    resumed = TorchCompensator(Convolution, **params).fit(recording, context=FitContext(checkpoint=tmp_path))
    assert repr(resumed.outcomes_) == repr(whole.outcomes_)
    np.testing.assert_array_equal(resumed.interference(recording), whole.interference(recording))


def test_factories_are_called_as_their_signature_says():
    got = []

    def one(channels):
        got.append((channels,))
        return Last(channels, 20)

    def two(inputs, length):
        got.append((inputs, length))
        return Last(inputs, length)

    def named(channels, hidden=2, *, window=None):
        got.append((channels, hidden, window))
        return Last(channels, window, hidden)

    for factory in (one, two, named, partial(Last, hidden=2), lambda *given: Last(given[0], 20)):
        assert TorchCompensator(factory, **QUICK).make_module(tuple("abcd")).module.layers[1].in_features == 80
    assert got == [(4,), (4, 20), (4, 2, 20)]
    assert TorchCompensator(partial(Last, hidden=2), **QUICK).name == "Last"


@pytest.mark.parametrize("shape", ["b1", "b", "bt", "b1t"])
def test_shapes_that_are_taken(shape):
    out = "seq" if "t" in shape else "last"
    makes = {
        "b1": lambda x: x[:, :1, -1],
        "b": lambda x: x[:, 0, -1],
        "bt": lambda x: x[:, 0],
        "b1t": lambda x: x[:, :1],
    }
    made = TorchCompensator(always(makes[shape]), out=out, **QUICK).make_module(tuple("abc"))
    assert made(torch.ones(5, 3, 20)).shape == (5, 20 if out == "seq" else 1)


def test_windows_that_overlap_by_three_quarters_are_the_default():
    assert TorchCompensator(Last, window=20).settings.hop == 5


def raises(*_):
    msg = "no such size"
    raise ValueError(msg)


@pytest.mark.parametrize(
    ("factory", "settings", "text"),
    [
        (
            lambda c: Always(lambda x: x),
            {},
            r"returned shape \(2, 16, 20\) for windows of shape \(2, 16, 20\); allowed ",
        ),
        (lambda c: Always(lambda x: x[:, 0]), {}, r"\(2, 1\) or \(2,\); that is out 'seq'"),
        (
            lambda c: Always(lambda x: x[:, :1, 0]),
            {"out": "seq"},
            r"with out 'seq': \(2, 20\) or \(2, 1, 20\); that is out 'last'",
        ),
        (lambda c: Always(lambda x: (x, x)), {}, r"returned tuple for windows of shape .*; allowed: a tensor"),
        (lambda c: Always(lambda x: x[:, :1, 0] * torch.nan), {}, "returned nan for finite windows"),
        (lambda c: Always(raises), {}, r"raised ValueError for float32 windows of shape \(2, 16, 20\): no such size"),
        (
            lambda c: Always(lambda x: x[:, :, 0] @ torch.ones(16, 1)),
            {},
            r"raised RuntimeError for float64 windows of shape .*",
        ),
        (lambda c: Always(lambda x: x[:, 0, -1] - x[:, 0, -1].mean()), {}, "depends on the other windows of its batch"),
        (raises, {}, "raises raised ValueError for 16 channels: no such size"),
        (lambda c, w: raises(), {}, "raised ValueError for 16 channels and a window of 20: no such size"),
        (lambda c: np.zeros(3), {}, r"returned ndarray; allowed: a torch\.nn\.Module"),
        (lambda c, w, d: None, {}, r"takes c, w, d; allowed: .*\(channels\) or .*\(channels, window\)"),
        (lambda: None, {}, "takes nothing; allowed"),
    ],
)
def test_modules_that_cannot_be_used_are_refused_before_they_are_trained(factory, settings, text, recording):
    with pytest.raises(RequestError, match=text):
        TorchCompensator(factory, **QUICK | settings).fit(recording)


def test_what_is_no_factory_is_refused():
    for thing, text in ((Last(3, 20), "Last is no factory; allowed: a class"), (3, "int is no factory")):
        with pytest.raises(RequestError, match=text):
            TorchCompensator(thing)
        with pytest.raises(RequestError, match=text if thing == 3 else "is no factory"):
            TorchCompensator.of(thing)
    with pytest.raises(RequestError, match="TorchCompensator needs a factory"):
        TorchCompensator(window=20)
    with pytest.raises(RequestError, match="'mine': 3 is neither a subclass of Compensator nor makes torch modules"):
        register("mine")(3)


def test_a_state_that_is_no_tensor_is_refused(recording):
    class Extra(Last):
        def get_extra_state(self):
            return {"a": 1}

        def set_extra_state(self, state):
            pass

    with pytest.raises(RequestError, match="_extra_state of its state_dict is of type dict; allowed: tensors"):
        TorchCompensator(Extra, **QUICK).fit(recording)


def test_windows_longer_than_the_pieces_are_refused(recording):
    with pytest.raises(DataError, match=r"a window has 9000 rows, but the longest piece without a gap has"):
        TorchCompensator(always(lambda x: x[:, 0, -1]), **QUICK | {"window": 9000}).fit(recording)


def test_an_output_that_is_not_finite_is_named(recording):
    method = shaken(TorchCompensator(Last, **QUICK).fit(recording))
    with torch.no_grad():
        method.module_.layers[-1].bias.fill_(torch.inf)
    start = recording.time_s[next(iter(spans(recording.time_s))).start + 19]
    with pytest.raises(DataError, match=f"the network of method Last returned inf at {start:g} s for finite inputs"):
        method.interference(recording)


def test_weights_of_another_module_are_refused(recording, tmp_path):
    TorchCompensator(Last, **QUICK).fit(recording).save(tmp_path)
    with pytest.raises(RequestError, match="unknown method 'Last'"):
        load(tmp_path)
    register("Last")(partial(Last, hidden=7))
    with pytest.raises(DataError, match="the weights do not fit the network"):
        load(tmp_path)


def test_loading_does_not_depend_on_the_start_weights(recording, tmp_path):
    """Lazy layers get their shapes from the first windows they see, which are those of the check."""

    def lazy(channels):
        return nn.Sequential(nn.Flatten(), nn.LazyLinear(2), nn.Tanh(), nn.LazyLinear(1))

    register("lazy")(lazy)
    method = shaken(TorchCompensator(lazy, **QUICK).fit(recording))
    method.save(tmp_path)
    np.testing.assert_array_equal(load(tmp_path).interference(recording), method.interference(recording))
