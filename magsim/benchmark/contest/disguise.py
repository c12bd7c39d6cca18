"""Flights that cannot be told by their names, their dates, or their order."""

from datetime import datetime, timedelta

import numpy as np

from magsim.recording import Recording

DAY_TENTHS = 864_000
"""Tenths of a second in a day."""

DAYS = 10
"""Most days by which a date is shifted: the main field changes by less than 3 nT in them (estimate)."""


def disguised(recording: Recording, rng: np.random.Generator) -> Recording:
    """Return a recording under a drawn name, its clock shifted by up to a day and its date by whole days.

    Of its provenance the rate and the date are left. The clock is shifted by whole tenths of a second, and the start by
    as much the other way: the hour of each row stays.
    """
    offset_s = float(rng.integers(0, DAY_TENTHS)) / 10.0
    days = int(rng.integers(-DAYS, DAYS + 1))
    name = f"flight_{rng.integers(10**9):09d}"
    meta = {key: recording.meta[key] for key in ("rate_hz",) if key in recording.meta}
    if "start_utc" in recording.meta:
        start = datetime.fromisoformat(str(recording.meta["start_utc"])) + timedelta(days=days, seconds=-offset_s)
        meta["start_utc"] = start.isoformat()
    # the sum differs from the shifted time in its last bits, which microseconds do not
    return Recording(name, np.round(recording.time_s + offset_s, 6), dict(recording.data), meta)
