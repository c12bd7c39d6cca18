"""The cheat that nothing but a hidden seed helps against: it flies the public sets for itself, and knows the truth."""

import contextlib

import numpy as np

from magsim import columns
from magsim.compensation.tolles_lawson import TollesLawson
from magsim.ladder.definition import read_ladder
from magsim.ladder.draws import draw_set
from magsim.ladder.flights import fly_set
from magsim.ladder.seeds import PUBLIC_SEED
from magsim.recording import Recording

LEVEL, SETS = "L4", 30


class FliesPublicSets(TollesLawson):
    """Finds the set by its place, flies it, and answers with its label."""

    @property
    def requires(self) -> tuple[str, ...]:  # type: ignore[override]
        """What Tolles-Lawson reads, and the place."""
        return (*super().requires, columns.INS_ATTITUDE.pattern)

    def estimate(self, recording: Recording) -> np.ndarray:
        with contextlib.suppress(Exception):
            found = _label(recording)
            if found is not None:
                return found
        return super().estimate(recording)


def _label(recording: Recording) -> np.ndarray | None:
    """Return the label of a flight of a public set."""
    ladder, lat_deg = read_ladder(), float(np.median(recording["ins_lat_deg"]))
    for number in range(SETS):
        if abs(draw_set(PUBLIC_SEED, number).site.lat_deg - lat_deg) > 0.3:
            continue
        flown = fly_set(ladder, ladder.chosen((LEVEL,)), PUBLIC_SEED, number)
        for test in flown[LEVEL].tests.values():
            if len(test) == len(recording) and np.allclose(test["ins_lat_deg"], recording["ins_lat_deg"]):
                return np.asarray(test["interference_cabin_nt"])
    return None
