"""What surrounds a fit: values that are refused, and logs."""

import csv

import pytest

from magsim.compensation import FitContext, create
from magsim.errors import RequestError
from tests.support.worlds import World, calibration


@pytest.fixture(scope="module")
def recording():
    return calibration(World(circuits=1))


@pytest.fixture(scope="module")
def saved(recording, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    create("tl16").fit(recording).save(folder)
    return folder


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"seed": -1}, "seed -1 is not allowed; allowed: a whole number of 0 or more"),
        ({"seed": True}, "seed True is not allowed"),
        ({"device": "gpu"}, "device 'gpu' is not allowed; allowed: cpu, cuda, cuda:0, cuda:1, ..., auto"),
        ({"device": "cuda:"}, "device 'cuda:' is not allowed"),
        ({"device": None}, "device None is not allowed"),
        ({"precision": "fp16"}, "precision 'fp16' is not allowed; allowed: float32, bf16"),
        ({"freeze": ("a*",)}, r"freeze \('a\*',\) is not allowed; allowed: beside init"),
        ({"freeze": "a*"}, "freeze 'a\\*' is not allowed; allowed: a tuple of patterns"),
        ({"tensorboard": True}, "tensorboard True is not allowed; allowed: beside logs"),
    ],
)
def test_values_that_are_not_allowed(values, expected):
    with pytest.raises(RequestError, match=expected):
        FitContext(**values)


@pytest.mark.parametrize("device", ["cpu", "auto", "cuda", "cuda:0", "cuda:13"])
def test_devices_that_may_be_asked_for(device):
    assert FitContext(device=device).device == device


def test_weights_start_from_a_saved_method_alone(tmp_path, saved):
    with pytest.raises(RequestError, match="holds no fitted method"):
        FitContext(init=tmp_path)
    assert FitContext(init=saved, freeze=("blocks.*",)).freeze == ("blocks.*",)


def test_a_method_without_steps_refuses_what_it_would_not_heed(recording, saved, tmp_path):
    asked = {"device": "auto", "precision": "bf16", "deterministic": False, "logs": tmp_path, "init": saved}
    for name, value in asked.items():
        with pytest.raises(RequestError, match=f"{name}: method tl16 is not trained in steps"):
            create("tl16").fit(recording, context=FitContext(**{name: value}))
    create("tl16").fit(recording, context=FitContext(seed=3, progress=print, checkpoint=tmp_path))
    assert not list(tmp_path.iterdir())


def test_training_is_logged_and_shown(recording, tmp_path):
    seen = []
    method = create("bp", steps=4, every=2, hidden=(4,), folds=2)
    method.fit(recording, context=FitContext(progress=seen.append, logs=tmp_path / "logs"))
    with (tmp_path / "logs" / "log.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["phase"], int(row["step"])) for row in rows] == [(p.phase, p.step) for p in seen]
    assert [float(row["validation"]) for row in rows] == pytest.approx([p.valid for p in seen], rel=1e-8)
    assert len(rows) >= 3
