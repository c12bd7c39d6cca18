"""The peer as a method that magsim can judge."""

from datetime import datetime
from typing import Any

import numpy as np

from magsim import columns
from magsim.compensation import Compensator, FitContext
from magsim.dataset import Training
from magsim.earth import decimal_years, igrf
from magsim.recording import Recording
from tests.benchmarks.physics_rows import peer

_CHANNELS = (columns.CURRENT.pattern, columns.SURFACE.pattern)


class PeerMethod(Compensator):
    """``peer`` on recordings, fitted to the label."""

    name = "peer"
    lookahead_rows = None
    requires: tuple[str, ...] = (columns.FLUX.pattern, columns.INS_ATTITUDE.pattern, columns.INS_ALTITUDE.pattern)
    peer_: Any

    def learn(self, training: Training, context: FitContext) -> None:
        """Fit both stages."""
        label = columns.INTERFERENCE.name(sensor=training.sensor)
        has = {columns.family_of(name).pattern for name in training.recordings[0].data}
        self.requires = (*type(self).requires, *(pattern for pattern in _CHANNELS if pattern in has))
        pieces = [piece for recording in training.recordings for piece in recording.pieces()]
        self.peer_ = peer.fit([flight_of(piece, piece[label]) for piece in pieces])

    def estimate(self, recording: Recording) -> np.ndarray:
        """Estimate piece by piece."""
        return np.concatenate([self.peer_.interference(flight_of(piece)) for piece in recording.pieces()])


def flight_of(recording: Recording, target: np.ndarray | None = None) -> peer.Flight:
    """Return the arrays that the peer reads of a recording without a gap."""
    year = decimal_years(datetime.fromisoformat(str(recording.meta["start_utc"])), recording.time_s)
    place = np.radians(recording.stack(["ins_lat_deg", "ins_lon_deg"]))
    return peer.Flight(
        recording.time_s,
        recording.vector(columns.FLUX, sensor=recording.fluxgates[0]),
        igrf(place[:, 0], place[:, 1], recording["ins_alt_m"], year),
        np.radians(recording.stack(["ins_roll_deg", "ins_pitch_deg", "ins_heading_deg"])),
        _table(recording, columns.CURRENT),
        np.radians(_table(recording, columns.SURFACE)),
        target,
    )


def _table(recording: Recording, family: columns.Family) -> np.ndarray:
    names = sorted(name for name in recording.data if columns.family_of(name) is family)
    return recording.stack(names) if names else np.empty((len(recording), 0))
