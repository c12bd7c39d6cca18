"""Settings of a network that learns what a closed-form first stage leaves."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from magsim.compensation.background import Direction
from magsim.errors import RequestError
from magsim.training import Plan

Count = Annotated[int, Field(ge=1)]
Folds = Annotated[int, Field(ge=0, le=20)]
Weight = Annotated[float, Field(ge=0.0)]
Rate = Annotated[float, Field(gt=0.0, le=1.0)]


def _odd(value: int) -> int:
    if value % 2 == 0:
        msg = f"{value} is even; a kernel has an odd number of samples"
        raise ValueError(msg)
    return value


Kernel = Annotated[int, Field(ge=1), AfterValidator(_odd)]
Optimizer = Literal["adam", "lm"]
WHOLE = ("flights", "days", "individuals")
"""What may be held out of flights that are read one at a time."""
OF_ADAM = ("batch", "learning_rate", "decay", "surgery")
"""Settings that Levenberg-Marquardt does not heed."""
FirstStage = Literal[
    "none",
    "tl16",
    "tl18",
    "tl16_measured",
    "tl18_measured",
    "tl16_calibrated",
    "tl16_auxiliary",
    "exact_norm",
    "exact_norm_model",
    "exact_norm_measured",
]
Input = Literal[
    "tl16",
    "tl18",
    "auxiliary",
    "attitude",
    "angles",
    "rates",
    "coupled",
    "accelerations",
    "currents",
    "voltages",
    "surfaces",
    "position",
    "travel",
    "height",
    "time",
]


def _each_once(words: tuple[str, ...]) -> tuple[str, ...]:
    for word in words:
        if words.count(word) > 1:
            msg = f"{word!r} is given {words.count(word)} times"
            raise ValueError(msg)
    return words


Inputs = Annotated[tuple[Input, ...], Field(min_length=1), AfterValidator(_each_once)]


@dataclass(frozen=True, kw_only=True)
class NetworkSettings:
    """What all networks on a first stage have in common.

    Attributes
    ----------
    inputs : tuple of str
        What the network reads; see ``magsim.compensation.networks.inputs``.
    direction : {"fluxgate", "ins", "calibrated"}
        Where the direction of the field is taken from, in the inputs ``tl16``, ``tl18`` and ``auxiliary`` and in a
        first stage ``tl16`` or ``tl18``, measured or not; see ``TollesLawson``.
    first_stage : str
        Closed-form stage: ``none`` or a method of that name.
    stage_band : {"in", "broad"}
        How a stage ``tl16`` or ``tl18`` is fitted.
    fluxgate : str, optional
        The first one of the first recording if not given.
    scale : {"constant", "sample"}
        Field strength in the Tolles-Lawson columns; see ``TollesLawson``.
    window : int
        Rows of a window.
    stride : int, optional
        Rows between overlapping windows in use; a quarter of the window if not given.
    band_weight : float
        Weight of the in-band error in the loss, beside the broadband error with weight 1; both relative to what the
        stage leaves.
    weight_decay : float
        Weight of the squared parameters beside the mean squared error.
    tutor : float
        Decay rate v of paper 000's loss for each epoch; 0 learns the truth alone.
    surgery : bool
        Free the gradients of the two losses of ``tutor`` from conflicts.
    target : {"interference", "measured"}
        The label; or the reading itself, for networks that model the field beside the platform.
    optimizer : {"adam", "lm"}
        Adam on random windows; or Levenberg-Marquardt in float64 on all rows, for small networks
        (``magsim.training.train_levenberg``).
    hold_out : {"split", "legs", "blocks", "flights", "days", "individuals"}
        What a fold leaves out; see ``magsim.compensation.networks.folds``.
    folds : int
        Most folds, 2 or more; 0 trains once, for all steps.
    stage_for : {"all", "flight"}
        What stage, and inputs that need a fit, are fitted to: all rows together; or those of each flight by themselves,
        which are read one flight at a time. See ``magsim.compensation.networks.pretraining``.
    shrink : bool
        Use as much of the network's output as holds on rows that it has not learned; else all.
    refit : bool
        Train once more, on all rows, for the answer; else it is the mean of the networks of the folds.
    steps, batch, learning_rate, decay, every, patience, threads
        See ``magsim.training.Plan``.
    """

    inputs: Inputs = ("tl16", "attitude")
    direction: Direction = "fluxgate"
    first_stage: FirstStage = "tl16"
    stage_band: Literal["in", "broad"] = "in"
    fluxgate: str | None = None
    scale: Literal["constant", "sample"] = "constant"
    window: Count = 320
    stride: Count | None = None
    band_weight: Weight = 1.0
    weight_decay: Weight = 0.0
    tutor: Weight = 0.0
    surgery: bool = False
    steps: Count = 3000
    batch: Count = 16
    learning_rate: Rate = 3e-3
    decay: bool = True
    every: Count = 100
    patience: Count = 10
    target: Literal["interference", "measured"] = "interference"
    optimizer: Optimizer = "adam"
    hold_out: Literal["split", "legs", "blocks", "flights", "days", "individuals"] = "blocks"
    folds: Folds = 3
    stage_for: Literal["all", "flight"] = "all"
    shrink: bool = True
    refit: bool = True
    threads: Count = 1

    @property
    def context(self) -> int | None:
        """Rows that an output is made from, its own the last of them; None where it sees both sides of its window.

        A network with a context gives an output for the last ``outputs`` rows of its window.
        """
        return None

    @property
    def outputs(self) -> int:
        """Rows of a window that have an output."""
        return self.window if self.context is None else self.window - self.context + 1

    @property
    def hop(self) -> int:
        """Rows between overlapping windows in use."""
        return max(self.window // 4, 1) if self.stride is None else self.stride

    def check(self) -> None:
        """Refuse settings that do not go together.

        Raises
        ------
        RequestError
        """
        if self.hop > self.window:
            msg = f"stride {self.stride} is more than window {self.window}: rows between windows would have no output"
            raise RequestError(msg)
        if self.context is not None and self.context > self.window:
            msg = f"window: {self.window} rows are fewer than the {self.context} that an output is made from"
            raise RequestError(msg)
        if self.folds == 1 and self.hold_out != "split":
            msg = (
                f"folds 1: one fold of {self.hold_out} leaves all of them out and nothing to learn; allowed: 2 or "
                "more, or 0 to train once, on all rows"
            )
            raise RequestError(msg)

        if self.stage_for == "flight":
            self._check_for_flight()

    def _check_for_flight(self) -> None:
        if self.optimizer == "lm":
            msg = (
                "stage_for 'flight' learns from windows that are read from disk, and optimizer 'lm' takes all rows at "
                "once; allowed: optimizer 'adam'"
            )
            raise RequestError(msg)
        if self.folds and self.hold_out not in WHOLE:
            msg = (
                f"hold_out {self.hold_out!r} is not allowed with stage_for 'flight', which holds out whole groups; "
                f"allowed: {', '.join(WHOLE)}, or folds = 0"
            )
            raise RequestError(msg)

    def refuse_of_adam(self, presets: Mapping[str, Mapping[str, object]]) -> None:
        """Refuse settings of Adam beside Levenberg-Marquardt, unless they are those of the method or of a preset.

        Raises
        ------
        RequestError
        """
        if self.optimizer != "lm":
            return
        default = {field.name: field.default for field in fields(self)}
        for name in OF_ADAM:
            value = getattr(self, name)
            usual = [default[name], *(preset[name] for preset in presets.values() if name in preset)]
            if value not in usual:
                msg = (
                    f"{name} {value!r} has no effect with optimizer 'lm'; leave it out, or train with optimizer 'adam'"
                )
                raise RequestError(msg)

    def plan(self, steps: int) -> Plan:
        """Return the plan of a training run of so many steps."""
        return Plan(
            max(steps, 1), self.learning_rate, self.decay, self.every, self.patience, self.surgery, self.threads
        )
