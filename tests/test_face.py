"""What a notebook user types first works, and wrong types get one line that says what is allowed."""

import re
import subprocess
import sys

import pytest

import magsim
from magsim.errors import RequestError
from tests.support.paths import ROOT
from tests.support.worlds import World, calibration


@pytest.fixture(scope="module")
def recording():
    return calibration(World())


def test_the_readme_in_python_runs(calibration, monkeypatch):
    """The block of the page as it stands, with the shipped flight in place of one that is flown for it."""
    (block,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL)
    asked = []

    def simulate(scenario, **more):
        asked.append((scenario, more))
        return calibration

    monkeypatch.setattr("magsim.simulation.simulate", simulate)
    names: dict[str, object] = {}
    exec(compile(block, "README.md", "exec"), names)
    assert asked == [("calibration_c208b", {"seed": 3, "set": {"air.turbulence_mps": 1.5}})]
    report = names["report"]
    assert report.methods == ("tolles_lawson", "tl18", "noise_floor")
    assert [fit.method for fit in report.fits if fit.given] == ["tolles_lawson"]
    assert names["clean_estimate"].shape == (len(calibration),)


@pytest.mark.parametrize("first", ["import magsim.benchmark", "magsim.evaluate", "from magsim.benchmark import judge"])
def test_benchmark_is_a_package_whatever_was_imported_before(first):
    code = f"import magsim\n{first}\nimport magsim.benchmark\nprint(type(magsim.benchmark).__name__)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "module\n"
    assert "benchmark" not in magsim.__all__


def test_every_public_name_is_there():
    for name in magsim.__all__:
        assert getattr(magsim, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'simulat'"):
        _ = magsim.simulat


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda r: magsim.evaluate(r, 3), "3 is no method; allowed: a name such as 'tl16', a compensator, or a pair"),
        (lambda r: magsim.evaluate(r, ["tl16", 3]), "3 is no method; allowed"),
        (lambda r: magsim.evaluate(3, ["tl16"]), "int holds no recordings; allowed: a Recording, a Dataset, the path"),
        (
            lambda r: magsim.evaluate(r, "tl16", seed="a"),
            "seed 'a' is not allowed; allowed: a whole number of 0 or more",
        ),
        (lambda r: magsim.FitContext(-1), "seed -1 is not allowed"),
        (lambda r: magsim.TollesLawson(terms=17).fit(r), "terms: 17 is not allowed; allowed: 3, 8, 9, 16, 18"),
        (lambda r: magsim.TollesLawson().fit(3), "int holds no recordings; allowed"),
        (lambda r: magsim.TollesLawson().fit(r, sensor="x"), "no scalar magnetometer 'x'; it has cabin"),
        (lambda r: magsim.TollesLawson().fit(r, context=3), "context is of type int; allowed: a FitContext"),
        (lambda r: magsim.TollesLawson().interference(r), "is not fitted yet: call fit first"),
        (lambda r: magsim.TollesLawson().fit(r).interference(3), "the interference of a Recording, not of int"),
        (lambda r: magsim.load_scenario(3), "scenario: is of type int; allowed: a name or a path"),
        (lambda r: magsim.load_aircraft(3), "aircraft: is of type int; allowed: a name or a path"),
        (lambda r: magsim.Dataset(3), "data set: is of type int; allowed: the path of a folder"),
        (lambda r: r.plot("x"), "there is no figure 'x'; allowed: flight, field"),
        (lambda r: r.reads("y"), "has no scalar magnetometer 'y'; it has cabin"),
    ],
)
def test_what_is_wrong_gets_one_line_that_says_what_is_allowed(recording, call, text):
    with pytest.raises(RequestError, match=re.escape(text)) as caught:
        call(recording)
    assert "\n" not in str(caught.value)


def test_one_method_needs_no_list(recording):
    for methods in ("tl16", ("mine", magsim.TollesLawson()), magsim.TollesLawson()):
        assert len(magsim.evaluate(recording, methods).methods) == 1


def test_the_package_is_marked_as_typed():
    assert (ROOT / "magsim" / "py.typed").is_file()
