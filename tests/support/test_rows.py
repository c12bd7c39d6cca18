"""The common form of what the commands in ``tests/benchmarks`` print."""

import json

import numpy as np
import pytest

from tests.benchmarks import tow_rows
from tests.benchmarks.rows import at_least, at_most, collect, finish, stated, within


@pytest.mark.parametrize(("bound", "code"), [(2.0, 0), (0.5, 1)])
def test_figures_of_numpy_are_printed_as_json(bound, code, capsys):
    value = np.float64(1.0)
    rows = [at_most("a", value, "nT", bound), at_least("b", value, "1", 0.0), within("c", value, "s", 0.0, 2.0)]
    with pytest.raises(SystemExit) as caught:
        finish([*rows, stated("d", np.float32(1.0), "s")], as_json=True)
    assert caught.value.code == code
    found = json.loads(capsys.readouterr().out)
    assert [(row["name"], row["value"]) for row in found] == [(name, 1.0) for name in "abcd"]
    assert [row["holds"] for row in found] == [code == 0, True, True, True]


def test_a_subject_that_is_not_there_is_told(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["tow_accuracy.py", "--only", "steady,wings"])
    with pytest.raises(SystemExit) as caught:
        collect(tow_rows, "What it does.")
    assert caught.value.code == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert "no subject is called wings; allowed: modes, moored, speed, steady, steps, swings, whip" in told.err
