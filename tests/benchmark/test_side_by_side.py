"""Methods that are judged side by side: none takes anything from another."""

from dataclasses import replace

import numpy as np
import pytest

from magsim import columns
from magsim.benchmark import evaluate
from magsim.errors import RequestError
from tests.support.methods import Stub, stub, zeros
from tests.support.worlds import World, calibration


@pytest.fixture(scope="module")
def recording():
    return calibration(World())


def test_a_long_warmup_is_refused(recording):
    """It would take rows from all others; before a fit where it is known, and of a fitted method too."""
    slow = stub(warmup=60.1)
    message = r"method stub declares a warm-up of 60\.1 s; allowed: 0 to 60 s"
    with pytest.raises(RequestError, match=message):
        evaluate(recording, [slow, "tl16"])
    assert slow.learned == []
    with pytest.raises(RequestError, match=message):
        evaluate(recording, stub(warmup=60.1).fit(recording))
    assert evaluate(recording, stub(warmup=60.0)).about["warmup_s"] == 60.0


class Scribbler(Stub):
    """Writes over all that it is given, wherever that can be written to."""

    requires = (columns.MAG.pattern, columns.FLUX.pattern)
    name = "scribbler"
    refused = 0

    def spoil(self, arrays):
        for array in arrays:
            try:
                array.flags.writeable = True
                array[:] = 0.0
            except ValueError:
                Scribbler.refused += 1

    def learn(self, training, context):
        for recording in training.recordings:
            self.spoil([recording.time_s, *recording.data.values()])
            recording.meta.clear()
        self.spoil(mask.view(np.int8) for mask in training.valid)
        self.spoil(training.valid)

    def estimate(self, recording):
        self.spoil([recording.time_s, *recording.data.values()])
        recording.meta.clear()
        return np.zeros(len(recording))


def test_a_method_that_scribbles_over_its_inputs_harms_no_other(recording):
    """Scores are those of a run without it, to the last digit; a network learns from the validation rows as well."""
    judged = ["tl16", "tl16_measured", "bp:preset=quick:steps=20:every=5"]
    split = np.where((recording["split"] == 0.0) & (recording.time_s > 500.0), 1.0, recording["split"])
    flown = replace(recording, data={**recording.data, "split": split})
    alone = evaluate(flown, judged)
    beside = evaluate(flown, [Scribbler(function=zeros), *judged, ("again", Scribbler(function=zeros))])
    assert Scribbler.refused > 0
    assert [row for row in beside.rows if row.method in judged] == list(alone.rows)
    assert beside.fits[1:-1] == alone.fits
