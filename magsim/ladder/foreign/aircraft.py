"""A foreign aircraft: what it is made of, and how a recording looks that it has flown."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from magsim import columns
from magsim.ladder.foreign.laws import backlash, dipole, langevin, loop_current, low_pass, preisach, second_order
from magsim.recording import Recording

RATE_HZ = 100.0
LEAD_S, TAIL_S = 30.0, 5.0
"""Flown before and after the rows, mirrored: steel and loops have settled, filters see no edge."""

LUMPS, DIRECTIONS, RELAYS, LOOPS = 5, 3, 48, 4
HIDDEN = 0.3
"""Share of the power that loads without a channel have of the loads' field in band, with the currents below."""

CURRENTS_A = {
    "com_1": 0.36,
    "fuel_pump": 0.31,
    "generator": 0.61,
    "ins_heater": 0.36,
    "panel_feeder": 0.61,
    "strobe": 0.09,
    "survey_supply": 0.36,
}
HIDDEN_A = (0.28, 0.71, 0.14)
"""Usual currents in band of the feeders, and of the loads without a channel before they are scaled [A]: rms over
development flights."""

EDGE_HZ = 3.5


@dataclass(frozen=True)
class ForeignMetal:
    """Steel and loops: places from the scalar magnetometer [m], and what they do.

    Attributes
    ----------
    places_m : (l, 3)
        Of the lumps.
    fixed_am2 : (l, 3) [A m^2]
        Remanent moments.
    axes : (l, d, 3)
        Directions along which a lump is magnetized.
    soft_am2 : (l, d) [A m^2]
        Moment at saturation, anhysteretic.
    bend_nt : (l, d) [nT]
        Field at which it bends.
    hard_am2 : (l, d) [A m^2]
        Moment of all relays together.
    up_nt, down_nt, weights : (l, d, r)
        Of the relays.
    loop_places_m, loop_axes : (k, 3)
    loop_am2_nt : (k,) [A m^2/nT]
        Moment for each nT along the axis that changes faster than the loop can follow.
    tau_s : (k,) [s]
    """

    places_m: np.ndarray
    fixed_am2: np.ndarray
    axes: np.ndarray
    soft_am2: np.ndarray
    bend_nt: np.ndarray
    hard_am2: np.ndarray
    up_nt: np.ndarray
    down_nt: np.ndarray
    weights: np.ndarray
    loop_places_m: np.ndarray
    loop_axes: np.ndarray
    loop_am2_nt: np.ndarray
    tau_s: np.ndarray


@dataclass(frozen=True)
class Fluxgate:
    """The fluxgate: its place from the scalar magnetometer [m], its corner [Hz], and its errors."""

    place_m: np.ndarray
    corner_hz: float
    offset_nt: np.ndarray
    matrix: np.ndarray
    cross: np.ndarray
    noise_nt: float


