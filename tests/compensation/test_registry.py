"""Methods by name, in one line, and from files of one's own."""

import numpy as np
import pytest

from magsim.compensation import Compensator, create, load, make, names, parse_method, register
from magsim.compensation import registry as registry_module
from magsim.errors import DataError, RequestError
from tests.support.worlds import World, calibration

OWN = """\
from pathlib import Path

import numpy as np

from magsim.compensation import Compensator

with (Path(__file__).parent / "runs.txt").open("a") as file:
    file.write("run ")


class Mean(Compensator):
    \"\"\"The mean of the labels.\"\"\"

    name = "mean"

    def __init__(self, factor: float = 1.0) -> None:
        self.factor = factor

    def learn(self, training, context):
        labels = [r[f"interference_{training.sensor}_nt"] for r in training.recordings]
        self.mean_ = float(np.mean(np.concatenate(labels)))

    def estimate(self, recording):
        return np.full(len(recording), self.factor * self.mean_)


class Other:
    pass
"""

NET = """
from torch import nn


class Net(nn.Conv1d):
    def __init__(self, channels, width=3):
        super().__init__(channels, 1, width, padding="same")


def narrow(channels):
    return Net(channels, width=1)
"""


@pytest.fixture(autouse=True)
def _own_registry(monkeypatch):
    monkeypatch.setattr(registry_module, "_REGISTRY", dict(registry_module._REGISTRY))


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(OWN)
    return path


def runs(file):
    """How often the file was run."""
    counter = file.with_name("runs.txt")
    return len(counter.read_text().split()) if counter.exists() else 0


def test_names_and_parameters_are_checked():
    with pytest.raises(RequestError, match=r"unknown method 'magtnc' \(did you mean 'magtcn'\?\); known: none, tl3"):
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
    with pytest.raises(RequestError, match=r"no preset 'qick' \(did you mean 'quick'\?\)"):
        create("magtcn", preset="qick")


@pytest.mark.parametrize("name", names())
def test_a_method_has_the_name_that_makes_it(name):
    assert create(name).name == name
    assert make(name).name == name


@pytest.mark.parametrize("name", names())
def test_presets_are_valid(name):
    method = create(name)
    for preset, params in type(method).presets.items():
        assert create(name, preset=preset).get_params().items() >= params.items()


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
    # whatever the keys are called, the method has to know them
    for key in ("name", "self", "cls"):
        with pytest.raises(RequestError, match=f"{key}: unknown key"):
            create("tl16", **{key: "x"})


def test_make_has_the_settings_of_the_line():
    made = make("tl16_gradient:order=2:vertical=false")
    assert (made.name, made.order, made.vertical, made.terms) == ("tl16_gradient", 2, False, 16)
    assert not made.is_fitted
    network = make("bp:preset=quick:hidden=[3, 2]")
    assert network.get_params() == create("bp", preset="quick", hidden=(3, 2)).get_params()
    with pytest.raises(RequestError, match="unknown method 'tl61'"):
        make("tl61:order=1")
    with pytest.raises(RequestError, match="method tl16: order: 9 is not allowed"):
        make("tl16:order=9")


def test_registered_methods_have_fixed_parameters():
    @register("half", factor=0.5)
    class Half(Compensator):
        name = "half"

        def __init__(self, factor: float = 1.0, shift: float = 0.0) -> None:
            self.factor = factor
            self.shift = shift

        def learn(self, training, context):
            pass

        def estimate(self, recording):
            return np.full(len(recording), self.factor + self.shift)

    assert "half" in names()
    assert make("half:shift=2").get_params() == {"factor": 0.5, "shift": 2.0}
    with pytest.raises(RequestError, match=r"factor is 0.5 by its name"):
        make("half:factor=2")


def test_methods_of_other_packages_are_found_by_their_entry_points(monkeypatch):
    from importlib.metadata import EntryPoint

    point = EntryPoint("theirs", "magsim.compensation.tolles_lawson:TollesLawson", registry_module.GROUP)
    monkeypatch.setattr(registry_module, "entry_points", lambda group: [point] if group == point.group else [])
    assert names()[-1] == "theirs"
    assert make("theirs:terms=3").terms == 3


