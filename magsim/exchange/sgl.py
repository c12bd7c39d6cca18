"""The SGL 2020 layout: its fields, and a recording's columns in its terms.

Names, order, units and meanings: MagNav.jl, ``readmes/sgl_2020_fields_readme.txt``; heads of the text files: its
``test/test_data/Flt1003_sample.xyz``. The 2021 layout has a part of the same fields.
"""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from magsim import columns
from magsim.earth import decimal_years, igrf, utm, utm_zone
from magsim.errors import RequestError
from magsim.frames import rot_nb_from_attitude, rotate
from magsim.recording import Recording


@dataclass(frozen=True)
class Field:
    """One field: its name in HDF5 files, its head in text files, its unit."""

    name: str
    head: str
    unit: str


FIELDS: tuple[Field, ...] = (
    Field("line", "LINE", "1"),
    Field("flight", "FLT", "1"),
    Field("year", "YEAR", "1"),
    Field("doy", "DOY", "1"),
    Field("tt", "TIME", "s"),
    Field("utm_x", "UTM-X", "m"),
    Field("utm_y", "UTM-Y", "m"),
    Field("utm_z", "UTM-Z", "m"),
    Field("msl", "MSL-Z", "m"),
    Field("lat", "LAT", "deg"),
    Field("lon", "LONG", "deg"),
    Field("baro", "BARO", "m"),
    Field("radar", "RADAR", "m"),
    Field("topo", "TOPO", "m"),
    Field("dem", "DEM", "m"),
    Field("drape", "DRAPE", "m"),
    Field("ins_pitch", "PITCH", "deg"),
    Field("ins_roll", "ROLL", "deg"),
    Field("ins_yaw", "AZIMUTH", "deg"),
    Field("diurnal", "DIURNAL", "nT"),
    Field("mag_1_c", "COMPMAG1", "nT"),
    Field("mag_1_lag", "LAGMAG1", "nT"),
    Field("mag_1_dc", "DCMAG1", "nT"),
    Field("mag_1_igrf", "IGRFMAG1", "nT"),
    Field("mag_1_uc", "UNCOMPMAG1", "nT"),
    Field("mag_2_uc", "UNCOMPMAG2", "nT"),
    Field("mag_3_uc", "UNCOMPMAG3", "nT"),
    Field("mag_4_uc", "UNCOMPMAG4", "nT"),
    Field("mag_5_uc", "UNCOMPMAG5", "nT"),
    Field("mag_6_uc", "UNCOMPMAG6", "nT"),
    Field("flux_a_x", "FLUXA_X", "nT"),
    Field("flux_a_y", "FLUXA_Y", "nT"),
    Field("flux_a_z", "FLUXA_Z", "nT"),
    Field("flux_a_t", "FLUXA_TOT", "nT"),
    Field("flux_b_x", "FLUXB_X", "nT"),
    Field("flux_b_y", "FLUXB_Y", "nT"),
    Field("flux_b_z", "FLUXB_Z", "nT"),
    Field("flux_b_t", "FLUXB_TOT", "nT"),
    Field("flux_c_x", "FLUXC_X", "nT"),
    Field("flux_c_y", "FLUXC_Y", "nT"),
    Field("flux_c_z", "FLUXC_Z", "nT"),
    Field("flux_c_t", "FLUXC_TOT", "nT"),
    Field("flux_d_x", "FLUXD_X", "nT"),
    Field("flux_d_y", "FLUXD_Y", "nT"),
    Field("flux_d_z", "FLUXD_Z", "nT"),
    Field("flux_d_t", "FLUXD_TOT", "nT"),
    Field("ogs_mag", "OGS_MAG", "nT"),
    Field("ogs_alt", "OGS_HGT", "m"),
    Field("ins_acc_x", "INS_ACC_X", "m/s^2"),
    Field("ins_acc_y", "INS_ACC_Y", "m/s^2"),
    Field("ins_acc_z", "INS_ACC_Z", "m/s^2"),
    Field("ins_wander", "INS_WANDER", "rad"),
    Field("ins_lat", "INS_LAT", "rad"),
    Field("ins_lon", "INS_LON", "rad"),
    Field("ins_alt", "INS_HGT", "m"),
    Field("ins_vn", "INS_VEL_N", "m/s"),
    Field("ins_vw", "INS_VEL_W", "m/s"),
    Field("ins_vu", "INS_VEL_V", "m/s"),
    Field("pitch_rate", "PITCHRT", "deg/s"),
    Field("roll_rate", "ROLLRT", "deg/s"),
    Field("yaw_rate", "YAWRT", "deg/s"),
    Field("lgtl_acc", "LONG_ACC", "g"),
    Field("ltrl_acc", "LAT_ACC", "g"),
    Field("nrml_acc", "NORM_ACC", "g"),
    Field("tas", "TRUE_AS", "m/s"),
    Field("pitot_p", "PITOT_P", "kPa"),
    Field("static_p", "STATIC_P", "kPa"),
    Field("total_p", "TOT_P", "kPa"),
    Field("cur_com_1", "CUR_COM1", "A"),
    Field("cur_ac_hi", "CUR_ACHi", "A"),
    Field("cur_ac_lo", "CUR_ACLo", "A"),
    Field("cur_tank", "CUR_TANK", "A"),
    Field("cur_flap", "CUR_FLAP", "A"),
    Field("cur_strb", "CUR_STRB", "A"),
    Field("cur_srvo_o", "CUR_SRVO_O", "A"),
    Field("cur_srvo_m", "CUR_SRVO_M", "A"),
    Field("cur_srvo_i", "CUR_SRVO_I", "A"),
    Field("cur_heat", "CUR_IHTR", "A"),
    Field("cur_acpwr", "CUR_ACPWR", "A"),
    Field("cur_outpwr", "CUR_OUTPWR", "A"),
    Field("cur_bat_1", "CUR_BAT1", "A"),
    Field("cur_bat_2", "CUR_BAT2", "A"),
    Field("vol_acpwr", "V_ACPWR", "V"),
    Field("vol_outpwr", "V_OUTPWR", "V"),
    Field("vol_bat_1", "V_BAT1", "V"),
    Field("vol_bat_2", "V_BAT2", "V"),
    Field("vol_res_p", "V_RESp", "V"),
    Field("vol_res_n", "V_RESn", "V"),
    Field("vol_back_p", "V_BACKp", "V"),
    Field("vol_back_n", "V_BACKn", "V"),
    Field("vol_gyro_1", "V_GYRO1", "V"),
    Field("vol_gyro_2", "V_GYRO2", "V"),
    Field("vol_acc_p", "V_ACCp", "V"),
    Field("vol_acc_n", "V_ACCn", "V"),
    Field("vol_block", "V_BLOCK", "V"),
    Field("vol_back", "V_BACK", "V"),
    Field("vol_srvo", "V_SERVO", "V"),
    Field("vol_cabt", "V_CABT", "V"),
    Field("vol_fan", "V_FAN", "V"),
)
"""All fields, in the order of the columns of SGL's text files."""

