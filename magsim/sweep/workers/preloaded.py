"""What processes of this machine have before they are forked: all imports, and numba's own tables."""

import h5py  # noqa: F401 - imported by the first file that is written
import numpy as np

import magsim.sweep.workers.local  # noqa: F401 - what the processes run
from magsim.field.kernels import summed

# The first compiled function that is called has numba fill its tables, which takes half a second.
summed(np.zeros((1, 3, 1)), np.zeros((1, 1)))
