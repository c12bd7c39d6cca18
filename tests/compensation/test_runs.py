"""Runs: what they are made of, and how they are kept, resumed and replaced."""

import json
from dataclasses import replace

import numpy as np
import pytest

from magsim.compensation import FitContext, create, load
from magsim.compensation.context import LOG
from magsim.compensation.runs import CHECKPOINT, RUN, Run, fingerprint
from magsim.dataset import training_rows
from magsim.errors import DataError, RequestError
from magsim.storage.parts import part_folder
from tests.support.worlds import World, calibration

QUICK = {"steps": 4, "every": 2, "batch": 2, "hidden": (4,), "hold_out": "blocks", "learning_rate": 1e-3}
QUICK |= {"optimizer": "adam", "weight_decay": 0.0}


@pytest.fixture(scope="module")
def training():
    return training_rows([calibration(World(circuits=1))])


@pytest.fixture(scope="module")
def made_of(training):
    return fingerprint(create("bp", **QUICK), training, preset=None, seed=3)


def fit(folder, training, made_of, progress=None, **how):
    """Open a run and train it."""
    run = Run.open(folder, made_of, **how)
    return run.train(create("bp", **QUICK), training, FitContext(3, progress))


def contents(folder):
    """What must be the same again: the log has the time that was spent."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != LOG}


class Broken(Exception):
    pass


def break_at(phase, step):
    def progress(report):
        if (report.phase, report.step) == (phase, step):
            raise Broken

    return progress


def test_a_fingerprint_holds_settings_and_rows(training, made_of):
    assert {name: made_of[name] for name in ("method", "preset", "seed", "sensor")} == {
        "method": "bp", "preset": None, "seed": 3, "sensor": "cabin",
    }  # fmt: skip
    assert made_of["params"]["hidden"] == [4]
    (rows,) = made_of["rows"]
    assert rows["recording"] == "world"
    assert rows["first_last_rows"] == [[0.0, 639.9, 6400]]
    assert rows["valid_rows"] == 1600
    assert json.loads(json.dumps(made_of)) == made_of


def test_gaps_are_in_the_fingerprint(made_of):
    recording = calibration(World(circuits=1))
    holed = training_rows([recording.take(np.r_[0:1000, 1500:6400])])
    (rows,) = fingerprint(create("tl16"), holed, preset=None, seed=0)["rows"]
    assert rows["first_last_rows"] == [[0.0, 99.9, 1000], [150.0, 639.9, 4900]]


def test_another_value_column_seed_or_setting_gives_another_fingerprint(training, made_of):
    (recording,) = training.recordings
    flux = recording["flux_cabin_x_nt"].copy()
    flux[77] = np.nextafter(flux[77], np.inf)
    changed = (
        replace(recording, data={**recording.data, "flux_cabin_x_nt": flux}),
        replace(recording, data={n: v for n, v in recording.data.items() if n != "ins_alt_m"}),
        replace(recording, time_s=recording.time_s + 0.5),
    )
    others = [
        fingerprint(create("bp", **QUICK), replace(training, recordings=(one,)), preset=None, seed=3) for one in changed
    ]
    others.append(fingerprint(create("bp", **QUICK), training, preset=None, seed=4))
    others.append(fingerprint(create("bp", **QUICK | {"steps": 5}), training, preset=None, seed=3))
    others.append(fingerprint(create("bp", **QUICK), training, preset="quick", seed=3))
    for other in others:
        assert other != made_of
    assert fingerprint(create("bp", **QUICK), training, preset=None, seed=3) == made_of


def test_start_weights_and_precision_belong_to_a_run_and_its_device_does_not(training, made_of, tmp_path):
    create("tl16").fit_rows(training).save(tmp_path)

    def described(**context):
        return fingerprint(create("bp", **QUICK), training, preset=None, seed=3, context=FitContext(**context))

    assert described() == described(device="auto", logs=tmp_path, deterministic=False) == made_of
    narrow, begun = described(precision="bf16"), described(init=tmp_path)
    frozen = described(init=tmp_path, freeze=("a*",))
    assert (narrow["precision"], begun["freeze"], frozen["freeze"]) == ("bf16", [], ["a*"])
    assert len(begun["init"]) == 64
    assert begun["init"] == frozen["init"]
    assert str(tmp_path) not in json.dumps(begun)


def test_a_trained_run_holds_the_method_and_no_checkpoint(training, made_of, tmp_path):
    fitted = fit(tmp_path / "run", training, made_of)
    names = {RUN, "compensator.json", "arrays.npz", "weights.safetensors"}
    assert set(contents(tmp_path / "run")) == names
    assert (tmp_path / "run" / LOG).is_file()
    assert json.loads((tmp_path / "run" / RUN).read_text()) == made_of
    (recording,) = training.recordings
    np.testing.assert_array_equal(load(tmp_path / "run").interference(recording), fitted.interference(recording))
    fit(tmp_path / "again", training, made_of)
    assert contents(tmp_path / "again") == contents(tmp_path / "run")


@pytest.mark.parametrize(("hold_out", "phase"), [("blocks", "fold 1"), ("split", "all")])
def test_a_run_that_was_broken_off_ends_as_one_without_a_break(training, tmp_path, hold_out, phase):
    """In the first training run, and in the second, which is the only one without rows to judge by."""
    rows = replace(training, valid=(np.zeros(6400, dtype=bool),))
    settings = QUICK | {"hold_out": hold_out}
    made_of = fingerprint(create("bp", **settings), rows, preset=None, seed=3)

    def train(folder, progress=None, **how):
        run = Run.open(tmp_path / folder, made_of, **how)
        assert not run.is_complete
        run.train(create("bp", **settings), rows, FitContext(3, progress))

    train("whole")
    with pytest.raises(Broken):
        train("run", break_at(phase, 2))
    assert (tmp_path / "run" / CHECKPOINT).is_dir()
    assert not (tmp_path / "run" / "compensator.json").exists()
    with part_folder(tmp_path / "step_00000002.pt") as part:
        killed = tmp_path / "run" / CHECKPOINT / phase.replace(" ", "_") / part.name
    killed.mkdir()
    (killed / "step_00000002.pt").write_text("half of a state, whose writer was killed")
    steps = []
    train("run", lambda report: steps.append((report.phase, report.step)), resume=True)
    assert steps[0] == (phase, 2)
    assert not (tmp_path / "run" / CHECKPOINT).exists()
    assert contents(tmp_path / "run") == contents(tmp_path / "whole")
    assert Run.open(tmp_path / "run", made_of, resume=True).is_complete


def test_a_run_is_not_touched_without_being_asked_to(training, made_of, tmp_path):
    folder = tmp_path / "run"
    fit(folder, training, made_of)
    before = contents(folder)
    with pytest.raises(RequestError, match="holds a run already: --resume continues a run, --force replaces it, -o na"):
        Run.open(folder, made_of)
    with pytest.raises(RequestError, match="other settings or recordings, which cannot be resumed; --force replaces"):
        Run.open(folder, {**made_of, "seed": 4}, resume=True)
    assert contents(folder) == before
    # replaced: what the run held is gone, and nothing else
    (folder / "notes.txt").write_text("mine")
    run = Run.open(folder, {**made_of, "seed": 4}, force=True)
    assert not run.is_complete
    assert {path.name for path in folder.iterdir()} == {RUN, "notes.txt"}


def test_replacing_a_broken_off_run_removes_its_states_alone(training, made_of, tmp_path):
    folder = tmp_path / "run"
    with pytest.raises(Broken):
        fit(folder, training, made_of, break_at("fold 1", 2))
    (folder / CHECKPOINT / "fold_1" / "notes.txt").write_text("mine")
    Run.open(folder, made_of, force=True)
    assert [path.name for path in (folder / CHECKPOINT / "fold_1").iterdir()] == ["notes.txt"]


def test_folders_that_cannot_be_used_are_refused(made_of, tmp_path):
    with pytest.raises(RequestError, match="holds no run to resume"):
        Run.open(tmp_path / "new", made_of, resume=True)
    assert not (tmp_path / "new").exists()
    (tmp_path / "file").write_text("a file")
    with pytest.raises(RequestError, match="holds files already"):
        Run.open(tmp_path / "file", made_of)
    with pytest.raises(RequestError, match="holds files already"):
        Run.open(tmp_path, made_of)
    with pytest.raises(RequestError, match="cannot make the folder"):
        Run.open(tmp_path / "file" / "run", made_of)
    (tmp_path / "empty").mkdir()
    assert not Run.open(tmp_path / "empty", made_of).is_complete


@pytest.mark.parametrize("text", ["{", "", "[" * 100_000])
def test_a_broken_fingerprint_is_refused(made_of, tmp_path, text):
    Run.open(tmp_path / "run", made_of)
    (tmp_path / "run" / RUN).write_text(text)
    with pytest.raises(DataError, match=r"run\.json is broken"):
        Run.open(tmp_path / "run", made_of, resume=True)


def test_nothing_is_left_of_a_run_that_failed_before_its_first_state(training, made_of, tmp_path):
    short = replace(
        training, recordings=(training.recordings[0].take(slice(0, 500)),), valid=(training.valid[0][:500],)
    )
    with pytest.raises(DataError):
        fit(tmp_path / "run", short, made_of)
    assert not (tmp_path / "run").exists()
    # a folder that held something else stays
    (tmp_path / "own").mkdir()
    run = Run.open(tmp_path / "own", made_of)
    (tmp_path / "own" / "notes.txt").write_text("mine")
    with pytest.raises(DataError):
        run.train(create("bp", **QUICK), short, FitContext(3))
    assert {path.name for path in (tmp_path / "own").iterdir()} == {"notes.txt"}


def test_the_files_that_parameters_name_are_in_the_fingerprint(training, tmp_path):
    """A map that was changed under its name is another run."""
    grid = tmp_path / "map.asc"
    method = create("tl16", target="map", map=str(grid))
    found = []
    for text in ("a", "b", "a"):
        grid.write_text(text)
        found.append(fingerprint(method, training, preset=None, seed=0))
    assert found[0] == found[2] != found[1]
    assert "files" not in fingerprint(create("tl16"), training, preset=None, seed=0)
    create("none").fit_rows(training).save(tmp_path / "model")
    method = create("tl16", target="reference", reference="wing", reference_model=str(tmp_path / "model"))
    before = fingerprint(method, training, preset=None, seed=0)
    (tmp_path / "model" / "compensator.json").write_text("{}")
    assert fingerprint(method, training, preset=None, seed=0) != before