@dataclass(frozen=True)
class ForeignAircraft:
    """An individual of the foreign type.

    Attributes
    ----------
    metal : ForeignMetal
    fluxgate : Fluxgate
    seed : int
        Of wires and surfaces, each by its name, so that flights with other loads share what they have in common.
    """

    metal: ForeignMetal
    fluxgate: Fluxgate
    seed: int

    @classmethod
    def draw(cls, rng: np.random.Generator) -> "ForeignAircraft":
        """Draw an individual."""
        return cls(_metal(rng), _fluxgate(rng), int(rng.integers(2**62)))

    def fly(self, recording: Recording, sensor: str, rng: np.random.Generator) -> Recording:
        """Return the recording as this aircraft would have made it.

        Parameters
        ----------
        recording : Recording
            With all of its truth, 10 rows a second, without a gap.
        sensor : str
            The scalar magnetometer; others are left out.
        rng : numpy.random.Generator
            Of the flight: what its hidden loads do, and noise.

        Returns
        -------
        Recording
            Readings, label and truth of the magnetometer and the fluxgate anew; the same INS, currents and surfaces.
        """
        fluxgate = recording.fluxgates[0]
        fine = _Fine(recording.time_s)
        background = {name: fine(_background(recording, name)) for name in (sensor, fluxgate)}
        places = {sensor: np.zeros(3), fluxgate: self.fluxgate.place_m}
        hidden = self._hidden_size(sensor) * _hidden_loads(fine.time_s, rng)
        share = _return_share(fine.time_s, rng)
        total = {}
        for name in (sensor, fluxgate):
            steady = self._metal(background[sensor], places[name])
            moved = self._surfaces(recording, fine, name)
            loads = self._loads(recording, fine, name, hidden, share)
            total[name] = background[name] + steady + moved + loads
        strength = np.linalg.norm(total[sensor], axis=1) - np.linalg.norm(background[sensor], axis=1)
        label = fine.rows(low_pass(strength, RATE_HZ, EDGE_HZ))
        reading = second_order(self._read(total[fluxgate]), self.fluxgate.corner_hz, RATE_HZ)
        flux = fine.rows(low_pass(reading, RATE_HZ, EDGE_HZ))
        flux = flux + self.fluxgate.noise_nt * rng.standard_normal(flux.shape)
        return _replaced(recording, sensor, fluxgate, label, flux)

    def _metal(self, ambient: np.ndarray, place_m: np.ndarray) -> np.ndarray:
        """Return the field of steel and loops at a place, (n, 3) [nT]; they feel that at the scalar magnetometer."""
        metal, moments = self.metal, np.zeros((len(ambient), LUMPS, 3))
        for lump in range(LUMPS):
            moments[:, lump] += metal.fixed_am2[lump]
            for way in range(DIRECTIONS):
                axis = metal.axes[lump, way]
                along = ambient @ axis
                soft = metal.soft_am2[lump, way] * langevin(3.0 * along / metal.bend_nt[lump, way])
                thresholds = metal.up_nt[lump, way], metal.down_nt[lump, way], metal.weights[lump, way]
                hard = metal.hard_am2[lump, way] * preisach(along, *thresholds)
                moments[:, lump] += (soft + hard)[:, None] * axis
        field = np.einsum("kij,nkj->ni", dipole(place_m - metal.places_m), moments)
        gains = dipole(place_m - metal.loop_places_m)
        for loop in range(LOOPS):
            axis = metal.loop_axes[loop]
            current = loop_current(ambient @ axis, float(metal.tau_s[loop]), RATE_HZ)
            field += metal.loop_am2_nt[loop] * current[:, None] * (gains[loop] @ axis)
        return field

    def _named(self, what: str, at: str) -> np.random.Generator:
        """Return the generator of a wire or a surface as it is seen from a place."""
        return np.random.default_rng([self.seed, *f"{what} {at}".encode()])

    def _surfaces(self, recording: Recording, fine: "_Fine", at: str) -> np.ndarray:
        """Return the field of magnets on surfaces, behind the play of their linkage, (n, 3) [nT]."""
        out = np.zeros((len(fine.time_s), 3))
        for name, values in _of(recording, columns.TRUE_SURFACE).items():
            rng = self._named(name, at)
            turned = backlash(fine(values), float(self._named(name, "play").uniform(0.2, 0.8)))
            angle = np.radians(turned)
            first, second = rng.normal(0.0, 6.0, (2, 3))
            out += np.sin(angle)[:, None] * first + (np.cos(angle) - 1.0)[:, None] * second
        return out

    def _loads(self, recording: Recording, fine: "_Fine", at: str, hidden: np.ndarray, share: np.ndarray) -> np.ndarray:
        """Return the field of all loads, (n, 3) [nT]: recorded ones, over two return paths, and those that are not."""
        known = np.zeros((len(fine.time_s), 3))
        for name, values in _of(recording, columns.TRUE_CURRENT).items():
            first, second = self._wires(name, at)
            current = fine(values)[:, None]
            known += current * (share[:, None] * first + (1.0 - share[:, None]) * second)
        return np.asarray(known + hidden @ self._hidden_wires(at))

    def _wires(self, name: str, at: str) -> np.ndarray:
        """Return the field of both return paths of a current at a place, (2, 3) [nT/A]."""
        return self._named(name, at).normal(0.0, 0.4, (2, 3))

    def _hidden_wires(self, at: str) -> np.ndarray:
        """Return the field of each load without a channel at a place, (3, 3) [nT/A]."""
        return self._named("hidden", at).normal(0.0, 1.0, (len(HIDDEN_A), 3))

    def _hidden_size(self, sensor: str) -> float:
        """Return how large loads without a channel are on this aircraft: a share of what all make of usual currents."""
        known = sum(
            float(np.sum((ampere * self._wires(columns.TRUE_CURRENT.name(feeder=name), sensor).mean(axis=0)) ** 2))
            for name, ampere in CURRENTS_A.items()
        )
        unknown = float(np.sum((np.array(HIDDEN_A)[:, None] * self._hidden_wires(sensor)) ** 2))
        return float(np.sqrt(HIDDEN / (1.0 - HIDDEN) * known / unknown))

    def _read(self, field: np.ndarray) -> np.ndarray:
        """Return what the fluxgate makes of a field before its filter, (n, 3) [nT]."""
        own = field @ self.fluxgate.matrix.T + self.fluxgate.offset_nt
        across = np.stack([field[:, 1] * field[:, 2], field[:, 2] * field[:, 0], field[:, 0] * field[:, 1]], axis=1)
        return np.asarray(own + self.fluxgate.cross * across / 50_000.0**2)