BY_NAME = {field.name: field for field in FIELDS}

MAGNETOMETERS = tuple(str(number) for number in range(1, 7))
FLUXGATES = ("a", "b", "c", "d")

UTM_LIMIT_DEG = 84.0
"""Latitude up to which the projection is used."""

DIRECT = {
    "ins_pitch": "ins_pitch_deg",
    "ins_roll": "ins_roll_deg",
    "ins_yaw": "ins_heading_deg",
    "ins_alt": "ins_alt_m",
    "ins_vn": "ins_vn_mps",
    "baro": "baro_alt_m",
    "pitch_rate": "ins_rate_y_dps",
    "roll_rate": "ins_rate_x_dps",
    "yaw_rate": "ins_rate_z_dps",
} | {theirs: ours for ours, theirs in columns.ALIASES_SGL.items()}
"""Fields that are a column as it is."""

NEGATED = {"ins_vw": "ins_ve_mps", "ins_vu": "ins_vd_mps"}
"""West and up there, east and down here."""

RADIANS = {"ins_lat": "ins_lat_deg", "ins_lon": "ins_lon_deg"}
"""Radians there, degrees here."""

SCALED = {"static_p": ("baro_pa", 1e-3)}
"""Our column and what it is multiplied by: kilopascals there, pascals here."""


