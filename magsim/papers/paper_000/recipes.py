"""How the networks of paper 000 are trained: its recipe, as far as it can be run where it is run.

The recipe is Adam at 1e-3 on batches of 256 windows of 320 rows, 200 epochs of windows at every offset: 3500 steps for
the circuit that is learned. WilliamsNN and BPNN take all of it. On a CPU ResNet and MagTCN would take a day
and days for each flight, so they take 200 epochs of fewer windows there, and the whole recipe on a GPU alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from magsim.compensation import Compensator, create
from magsim.compensation.networks import NetworkCompensator
from magsim.dataset import Training
from magsim.papers.paper import Effort
from magsim.papers.paper_000.clean import CleanField
from magsim.papers.paper_000.published import EPOCHS

ALL_EPOCHS = EPOCHS[-1]
PARTS = 100
"""Validations of a training; losses are means over two epochs each."""

TUTOR = 0.05
"""Rate v of the loss of MagTCN for each epoch (eq. 39): an estimate, the paper gives none."""

CHANNELS = ("tl16", "angles", "currents", "voltages")
"""Inputs where there are electronics."""


@dataclass(frozen=True)
class TrainingRecipe:
    """Windows of a step, steps of the whole training, and validations."""

    batch: int
    steps: int
    validations: int = PARTS

    @property
    def windows(self) -> int:
        """Windows that are learned in all."""
        return self.batch * self.steps

    @property
    def every(self) -> int:
        """Steps between validations."""
        return self.steps // self.validations


WHOLE = TrainingRecipe(256, 3500)

PART: Mapping[str, TrainingRecipe] = {"resnet": TrainingRecipe(4, 400, 4), "magtcn": TrainingRecipe(4, 600, 20)}
"""On a CPU; each validation of ResNet costs as much as 40 steps."""

QUICK: Mapping[str, TrainingRecipe] = {
    "williams": TrainingRecipe(16, 80, 4),
    "bpnn": TrainingRecipe(16, 80, 4),
    "resnet": TrainingRecipe(4, 12, 4),
    "magtcn": TrainingRecipe(4, 12, 4),
}

SMALL: Mapping[str, Mapping[str, object]] = {
    "williams": {},
    "bpnn": {},
    "resnet": {"width": 4, "blocks": 1},
    "magtcn": {"width": 4},
}
"""Sizes in the quick run, where they are not the paper's."""


def recipe_of(network: str, effort: Effort) -> TrainingRecipe:
    """Return how long a network is trained by the paper's recipe."""
    if effort.quick:
        return QUICK[network]
    return PART.get(network, WHOLE) if effort.device == "cpu" else WHOLE


def settings_of(
    network: str, recipe: TrainingRecipe, training: Training, *, small: bool, channels: bool
) -> dict[str, object]:
    """Return the parameters of a network by its preset ``paper``, with the length of a recipe.

    Where the network is taught Tolles-Lawson first, its weight falls with the epoch, of which there are 200 whatever
    the number of windows.
    """
    found: dict[str, object] = {
        "batch": recipe.batch,
        "steps": recipe.steps,
        "every": recipe.every,
        **(SMALL[network] if small else {}),
        **({"inputs": CHANNELS} if channels else {}),
    }
    if network == "magtcn":
        # the network counts an epoch when as many outputs as there are rows have been learned
        settings = _network(create(network, preset="paper")).settings
        learned = sum(len(r) for r, valid in zip(training.recordings, training.valid, strict=True) if not valid.all())
        passes = recipe.windows * settings.outputs / learned
        found["tutor"] = TUTOR * ALL_EPOCHS / passes
    return found


def by_recipe(network: str, settings: Mapping[str, object], *, clean: bool) -> Compensator:
    """Return an unfitted network of the paper; its output is the interference, or the clean field."""
    if not clean:
        return create(network, preset="paper", **settings)
    # Tolles-Lawson estimates interference: it cannot teach the clean field
    untutored = {name: value for name, value in settings.items() if name != "tutor"}
    params = {**create(network, preset="paper", **untutored).get_params(), "tutor": 0.0, "surgery": False}
    return CleanField(network, params)


def _network(compensator: Compensator) -> NetworkCompensator:
    assert isinstance(compensator, NetworkCompensator)
    return compensator
