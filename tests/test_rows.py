"""The common form of what the commands in ``tests/benchmarks`` print."""

import json

import numpy as np
import pytest

from tests.benchmarks.rows import at_least, at_most, finish, stated, within


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