def magnetometers(recording: Recording) -> dict[str, str]:
    """Number of each scalar magnetometer that has a place in the layout; ``m3`` keeps its number."""
    return _places(recording.scalars, {f"m{number}": number for number in MAGNETOMETERS})


def fluxgates(recording: Recording) -> dict[str, str]:
    """Letter of each fluxgate that has a place in the layout; ``a`` to ``d`` keep theirs."""
    return _places(recording.fluxgates, {letter: letter for letter in FLUXGATES})


def _places(sensors: tuple[str, ...], kept: dict[str, str]) -> dict[str, str]:
    own = {sensor: kept[sensor] for sensor in sensors if sensor in kept}
    free = [place for place in kept.values() if place not in own.values()]
    others = [sensor for sensor in sensors if sensor not in own]
    found = own | dict(zip(others, free, strict=False))
    return {sensor: found[sensor] for sensor in sensors if sensor in found}


def start_of(recording: Recording) -> datetime:
    """Instant of time 0.

    Raises
    ------
    RequestError
        If the recording does not tell.
    """
    start = recording.meta.get("start_utc")
    if not isinstance(start, str):
        msg = f"recording {recording.name!r} has no start_utc, which this format needs for its dates"
        raise RequestError(msg)
    found = datetime.fromisoformat(start)
    return found.replace(tzinfo=UTC) if found.tzinfo is None else found.astimezone(UTC)


