"""Logs of a training run: whole rows, none of them twice."""

import math
import sys
from types import ModuleType

import pytest

from magsim.errors import RequestError
from magsim.training import Progress
from magsim.training.logs import open_logs

HEAD = "phase,step,seconds,loss,validation,best,learning_rate\n"


def at(step, phase="fold 1", loss=0.5):
    return Progress(phase, step, 40, loss, 2.0 + step, 2.0, 1.0, 0.25 * step, 1e-3)


def write(path, *progresses):
    with open_logs(path) as log:
        for progress in progresses:
            log(progress)


def test_a_row_for_each_validation(tmp_path):
    write(tmp_path / "new" / "log.csv", at(0, loss=math.nan), at(10, loss=1 / 3))
    assert (tmp_path / "new" / "log.csv").read_text() == (
        HEAD + "fold 1,0,0.000,,2,2,0.001\n" + "fold 1,10,2.500,0.333333333,12,2,0.001\n"
    )


def test_nothing_is_written_before_the_first_report(tmp_path):
    write(tmp_path / "new" / "log.csv")
    assert not (tmp_path / "new").exists()


def test_a_run_that_continues_has_no_row_twice_and_keeps_other_phases(tmp_path):
    path = tmp_path / "log.csv"
    write(path, at(0, "a"), at(10, "a"), at(0, "b"), at(10, "b"), at(20, "b"))
    with path.open("a") as file:
        file.write("b,30,7.")  # the process was killed here
    write(path, at(10, "b", loss=0.25), at(20, "b"), at(0, "c"))
    rows = [line.split(",") for line in path.read_text().splitlines()[1:]]
    assert [(row[0], row[1]) for row in rows] == [
        ("a", "0"), ("a", "10"), ("b", "0"), ("b", "10"), ("b", "20"), ("c", "0"),
    ]  # fmt: skip
    assert rows[3][3] == "0.25"


def test_a_file_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RequestError, match=r"cannot write the logs in .*file"):
        write(tmp_path / "file" / "log.csv", at(0))


def test_tensorboard_that_is_missing_is_told_before_training(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    with (
        pytest.raises(RequestError, match=r"pip install 'aeromagsim\[tensorboard\]'"),
        open_logs(tmp_path / "log.csv", tmp_path / "events"),
    ):
        pass
    assert not list(tmp_path.iterdir())


def test_event_files_have_a_folder_a_phase_and_begin_where_a_run_continues(tmp_path, monkeypatch):
    calls = []

    class Writer:
        def __init__(self, folder, purge_step):
            self.name = folder[len(str(tmp_path)) :]
            calls.append((self.name, "purge", purge_step))

        def add_scalar(self, name, value, step):
            calls.append((self.name, name, value, step))

        def flush(self):
            pass

        def close(self):
            calls.append((self.name, "close"))

    module = ModuleType("torch.utils.tensorboard")
    module.SummaryWriter = Writer
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", module)
    with open_logs(tmp_path / "log.csv", tmp_path / "events") as log:
        log(at(10, loss=math.nan))
        log(at(0, "all"))
    assert calls == [
        ("/events/fold_1", "purge", 10),
        ("/events/fold_1", "validation", 12.0, 10),
        ("/events/fold_1", "learning_rate", 1e-3, 10),
        ("/events/all", "purge", 0),
        ("/events/all", "loss", 0.5, 0),
        ("/events/all", "validation", 2.0, 0),
        ("/events/all", "learning_rate", 1e-3, 0),
        ("/events/fold_1", "close"),
        ("/events/all", "close"),
    ]
