"""Tracks: what a method is given to learn from, and to estimate with.

Labels without noise exist nowhere but in a simulation. So the tracks without them come first.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from magsim import columns
from magsim.columns import Family
from magsim.compensation import create
from magsim.config.schema import did_you_mean
from magsim.errors import RequestError
from magsim.ladder.flights import LevelFlights
from magsim.recording import Recording

CLASSIC: tuple[Family, ...] = (columns.MAG, columns.MAG_VALID, columns.FLUX)
"""A scalar magnetometer and a fluxgate, no attitude."""

INS: tuple[Family, ...] = (
    columns.INS_ATTITUDE,
    columns.INS_VELOCITY,
    columns.INS_ALTITUDE,
    columns.INS_ACCELERATION,
    columns.INS_RATE,
    columns.BARO_ALTITUDE,
    columns.BARO_PRESSURE,
    columns.RADAR,
)

CHANNELS: tuple[Family, ...] = (columns.CURRENT, columns.VOLTAGE, columns.SURFACE)

REFERENCE = "stinger"
"""The scalar magnetometer whose compensated reading stands for a label on the track ``reference``."""


@dataclass(frozen=True)
class LadderTrack:
    """One track.

    Attributes
    ----------
    name, title : str
    inputs : tuple of Family
        What a method may read, if it declares it.
    label : {"none", "truth", "stinger"}
        What it learns from besides: nothing but the reading; the noise-free interference; the reading minus a
        compensated stinger.
    later : bool
        It is judged on another day than the one it was calibrated on.
    """

    name: str
    title: str
    inputs: tuple[Family, ...]
    label: str
    later: bool = False

    @property
    def baseline(self) -> str:
        """Return the method that all others are compared with."""
        return "tl16_measured" if self.label == "none" else "tl16"


TRACKS: Mapping[str, LadderTrack] = {
    track.name: track
    for track in (
        LadderTrack("no-labels", "all channels, no labels: what a survey has", (*CLASSIC, *INS, *CHANNELS), "none"),
        LadderTrack(
            "frozen",
            "no labels, calibrated once, flown on another day",
            (*CLASSIC, *INS, *CHANNELS),
            "none",
            later=True,
        ),
        LadderTrack("classic", "scalar magnetometer and fluxgate; noise-free labels", CLASSIC, "truth"),
        LadderTrack("closed", "with INS, barometer and radar; noise-free labels", (*CLASSIC, *INS), "truth"),
        LadderTrack("open", "all channels; noise-free labels", (*CLASSIC, *INS, *CHANNELS), "truth"),
        LadderTrack(
            "reference", "all channels; the label is a compensated stinger", (*CLASSIC, *INS, *CHANNELS), "stinger"
        ),
    )
}
"""In the order of the board."""


def chosen_tracks(names: Sequence[str]) -> tuple[LadderTrack, ...]:
    """Return tracks by name, in the board's order.

    Raises
    ------
    RequestError
        If there is no such track.
    """
    for name in names:
        if name not in TRACKS:
            msg = f"there is no track {name!r}{did_you_mean(name, TRACKS)}; allowed: {', '.join(TRACKS)}"
            raise RequestError(msg)
    return tuple(track for track in TRACKS.values() if track.name in names)


def training_of(track: LadderTrack, flights: LevelFlights, sensor: str) -> tuple[Recording, ...] | None:
    """Return what a method is given to learn from; None where the level has no label of the track's kind.

    Of scalar readings the judged one alone: another magnetometer's would be the answer.
    """
    recordings: Sequence[Recording] = flights.training
    if track.label == "stinger":
        if sensor == REFERENCE or any(REFERENCE not in recording.scalars for recording in recordings):
            return None
        recordings = _labeled_by_stinger(recordings, sensor)
    return tuple(_reduced(recording, track, sensor, labels=track.label != "none") for recording in recordings)


def judged_flights(track: LadderTrack, flights: LevelFlights) -> Mapping[str, Recording]:
    """Return the flights that are judged, whole, by role."""
    return flights.later if track.later else flights.tests


def blind_of(track: LadderTrack, recording: Recording, sensor: str) -> Recording:
    """Return what a method may see of a flight that is judged."""
    return _reduced(recording, track, sensor, labels=False).blind()


def _reduced(recording: Recording, track: LadderTrack, sensor: str, *, labels: bool) -> Recording:
    label = {columns.INTERFERENCE.name(sensor=sensor)}

    def wanted(name: str) -> bool:
        family = columns.family_of(name)
        if family in (columns.MAG, columns.MAG_VALID):
            return name in (columns.MAG.name(sensor=sensor), columns.MAG_VALID.name(sensor=sensor))
        if family.role == "input":
            return family in track.inputs
        return family.role == "segment" or (labels and name in label)

    return replace(recording, data={name: values for name, values in recording.data.items() if wanted(name)})


def _labeled_by_stinger(recordings: Sequence[Recording], sensor: str) -> list[Recording]:
    """Return recordings whose label is the reading minus that of the stinger, compensated without labels.

    So the label has the noise of both magnetometers, what the stinger's compensation leaves, and the background's
    difference between the two places.
    """
    own = [
        replace(one, data={k: v for k, v in one.data.items() if columns.role_of(k) != "label"}) for one in recordings
    ]
    method = create("tl16_measured").fit(own, sensor=REFERENCE)
    out = []
    for recording in recordings:
        label = recording[columns.MAG.name(sensor=sensor)] - method.compensate(recording)
        out.append(replace(recording, data={**recording.data, columns.INTERFERENCE.name(sensor=sensor): label}))
    return out