class _Fine:
    """The times of a recording at 100 Hz, with what is flown before and after it."""

    def __init__(self, time_s: np.ndarray) -> None:
        self._rows_s = time_s
        count = round(LEAD_S * RATE_HZ)
        length = round((time_s[-1] - time_s[0]) * RATE_HZ) + 1 + count + round(TAIL_S * RATE_HZ)
        self.time_s = time_s[0] + (np.arange(length) - count) / RATE_HZ

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Return rows at 100 Hz by a cubic spline, mirrored about both ends."""
        first, last = self._rows_s[0], self._rows_s[-1]
        mirrored = first + np.abs(self.time_s - first)
        mirrored = last - np.abs(last - mirrored)
        return np.asarray(CubicSpline(self._rows_s, values, axis=0)(mirrored))

    def rows(self, values: np.ndarray) -> np.ndarray:
        """Return values at the times of the recording."""
        return np.asarray(values[np.round((self._rows_s - self.time_s[0]) * RATE_HZ).astype(int)])


def _of(recording: Recording, family: columns.Family) -> Mapping[str, np.ndarray]:
    return {name: values for name, values in recording.data.items() if columns.find(name) is family}


def _background(recording: Recording, sensor: str) -> np.ndarray:
    """Return the field without an aircraft at a sensor in body axes, (n, 3) [nT]."""
    names = [
        name for name in columns.BACKGROUND if columns.PART.name(component=name, sensor=sensor, axis="x") in recording
    ]
    parts = [recording.vector(columns.PART, component=name, sensor=sensor) for name in names]
    return np.asarray(np.sum(parts, axis=0))


def _replaced(recording: Recording, sensor: str, fluxgate: str, label: np.ndarray, flux: np.ndarray) -> Recording:
    """Return the recording with readings, label and truth of the foreign aircraft, and nothing of the other's."""
    clean, error = recording[columns.CLEAN.name(sensor=sensor)], recording[columns.ERROR.name(sensor=sensor)]
    made = {
        columns.MAG.name(sensor=sensor): clean + label + error,
        columns.INTERFERENCE.name(sensor=sensor): label,
        columns.CLEAN.name(sensor=sensor): clean,
        columns.TOTAL.name(sensor=sensor): clean + label,
        columns.ERROR.name(sensor=sensor): error,
        **{columns.FLUX.name(sensor=fluxgate, axis=axis): flux[:, i] for i, axis in enumerate("xyz")},
    }
    kept = {
        name: values
        for name, values in recording.data.items()
        if columns.role_of(name) in ("input", "segment") and columns.find(name) not in (columns.MAG, columns.MAG_VALID)
    }
    return replace(recording, data={**kept, **made})