def path_of(recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Latitude, longitude [deg] and height above the ellipsoid [m] as a survey would publish them.

    That is what positioning after the flight brings: the true path where the recording has it, else that of the INS.

    Raises
    ------
    RequestError
        If the recording has neither.
    """
    for names in (("true_lat_deg", "true_lon_deg", "true_alt_m"), ("ins_lat_deg", "ins_lon_deg", "ins_alt_m")):
        if all(name in recording for name in names):
            lat, lon, alt = (recording[name] for name in names)
            return lat, lon, alt
    msg = f"recording {recording.name!r} has no position (ins_lat_deg, ins_lon_deg, ins_alt_m), which this format needs"
    raise RequestError(msg)


def lines_of(recording: Recording, flight: int) -> np.ndarray:
    """Line numbers as SGL writes them, (n,): flight and circuit, ``1.02``; the circuit alone beyond 99."""
    circuit = recording[columns.CIRCUIT.pattern] if columns.CIRCUIT.pattern in recording else np.ones(len(recording))
    if np.max(circuit) > 99:
        return np.asarray(circuit, dtype=float)
    return np.round(flight + circuit / 100.0, 2)


def fields_of(recording: Recording, flight: int) -> dict[str, np.ndarray]:
    """Columns of a recording as fields of the layout, in its order.

    Parameters
    ----------
    recording : Recording
        With ``start_utc`` and a position.
    flight : int
        Number of the flight.

    Returns
    -------
    dict of str to (n,)
        NaN where a value is missing. Fields that the recording knows nothing about are absent.

    Raises
    ------
    RequestError
        If the date or the position is not there, or beyond what the layout can tell.

    Notes
    -----
    ``mag_1_c`` is the reading minus the noise-free interference, what a perfect compensation would leave, and absent
    without labels. ``mag_1_lag`` equals it, or the reading where it is absent; ``mag_1_dc = mag_1_lag - diurnal``; and
    ``mag_1_igrf = mag_1_dc`` minus the IGRF at ``lat, lon, utm_z``. ``diurnal`` is the base station's reading minus its
    mean, 0 without a station.
    """
    found = _time_and_place(recording, flight)
    for name, ours in DIRECT.items():
        if ours in recording:
            found[name] = recording[ours]
    for name, ours in NEGATED.items():
        if ours in recording:
            found[name] = -recording[ours]
    for name, ours in RADIANS.items():
        if ours in recording:
            found[name] = np.radians(recording[ours])
    for name, (ours, factor) in SCALED.items():
        if ours in recording:
            found[name] = factor * recording[ours]
    found |= _level_accelerations(recording)
    if columns.RADAR.pattern in recording:
        radar = recording[columns.RADAR.pattern]
        found["radar"] = np.where(radar < 0.0, np.nan, radar)
    if columns.TRUE_MSL.pattern in recording:
        found["msl"] = recording[columns.TRUE_MSL.pattern]
    for sensor, letter in fluxgates(recording).items():
        vector = recording.vector(columns.FLUX, sensor=sensor)
        found |= {f"flux_{letter}_{axis}": vector[:, i] for i, axis in enumerate(columns.AXES)}
        found[f"flux_{letter}_t"] = np.sqrt(np.einsum("ni,ni->n", vector, vector))
    found |= _magnetic(recording, found)
    return {field.name: found[field.name] for field in FIELDS if field.name in found}


def _time_and_place(recording: Recording, flight: int) -> dict[str, np.ndarray]:
    start = start_of(recording)
    midnight = start.replace(hour=0, minute=0, second=0, microsecond=0)
    lat, lon, alt = path_of(recording)
    if np.max(np.abs(lat)) > UTM_LIMIT_DEG:
        msg = (
            f"recording {recording.name!r} goes up to latitude {lat[np.argmax(np.abs(lat))]:.4g}; this format is "
            f"projected, allowed: up to {UTM_LIMIT_DEG:g}"
        )
        raise RequestError(msg)
    zone = utm_zone(lat[0], lon[0])
    easting, northing = utm(np.radians(lat), np.radians(lon), zone=zone, south=bool(lat[0] < 0.0))
    rows = np.ones(len(recording))
    # past midnight the time goes on beyond 86400 and the day stays, so that time never runs back
    return {
        "line": lines_of(recording, flight),
        "flight": flight * rows,
        "year": start.year * rows,
        "doy": start.timetuple().tm_yday * rows,
        "tt": (start - midnight) / timedelta(seconds=1) + recording.time_s,
        "utm_x": easting,
        "utm_y": northing,
        "utm_z": alt,
        "lat": lat,
        "lon": lon,
    }


def _level_accelerations(recording: Recording) -> dict[str, np.ndarray]:
    """Accelerometers of a level platform whose x axis looks north: ours turned by the attitude that the INS tells.

    SGL's INS is gimballed: x is horizontal, ``ins_wander`` counterclockwise from north, y a quarter turn further, z up,
    gravity included (MagNav.jl, ``readmes/INS_readme.txt``).
    """
    angles = [columns.INS_ATTITUDE.name(angle=angle) for angle in ("roll", "pitch", "heading")]
    names = [columns.INS_ACCELERATION.name(axis=axis) for axis in columns.AXES]
    if not all(name in recording for name in (*angles, *names)):
        return {}
    felt_n = rotate(rot_nb_from_attitude(np.radians(recording.stack(angles))), recording.stack(names))
    north, east, down = felt_n.T
    return {"ins_acc_x": north, "ins_acc_y": -east, "ins_acc_z": -down, "ins_wander": np.zeros(len(recording))}


def _magnetic(recording: Recording, found: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Readings, and Mag 1 through the stages of SGL's processing."""
    bases = columns.sensors_of(recording.data, columns.BASE)
    diurnal = np.zeros(len(recording))
    if bases:
        base = recording[columns.BASE.name(sensor=bases[0])]
        diurnal = base - np.mean(base)
    out = {"diurnal": diurnal}
    for sensor, number in magnetometers(recording).items():
        reading = recording[columns.MAG.name(sensor=sensor)]
        out[f"mag_{number}_uc"] = reading
        if number != "1":
            continue
        label = columns.INTERFERENCE.name(sensor=sensor)
        if label in recording:
            out["mag_1_c"] = reading - recording[label]
        out["mag_1_lag"] = out.get("mag_1_c", reading)
        out["mag_1_dc"] = out["mag_1_lag"] - diurnal
        out["mag_1_igrf"] = out["mag_1_dc"] - _main_field(recording, found)
    return out


def _main_field(recording: Recording, found: dict[str, np.ndarray]) -> np.ndarray:
    year = decimal_years(start_of(recording), recording.time_s)
    try:
        field_n = igrf(np.radians(found["lat"]), np.radians(found["lon"]), found["utm_z"], year)
    except ValueError as error:
        msg = f"recording {recording.name!r}: {error}"
        raise RequestError(msg) from None
    return np.sqrt(np.einsum("ni,ni->n", field_n, field_n))
