"""What a contest is asked for, and what it answers."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

Status = Literal["ok", "needs", "failed", "crashed", "timed_out", "not_finite", "bad_shape", "warmup"]


@dataclass(frozen=True)
class Contestant:
    """A method as it travels: text alone.

    Attributes
    ----------
    name : str
        In tables.
    method : str
        A name with settings, ``my_file.py:MyMethod``, or the folder of a trained run of a registered method. A file may
        import magsim and installed packages, and nothing else.
    quick : bool
        Take the preset ``quick`` where there is one.
    """

    name: str
    method: str
    quick: bool = False


@dataclass(frozen=True)
class Allowance:
    """What a method may use.

    Attributes
    ----------
    fit_s, estimate_s : float [s]
        Wall time of a fit, and of the estimates of one round.
    memory_mb : float [MB]
        What each of its processes may hold.
    """

    fit_s: float = 600.0
    estimate_s: float = 300.0
    memory_mb: float = 8192.0


@dataclass(frozen=True)
class Costs:
    """What a method has cost; NaN where it is not known.

    The judge reads times, memory and bytes itself; ``parameters`` is the method's own word. Processes that a method
    starts beside its own are not counted.

    Attributes
    ----------
    fit_cpu_s, fit_wall_s : float [s]
    estimate_us : float [us]
        Processor time of one row.
    peak_mb : float [MB]
        Of the fit, with Python and its libraries.
    state_bytes : float
        Files of the fitted method.
    parameters : float
        Numbers in its state.
    """

    fit_cpu_s: float = math.nan
    fit_wall_s: float = math.nan
    estimate_us: float = math.nan
    peak_mb: float = math.nan
    state_bytes: float = math.nan
    parameters: float = math.nan


@dataclass(frozen=True)
class Finish:
    """What became of a method.

    Attributes
    ----------
    status : str
        ``ok``, or why it has no estimates. ``needs``: it says that something is missing; ``failed``: it says that the
        data are not enough; ``crashed``: its process ended, raised, or sent what is no answer; ``timed_out``;
        ``not_finite``: an estimate is not a number outside of the warm-up, or beyond all measure; ``bad_shape``;
        ``warmup``: it declares a longer warm-up than is allowed.
    reason : str
        One line; empty where it is ok.
    estimates : tuple of tuple of (n,) [nT]
        By round and recording, in the order of the request; 0 in the warm-up where it has none. Empty unless ok.
    requires : tuple of str
        Column families that it was given for its estimates.
    adapts : bool
        It says that it learns while it estimates.
    lookahead_rows : int or None
        Later rows that it says it needs; None for no limit.
    pretrained : bool
        It came fitted.
    learned : tuple of str
        Digests of the rows that it says it has learned, if it came fitted.
    costs : Costs
    """

    status: Status
    reason: str = ""
    estimates: tuple[tuple[np.ndarray, ...], ...] = ()
    requires: tuple[str, ...] = ()
    adapts: bool = False
    lookahead_rows: int | None = None
    pretrained: bool = False
    learned: tuple[str, ...] = ()
    costs: Costs = Costs()


class LostError(Exception):
    """A method has lost its row."""

    def __init__(self, reason: str, status: Status) -> None:
        super().__init__(reason)
        self.status: Status = status
        self.reason = reason
