"""Neural compensators: torch modules on what a Tolles-Lawson stage leaves. Needs ``aeromagsim[train]``."""

from magsim import training as _training  # noqa: F401 - says first, in plain words, if torch is missing
from magsim.compensation.networks.bp import SampleMLP, WindowMLP
from magsim.compensation.networks.magtcn import MagTCN
from magsim.compensation.networks.methods import BPCompensator, MagTCNCompensator
from magsim.compensation.networks.residual import ResidualNetwork

__all__ = ["BPCompensator", "MagTCN", "MagTCNCompensator", "ResidualNetwork", "SampleMLP", "WindowMLP"]
