"""Training of torch modules: windows of arrays and of recordings, loop, checkpoints. Knows no compensator."""

from magsim.errors import RequestError

try:
    import safetensors  # noqa: F401 - checked here, used by the submodules
    import torch  # noqa: F401
except ImportError as error:
    MESSAGE = f"networks need torch and safetensors ({error}): pip install 'aeromagsim[train]'"
    raise RequestError(MESSAGE) from None

from magsim.training.checkpoint import Checkpoint
from magsim.training.determinism import reproducible, seeded
from magsim.training.devices import Machine
from magsim.training.gradients import project_conflicts
from magsim.training.levenberg import LevenbergPlan, train_levenberg
from magsim.training.loop import Plan, train
from magsim.training.run import Outcome, Progress
from magsim.training.spool import Spool, SpooledWindows
from magsim.training.streaming import Position, WindowDataset, WindowLoader
from magsim.training.weights import freeze, put_weights
from magsim.training.windows import ArrayWindows, RandomBatches, WindowSource, overlap_add, starts_of

__all__ = [
    "ArrayWindows",
    "Checkpoint",
    "LevenbergPlan",
    "Machine",
    "Outcome",
    "Plan",
    "Position",
    "Progress",
    "RandomBatches",
    "Spool",
    "SpooledWindows",
    "WindowDataset",
    "WindowLoader",
    "WindowSource",
    "freeze",
    "overlap_add",
    "project_conflicts",
    "put_weights",
    "reproducible",
    "seeded",
    "starts_of",
    "train",
    "train_levenberg",
]
