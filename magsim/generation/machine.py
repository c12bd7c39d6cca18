"""The kind of machine: what decides the last bits of a simulation, and nothing that tells whose machine it is."""

import platform
from importlib.metadata import version

import numpy as np
from threadpoolctl import threadpool_info

import magsim

LIBRARIES = ("numpy", "scipy", "jsbsim", "h5py", "pydantic", "trimesh")
"""Packages whose versions count: they compute, or write what was computed."""


def fingerprint() -> dict[str, str]:
    """Versions and processor features by name.

    On machines that agree in all of them the same scenario gives the same bytes. Processor features are those that
    numpy and OpenBLAS choose their kernels by; the C library's mathematical functions choose by the same.
    """
    import h5py
    import scipy.linalg  # noqa: F401 - loads its own BLAS, so that it is told below

    simd = np.show_config(mode="dicts")["SIMD Extensions"]
    blas = {
        f"{info['internal_api']} {info['version']} {info.get('architecture', '')}".strip()
        for info in threadpool_info()
        if info["user_api"] == "blas"
    }
    libc = " ".join(platform.libc_ver()).strip()
    return {
        "magsim": magsim.__version__,
        "system": platform.system(),
        "processor": platform.machine(),
        "processor_features": " ".join([*simd["baseline"], *simd.get("found", [])]),
        "blas": ", ".join(sorted(blas)),
        "libc": libc or "unknown",
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "hdf5": h5py.version.hdf5_version,
        **{name: version(name) for name in LIBRARIES},
    }


def differences(here: dict[str, str], there: dict[str, str]) -> list[str]:
    """In what two machines differ, in words: ``numpy 2.4.6, not 2.3.0``."""
    names = dict.fromkeys([*there, *here])
    return [
        f"{name} {here.get(name, 'unknown')}, not {there.get(name, 'unknown')}"
        for name in names
        if here.get(name) != there.get(name)
    ]
