"""Towing a point with MoorDyn (BSD-3), an independent code for elastic lines in water: here its water is air."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import moordyn
import numpy as np

from magsim.flight.tow.chain import Chain
from magsim.units import G0

DEPTH_M = 100.0
"""Of the hook below the surface: lines out of the water have no drag."""

STIFFNESS_N = 4e5
DAMPING = -0.05
"""Of the stretch: minus the fraction of the critical one."""

STEP_HZ = 120

INPUT = """--------------------- MoorDyn input ------------------------------------------
A point under a rope, towed through air
--------------------- LINE TYPES ---------------------------------------------
Name   Diam   Mass/m   EA    BA/-zeta   EI    Cd   Ca   CdAx   CaAx
(-)    (m)    (kg/m)   (N)   (N-s/-)    (N-m^2)  (-)  (-)  (-)  (-)
rope   {diameter}  {mass_per_m}  {stiffness}  {damping}  0  {normal}  0  {tangential}  0
--------------------- POINTS -------------------------------------------------
ID   Type     X   Y   Z   Mass   Volume   CdA   Ca
(#)  (-)      (m) (m) (m) (kg)   (m^3)    (m^2) (-)
1    Coupled  0   0   {top}     0       0  0       0
2    Free     0   0   {bottom}  {mass}  0  {area}  0
--------------------- LINES --------------------------------------------------
ID   LineType  AttachA  AttachB  UnstrLen  NumSegs  Outputs
(#)  (name)    (#)      (#)      (m)       (-)      (-)
1    rope      1        2        {length}  {links}  -
--------------------- OPTIONS ------------------------------------------------
1  disableOutput
1  disableOutTime
0  writeLog
RK4  tScheme
0.001  dtM
{gravity}  g
{density}  WtrDnsty
1000  WtrDpth
0  TmaxIC
--------------------- OUTPUTS ------------------------------------------------
--------------------- END ----------------------------------------------------
"""


@contextmanager
def silence() -> Iterator[None]:
    """Nothing is printed, not by compiled code either."""
    kept = [os.dup(stream) for stream in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in (1, 2):
            os.dup2(nowhere, stream)
        yield
    finally:
        for stream, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, stream)
            os.close(copy)
        os.close(nowhere)


def towed(folder: Path, chain: Chain, density: float, hook_m: np.ndarray) -> np.ndarray:
    """Places of a point body under its hook, (n, 3) [m] north, east, down from the hook, at the times of ``hook_m``.

    Parameters
    ----------
    folder : Path
        For the files of MoorDyn.
    chain : Chain
        With a ball; it hangs straight down at rest at the beginning.
    density : float [kg/m^3]
    hook_m : (n, 3) [m]
        Places of the hook, north, east, down, ``STEP_HZ`` times a second.
    """
    rope, body = chain.rope, chain.body
    path = folder / "chain.txt"
    text = INPUT.format(
        diameter=rope.diameter_m,
        mass_per_m=rope.mass_per_m,
        stiffness=STIFFNESS_N,
        damping=DAMPING,
        normal=rope.normal_drag,
        tangential=rope.tangential_drag,
        top=-DEPTH_M,
        bottom=-DEPTH_M - rope.length_m,
        mass=body.mass_kg,
        area=body.drag_area_m2[0],
        length=rope.length_m,
        links=chain.links,
        gravity=G0,
        density=density,
    )
    path.write_text(text)
    # up is positive there, and the surface zero
    top = hook_m * np.array([1.0, 1.0, -1.0]) - np.array([0.0, 0.0, DEPTH_M])
    velocity, step_s = np.diff(top, axis=0) * STEP_HZ, 1.0 / STEP_HZ
    out = np.empty_like(top)
    with silence():
        system = moordyn.Create(str(path))
        try:
            moordyn.Init(system, top[0].tolist(), velocity[0].tolist())
            bird = moordyn.GetPoint(system, 2)
            out[0] = moordyn.GetPointPos(bird)
            for k, (at, speed) in enumerate(zip(top[:-1].tolist(), velocity.tolist(), strict=True)):
                moordyn.Step(system, at, speed, k * step_s, step_s)
                out[k + 1] = moordyn.GetPointPos(bird)
        finally:
            moordyn.Close(system)
    return (out - top) * np.array([1.0, 1.0, -1.0])
