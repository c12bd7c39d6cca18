#!/usr/bin/env bash
# scipy's quasi-random samplers with one seed, asked for one more dimension or for more points.
#
# Guess:  with the same seed, points in three dimensions are the points in two with a third column beside them, and more
#         points are the old ones with others behind them: a study gets one more factor, or more runs, and keeps what it has.
# Truth:  each sampler does it its own way. A scrambled Sobol sequence keeps its beginning, but one more dimension changes
#         every column. A Latin hypercube keeps neither. A scrambled Halton sequence keeps
#         both. Without scrambling Sobol keeps both, so it is the scrambling that draws for all dimensions in turn.
# Seen:   scipy 1.17.1, numpy 2.4.6, Python 3.11: seed 7, 64 points, 2 and 3 dimensions.
#
# Ends with 0 if this is still so, else with 1. Needs Python with venv and a package index.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/python -m pip install --quiet --disable-pip-version-check scipy==1.17.1 numpy==2.4.6

cat > samplers.py <<'PY'
import sys

import numpy as np
from scipy.stats import qmc

SAMPLERS = {
    "Sobol, scrambled": lambda d: qmc.Sobol(d, scramble=True, rng=np.random.default_rng(7)),
    "Sobol, plain": lambda d: qmc.Sobol(d, scramble=False),
    "Halton, scrambled": lambda d: qmc.Halton(d, scramble=True, rng=np.random.default_rng(7)),
    "Latin hypercube": lambda d: qmc.LatinHypercube(d, rng=np.random.default_rng(7)),
}
EXPECTED = {
    "Sobol, scrambled": (False, True),
    "Sobol, plain": (True, True),
    "Halton, scrambled": (True, True),
    "Latin hypercube": (False, False),
}

found = {}
for name, make in SAMPLERS.items():
    two, three, more = make(2).random(64), make(3).random(64), make(2).random(128)
    same = [bool(np.array_equal(two[:, column], three[:, column])) for column in range(2)]
    found[name] = (all(same), bool(np.array_equal(two, more[:64])))
    kept = ["keeps" if value else "changes" for value in found[name]]
    first = f"first point {two[0].round(4).tolist()} in two, {three[0].round(4).tolist()} in three dimensions"
    print(f"{name}: one more dimension {kept[0]} the columns, more points {kept[1]} the first; {first}")
sys.exit(0 if found == EXPECTED else 1)
PY
venv/bin/python samplers.py
