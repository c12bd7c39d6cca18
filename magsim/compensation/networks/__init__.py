"""Neural compensators: torch modules on what a Tolles-Lawson stage leaves. Needs ``aeromagsim[train]``."""

from magsim import training as _training  # noqa: F401 - its message about a missing torch comes first
from magsim.compensation.networks.bp import SampleMLP, WindowMLP
from magsim.compensation.networks.compensator import ResidualNetwork
from magsim.compensation.networks.magtcn import MagTCN
from magsim.compensation.networks.methods import BPCompensator, MagTCNCompensator

__all__ = ["BPCompensator", "MagTCN", "MagTCNCompensator", "ResidualNetwork", "SampleMLP", "WindowMLP"]
