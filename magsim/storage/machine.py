"""What decides the last bits of a computation: the kind of machine and of libraries, and nothing about whose it is."""

import platform
from functools import lru_cache
from importlib.metadata import version

import numpy as np

COMPUTING = ("numpy", "scipy", "numba", "llvmlite", "jsbsim", "trimesh")
"""Packages that compute, or compile what computes."""

WRITING = ("h5py", "pydantic")
"""Packages that read or write what is computed from or was computed."""


@lru_cache(maxsize=1)
def kind_of_machine() -> dict[str, str]:
    """Return what decides the bits of a result in memory, by name.

    Returns
    -------
    dict of str to str
        Processor features are those that numpy and OpenBLAS choose their kernels by; the C library's mathematical
        functions choose by the same. Versions of libraries are those of ``COMPUTING``. Nothing is imported for it.
    """
    simd = np.show_config(mode="dicts")["SIMD Extensions"]
    return {
        "system": platform.system(),
        "processor": platform.machine(),
        "processor_features": " ".join([*simd["baseline"], *simd.get("found", [])]),
        "libc": " ".join(platform.libc_ver()).strip() or "unknown",
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        **{name: version(name) for name in COMPUTING},
    }


def fingerprint() -> dict[str, str]:
    """Return all that decides the bytes of a recording, by name.

    Returns
    -------
    dict of str to str
        ``kind_of_machine``, the versions of magsim and of what writes files, and what shows only in loaded libraries:
        which BLAS runs, with the kernels it chose, and whether Numba takes mathematical functions from Intel's
        SVML. On machines that agree in all of them the same scenario gives the same bytes.
    """
    import h5py
    import numba
    import scipy.linalg  # noqa: F401 - loads a BLAS of its own, which is reported below
    from threadpoolctl import threadpool_info

    import magsim

    blas = {
        f"{info['internal_api']} {info['version']} {info.get('architecture', '')}".strip()
        for info in threadpool_info()
        if info["user_api"] == "blas"
    }
    return {
        "magsim": magsim.__version__,
        **kind_of_machine(),
        "blas": ", ".join(sorted(blas)),
        "hdf5": h5py.version.hdf5_version,
        "numba_math": "svml" if getattr(numba.config, "USING_SVML", False) else "libm",
        **{name: version(name) for name in WRITING},
    }


def differences(here: dict[str, str], there: dict[str, str]) -> list[str]:
    """Return in what two machines differ, in words such as ``numpy 2.4.6, not 2.3.0``.

    What one of them does not state counts as a difference.
    """
    names = dict.fromkeys([*there, *here])
    return [
        f"{name} {here.get(name, 'unknown')}, not {there.get(name, 'unknown')}"
        for name in names
        if here.get(name) != there.get(name)
    ]