def test_a_class_in_a_file_of_ones_own(file):
    name = "mine.py:Mean"
    made = make(f"{file}:Mean:factor=2")
    assert (made.name, made.factor) == (name, 2.0)
    assert name in names()
    test = calibration(World(circuits=1))
    learned = test["split"] < 2.0
    expected = 2.0 * np.mean(test["interference_cabin_nt"][learned])
    np.testing.assert_allclose(made.fit(test).interference(test), expected, rtol=1e-12)
    assert type(create(name)) is type(made)
    with pytest.raises(RequestError, match=r"method mine\.py:Mean: factr: unknown key \(did you mean 'factor'"):
        make(f"{file}:Mean:factr=2")


@pytest.mark.parametrize("name", ["Net", "narrow"])
def test_torch_modules_in_a_file_of_ones_own(tmp_path, name):
    path = tmp_path / "my_net.py"
    path.write_text(NET)
    made = make(f"{path}:{name}:window=8:out=seq")
    assert (made.name, type(made).__name__) == (f"my_net.py:{name}", name)
    assert (made.settings.window, made.settings.out) == (8, "seq")
    module = made.make_module(("a", "b")).module
    assert module.weight.shape == (1, 2, 3 if name == "Net" else 1)
    with pytest.raises(RequestError, match=r"method my_net\.py:Net: windw: unknown key \(did you mean 'window'"):
        make(f"{path}:Net:windw=2")


@pytest.mark.parametrize(
    ("content", "name", "text"),
    [
        (None, "Mean", "mine.py: there is no such file"),
        (
            OWN,
            "Men",
            r"mine.py: has no compensator 'Men'; allowed: .*, a class of torch modules, .*; it has \['Mean', 'Other'\]",
        ),
        (OWN, "Other", "has no compensator 'Other'"),
        (OWN, "np", "has no compensator 'np'"),
        ("", "Mean", "it has none"),
        ("import nothing_of_that_name", "Mean", "mine.py: cannot be imported: ModuleNotFoundError: No module named"),
        ("def f(:", "Mean", "mine.py: cannot be imported: SyntaxError"),
        ("1 / 0", "Mean", "mine.py: cannot be imported: ZeroDivisionError: division by zero"),
    ],
)
def test_files_without_the_method_are_refused(tmp_path, content, name, text):
    path = tmp_path / "mine.py"
    if content is not None:
        path.write_text(content)
    before = names()
    with pytest.raises(RequestError, match=text):
        make(f"{path}:{name}")
    assert names() == before


def test_a_file_without_the_name_of_a_class_is_refused(file):
    for line in (f"{file}", f"{file}:factor=2"):
        with pytest.raises(RequestError, match=r"a file needs the name of a class in it, as in my_file\.py:MyMethod"):
            make(line)
    assert runs(file) == 0


def test_loading_a_run_never_runs_the_file_that_it_names(file, tmp_path, monkeypatch):
    """A saved run may come from anywhere: only a file that the user names is run."""
    test = calibration(World(circuits=1))
    make(f"{file}:Mean").fit(test).save(tmp_path / "run")
    assert runs(file) == 1
    assert load(tmp_path / "run").is_fitted
    assert runs(file) == 1

    fresh = {name: entry for name, entry in registry_module._REGISTRY.items() if ".py" not in name}
    monkeypatch.setattr(registry_module, "_REGISTRY", dict(fresh))
    monkeypatch.chdir(file.parent)
    settings = (tmp_path / "run" / "compensator.json").read_text()
    for method in ("mine.py:Mean", str(file) + ":Mean", "magsim.compensation.tolles_lawson:TollesLawson"):
        (tmp_path / "run" / "compensator.json").write_text(settings.replace("mine.py:Mean", method))
        with pytest.raises((RequestError, DataError), match="unknown method"):
            load(tmp_path / "run")
    assert runs(file) == 1

    # once the user has named the file, its runs can be read
    (tmp_path / "run" / "compensator.json").write_text(settings)
    make(f"{file}:Mean")
    np.testing.assert_array_equal(
        load(tmp_path / "run").interference(test), make(f"{file}:Mean").fit(test).interference(test)
    )
