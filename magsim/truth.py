"""The magnetic truth of a flight: every part of the field at every mount, at the simulation rate."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from magsim import columns
from magsim.arrays import frozen, readonly


@dataclass(frozen=True)
class FieldTruth:
    """Every magnetic component at each mount, as a vector in the axes of the body that carries it.

    Attributes
    ----------
    time_s : (n,) [s]
        At the simulation rate.
    mounts : tuple of str
        Names of the mounts, in the order of the second axis of ``parts_b``.
    parts_b : mapping of str to (n, s, 3) [nT]
        Parts named in ``magsim.columns.COMPONENTS``; their sum is the whole field. A part that is off is absent.
    currents_a : mapping of str to (n,) [A]
        Current of each circuit, its mean over the step around each time; empty without onboard electronics.
    tilts_b : mapping of str to (n, 3) [rad]
        Rotation vectors, body axes, of the mounts that bend.
    bent_b : mapping of str to (n, 3) [nT]
        Change of the whole field by the bending of these mounts; ``parts_b`` hold it.
    voltages_v : mapping of str to (n,) [V]
        Voltage of each bus, likewise.
    steady_nt : mapping of str to (n,) [nT]
        Length of the background where a mount of a towed bird would be without swing; empty for others.
    """

    time_s: np.ndarray
    mounts: tuple[str, ...]
    parts_b: Mapping[str, np.ndarray]
    currents_a: Mapping[str, np.ndarray] = field(default_factory=dict)
    tilts_b: Mapping[str, np.ndarray] = field(default_factory=dict)
    bent_b: Mapping[str, np.ndarray] = field(default_factory=dict)
    voltages_v: Mapping[str, np.ndarray] = field(default_factory=dict)
    steady_nt: Mapping[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        shape = (len(self.time_s), len(self.mounts), 3)
        for name, part in self.parts_b.items():
            if name not in columns.COMPONENTS:
                msg = f"no part of the field is called {name!r}; allowed: {', '.join(columns.COMPONENTS)}"
                raise ValueError(msg)
            if part.shape != shape:
                msg = f"part {name!r} has shape {part.shape}, expected {shape}"
                raise ValueError(msg)
        object.__setattr__(self, "time_s", readonly(self.time_s))
        object.__setattr__(self, "mounts", tuple(self.mounts))
        object.__setattr__(self, "parts_b", {name: frozen(part) for name, part in self.parts_b.items()})
        for kind in ("tilts_b", "bent_b"):
            object.__setattr__(self, kind, {name: readonly(value) for name, value in getattr(self, kind).items()})
        for kind in ("currents_a", "voltages_v", "steady_nt"):
            rows = {name: readonly(row) for name, row in getattr(self, kind).items()}
            for name, row in rows.items():
                if row.shape != shape[:1]:
                    msg = f"{kind} {name!r} has shape {row.shape}, expected {shape[:1]}"
                    raise ValueError(msg)
            object.__setattr__(self, kind, rows)

    @property
    def rate_hz(self) -> float:
        """Sample rate [Hz]."""
        return float((len(self.time_s) - 1) / (self.time_s[-1] - self.time_s[0]))

    def part(self, name: str, mount: str) -> np.ndarray:
        """Return one part at one mount, (n, 3) [nT]."""
        return self.parts_b[name][:, self.mounts.index(mount)]

    def background(self, mount: str) -> np.ndarray:
        """Return the field at one mount without the aircraft, (n, 3) [nT]: the sum of the background parts."""
        return self._sum(columns.BACKGROUND, mount)

    def platform(self, mount: str) -> np.ndarray:
        """Return the aircraft's own field at one mount, (n, 3) [nT]: the sum of the platform's parts."""
        return self._sum(columns.PLATFORM, mount)

    def total(self, mount: str) -> np.ndarray:
        """Return the whole field at one mount, (n, 3) [nT]: the exact vector sum."""
        return self.background(mount) + self.platform(mount)

    def _sum(self, names: tuple[str, ...], mount: str) -> np.ndarray:
        out = np.zeros((len(self.time_s), 3))
        for name in names:
            if name in self.parts_b:
                out += self.part(name, mount)
        return out