def _hidden_loads(time_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return loads without a channel, (n, 3): a transponder's bursts, a regulated fan, a heater that is on and off."""
    length = time_s[-1] - time_s[0]
    bursts = np.zeros(len(time_s))
    begins = np.sort(rng.uniform(time_s[0], time_s[-1], round(length / 2.5)))
    for begin, lasts in zip(begins, rng.uniform(0.2, 1.0, len(begins)), strict=True):
        bursts[(time_s >= begin) & (time_s < begin + lasts)] = 1.0
    pace_hz = 0.3 + 0.1 * np.sin(time_s / 40.0 + rng.uniform(0.0, 2.0 * np.pi))
    fan = np.sin(2.0 * np.pi * np.cumsum(pace_hz) / RATE_HZ)
    edges = time_s[0] + np.cumsum(rng.uniform(8.0, 30.0, round(length / 8.0) + 2))
    heater = (np.searchsorted(edges, time_s) % 2).astype(float)
    return np.stack([bursts, fan, heater], axis=1)


def _return_share(time_s: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the share of the first return path, which drifts as joints warm up, (n,)."""
    tau_s, step = 600.0, float(rng.uniform(-0.3, 0.3))
    return np.asarray(
        0.5 + step * (1.0 - np.exp(-(time_s - time_s[0]) / tau_s)) + 0.1 * np.sin(time_s / 90.0 + rng.uniform(0.0, 6.0))
    )


def _directions(rng: np.random.Generator, *shape: int) -> np.ndarray:
    drawn = rng.standard_normal((*shape, 3))
    return np.asarray(drawn / np.linalg.norm(drawn, axis=-1, keepdims=True))


def _metal(rng: np.random.Generator) -> ForeignMetal:
    """Draw steel and loops: moments for some hundred nT at the scalar magnetometer, steel 2.2 to 4 m from it."""
    coercive = np.exp(rng.normal(np.log(6_000.0), 0.7, (LUMPS, DIRECTIONS, RELAYS)))
    center = rng.normal(0.0, 25_000.0, (LUMPS, DIRECTIONS, RELAYS))
    weights = rng.dirichlet(np.ones(RELAYS), (LUMPS, DIRECTIONS))
    return ForeignMetal(
        places_m=_directions(rng, LUMPS) * rng.uniform(2.2, 4.0, (LUMPS, 1)),
        fixed_am2=_directions(rng, LUMPS) * rng.uniform(6.0, 45.0, (LUMPS, 1)),
        axes=_directions(rng, LUMPS, DIRECTIONS),
        soft_am2=rng.uniform(25.0, 95.0, (LUMPS, DIRECTIONS)),
        bend_nt=rng.uniform(150_000.0, 400_000.0, (LUMPS, DIRECTIONS)),
        hard_am2=rng.uniform(0.1, 0.6, (LUMPS, DIRECTIONS)),
        up_nt=center + coercive,
        down_nt=center - coercive,
        weights=weights,
        loop_places_m=_directions(rng, LOOPS) * rng.uniform(1.5, 4.0, (LOOPS, 1)),
        loop_axes=_directions(rng, LOOPS),
        loop_am2_nt=rng.uniform(5e-5, 2e-4, LOOPS),
        tau_s=np.array([0.004, 0.012, 0.035, 0.1]) * np.exp(rng.uniform(-0.2, 0.0, LOOPS)),
    )


def _fluxgate(rng: np.random.Generator) -> Fluxgate:
    return Fluxgate(
        place_m=np.array([-3.0, 0.0, 0.0]),
        corner_hz=float(rng.uniform(2.5, 4.0)),
        offset_nt=rng.normal(0.0, 30.0, 3),
        matrix=np.eye(3) + rng.normal(0.0, 0.004, (3, 3)),
        cross=rng.normal(0.0, 10.0, 3),
        noise_nt=0.1,
    )
