"""Neural compensators: torch modules on what a Tolles-Lawson stage leaves. Needs ``aeromagsim[train]``."""

from magsim import training as _training  # noqa: F401 - its message about a missing torch comes first
from magsim.compensation.networks.compensator import NetworkCompensator
from magsim.compensation.networks.methods.magtcn import MagTCNCompensator
from magsim.compensation.networks.methods.newer import GABPCompensator, PGTLNetCompensator, WaveletBiLSTMCompensator
from magsim.compensation.networks.methods.own import TorchCompensator
from magsim.compensation.networks.methods.perceptrons import BPCompensator, BPNNCompensator
from magsim.compensation.networks.methods.recurrent import GRUBPCompensator, LSTMBPCompensator, LSTMCompensator
from magsim.compensation.networks.methods.res_bp import ResBpCompensator
from magsim.compensation.networks.methods.resnet import ResNetCompensator
from magsim.compensation.networks.methods.subnetworks import SubnetworksCompensator
from magsim.compensation.networks.methods.williams import WilliamsCompensator

__all__ = [
    "BPCompensator",
    "BPNNCompensator",
    "GABPCompensator",
    "GRUBPCompensator",
    "LSTMBPCompensator",
    "LSTMCompensator",
    "MagTCNCompensator",
    "NetworkCompensator",
    "PGTLNetCompensator",
    "ResBpCompensator",
    "ResNetCompensator",
    "SubnetworksCompensator",
    "TorchCompensator",
    "WaveletBiLSTMCompensator",
    "WilliamsCompensator",
]
