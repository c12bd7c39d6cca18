"""The SGL 2020 layout: its fields, and the columns of a recording as these fields.

Names, order, units and meanings: MagNav.jl, ``readmes/sgl_2020_fields_readme.txt``; heads of the text files: its
``test/test_data/Flt1003_sample.xyz``. The 2021 layout has a part of the same fields.
"""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from magsim import columns
from magsim.earth import decimal_years, igrf, utm, utm_zone
from magsim.errors import RequestError
from magsim.exchange.aliases import ALIASES_SGL
from magsim.frames import rot_nb_from_attitude, rotate
from magsim.recording import Recording


@dataclass(frozen=True)
class SglField:
    """One field: its name in HDF5 files, its head in text files, its unit."""

    name: str
    head: str
    unit: str


FIELDS: tuple[SglField, ...] = (
    SglField("line", "LINE", "1"),
    SglField("flight", "FLT", "1"),
    SglField("year", "YEAR", "1"),
    SglField("doy", "DOY", "1"),
    SglField("tt", "TIME", "s"),
    SglField("utm_x", "UTM-X", "m"),
    SglField("utm_y", "UTM-Y", "m"),
    SglField("utm_z", "UTM-Z", "m"),
    SglField("msl", "MSL-Z", "m"),
    SglField("lat", "LAT", "deg"),
    SglField("lon", "LONG", "deg"),
    SglField("baro", "BARO", "m"),
    SglField("radar", "RADAR", "m"),
    SglField("topo", "TOPO", "m"),
    SglField("dem", "DEM", "m"),
    SglField("drape", "DRAPE", "m"),
    SglField("ins_pitch", "PITCH", "deg"),
    SglField("ins_roll", "ROLL", "deg"),
    SglField("ins_yaw", "AZIMUTH", "deg"),
    SglField("diurnal", "DIURNAL", "nT"),
    SglField("mag_1_c", "COMPMAG1", "nT"),
    SglField("mag_1_lag", "LAGMAG1", "nT"),
    SglField("mag_1_dc", "DCMAG1", "nT"),
    SglField("mag_1_igrf", "IGRFMAG1", "nT"),
    SglField("mag_1_uc", "UNCOMPMAG1", "nT"),
    SglField("mag_2_uc", "UNCOMPMAG2", "nT"),
    SglField("mag_3_uc", "UNCOMPMAG3", "nT"),
    SglField("mag_4_uc", "UNCOMPMAG4", "nT"),
    SglField("mag_5_uc", "UNCOMPMAG5", "nT"),
    SglField("mag_6_uc", "UNCOMPMAG6", "nT"),
    SglField("flux_a_x", "FLUXA_X", "nT"),
    SglField("flux_a_y", "FLUXA_Y", "nT"),
    SglField("flux_a_z", "FLUXA_Z", "nT"),
    SglField("flux_a_t", "FLUXA_TOT", "nT"),
    SglField("flux_b_x", "FLUXB_X", "nT"),
    SglField("flux_b_y", "FLUXB_Y", "nT"),
    SglField("flux_b_z", "FLUXB_Z", "nT"),
    SglField("flux_b_t", "FLUXB_TOT", "nT"),
    SglField("flux_c_x", "FLUXC_X", "nT"),
    SglField("flux_c_y", "FLUXC_Y", "nT"),
    SglField("flux_c_z", "FLUXC_Z", "nT"),
    SglField("flux_c_t", "FLUXC_TOT", "nT"),
    SglField("flux_d_x", "FLUXD_X", "nT"),
    SglField("flux_d_y", "FLUXD_Y", "nT"),
    SglField("flux_d_z", "FLUXD_Z", "nT"),
    SglField("flux_d_t", "FLUXD_TOT", "nT"),
    SglField("ogs_mag", "OGS_MAG", "nT"),
    SglField("ogs_alt", "OGS_HGT", "m"),
    SglField("ins_acc_x", "INS_ACC_X", "m/s^2"),
    SglField("ins_acc_y", "INS_ACC_Y", "m/s^2"),
    SglField("ins_acc_z", "INS_ACC_Z", "m/s^2"),
    SglField("ins_wander", "INS_WANDER", "rad"),
    SglField("ins_lat", "INS_LAT", "rad"),
    SglField("ins_lon", "INS_LON", "rad"),
    SglField("ins_alt", "INS_HGT", "m"),
    SglField("ins_vn", "INS_VEL_N", "m/s"),
    SglField("ins_vw", "INS_VEL_W", "m/s"),
    SglField("ins_vu", "INS_VEL_V", "m/s"),
    SglField("pitch_rate", "PITCHRT", "deg/s"),
    SglField("roll_rate", "ROLLRT", "deg/s"),
    SglField("yaw_rate", "YAWRT", "deg/s"),
    SglField("lgtl_acc", "LONG_ACC", "g"),
    SglField("ltrl_acc", "LAT_ACC", "g"),
    SglField("nrml_acc", "NORM_ACC", "g"),
    SglField("tas", "TRUE_AS", "m/s"),
    SglField("pitot_p", "PITOT_P", "kPa"),
    SglField("static_p", "STATIC_P", "kPa"),
    SglField("total_p", "TOT_P", "kPa"),
    SglField("cur_com_1", "CUR_COM1", "A"),
    SglField("cur_ac_hi", "CUR_ACHi", "A"),
    SglField("cur_ac_lo", "CUR_ACLo", "A"),
    SglField("cur_tank", "CUR_TANK", "A"),
    SglField("cur_flap", "CUR_FLAP", "A"),
    SglField("cur_strb", "CUR_STRB", "A"),
    SglField("cur_srvo_o", "CUR_SRVO_O", "A"),
    SglField("cur_srvo_m", "CUR_SRVO_M", "A"),
    SglField("cur_srvo_i", "CUR_SRVO_I", "A"),
    SglField("cur_heat", "CUR_IHTR", "A"),
    SglField("cur_acpwr", "CUR_ACPWR", "A"),
    SglField("cur_outpwr", "CUR_OUTPWR", "A"),
    SglField("cur_bat_1", "CUR_BAT1", "A"),
    SglField("cur_bat_2", "CUR_BAT2", "A"),
    SglField("vol_acpwr", "V_ACPWR", "V"),
    SglField("vol_outpwr", "V_OUTPWR", "V"),
    SglField("vol_bat_1", "V_BAT1", "V"),
    SglField("vol_bat_2", "V_BAT2", "V"),
    SglField("vol_res_p", "V_RESp", "V"),
    SglField("vol_res_n", "V_RESn", "V"),
    SglField("vol_back_p", "V_BACKp", "V"),
    SglField("vol_back_n", "V_BACKn", "V"),
    SglField("vol_gyro_1", "V_GYRO1", "V"),
    SglField("vol_gyro_2", "V_GYRO2", "V"),
    SglField("vol_acc_p", "V_ACCp", "V"),
    SglField("vol_acc_n", "V_ACCn", "V"),
    SglField("vol_block", "V_BLOCK", "V"),
    SglField("vol_back", "V_BACK", "V"),
    SglField("vol_srvo", "V_SERVO", "V"),
    SglField("vol_cabt", "V_CABT", "V"),
    SglField("vol_fan", "V_FAN", "V"),
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
} | {theirs: ours for ours, theirs in ALIASES_SGL.items()}
"""Fields that equal a column."""

NEGATED = {"ins_vw": "ins_ve_mps", "ins_vu": "ins_vd_mps"}
"""West and up in the layout, east and down in a recording."""

RADIANS = {"ins_lat": "ins_lat_deg", "ins_lon": "ins_lon_deg"}
"""Radians in the layout, degrees in a recording."""

SCALED = {"static_p": ("baro_pa", 1e-3)}
"""Column of a recording and its factor: kilopascals in the layout, pascals in a recording."""


def magnetometers(recording: Recording) -> dict[str, str]:
    """Return the number of each scalar magnetometer in the layout, as far as there are; ``m3`` keeps its number."""
    return _places(recording.scalars, {f"m{number}": number for number in MAGNETOMETERS})


def fluxgates(recording: Recording) -> dict[str, str]:
    """Return the letter of each fluxgate in the layout, as far as there are; ``a`` to ``d`` keep theirs."""
    return _places(recording.fluxgates, {letter: letter for letter in FLUXGATES})


def _places(sensors: tuple[str, ...], kept: dict[str, str]) -> dict[str, str]:
    own = {sensor: kept[sensor] for sensor in sensors if sensor in kept}
    free = [place for place in kept.values() if place not in own.values()]
    others = [sensor for sensor in sensors if sensor not in own]
    found = own | dict(zip(others, free, strict=False))
    return {sensor: found[sensor] for sensor in sensors if sensor in found}


def start_of(recording: Recording) -> datetime:
    """Return the instant of time 0.

    Raises
    ------
    RequestError
        If the recording does not state it.
    """
    start = recording.meta.get("start_utc")
    if not isinstance(start, str):
        msg = f"recording {recording.name!r} has no start_utc, which this format needs for its dates"
        raise RequestError(msg)
    found = datetime.fromisoformat(start)
    return found.replace(tzinfo=UTC) if found.tzinfo is None else found.astimezone(UTC)


def path_of(recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return latitude, longitude [deg] and height above the ellipsoid [m] as a survey would publish them.

    Surveys publish positions that are processed after the flight: the true path if the recording has it, else that of
    the INS.

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
    """Return line numbers as SGL writes them, (n,): flight and circuit, ``1.02``; the circuit alone beyond 99."""
    circuit = recording[columns.CIRCUIT.pattern] if columns.CIRCUIT.pattern in recording else np.ones(len(recording))
    if np.max(circuit) > 99:
        return np.asarray(circuit, dtype=float)
    return np.round(flight + circuit / 100.0, 2)


def fields_of(recording: Recording, flight: int) -> dict[str, np.ndarray]:
    """Return the columns of a recording as fields of the layout, in its order.

    Parameters
    ----------
    recording : Recording
        With ``start_utc`` and a position.
    flight : int
        Number of the flight.

    Returns
    -------
    dict of str to (n,)
        Missing values are NaN. Fields without a corresponding column are absent.

    Raises
    ------
    RequestError
        If date or position is missing, or beyond the range of the layout.

    Notes
    -----
    ``mag_1_c`` is the reading minus the noise-free interference, as after a perfect compensation, and absent
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
    # past midnight the time exceeds 86400 and the day stays the same, so that time always increases
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
    """Return the accelerations of a level platform with its x axis north: ours, rotated by the attitude of the INS.

    SGL's INS is gimballed: x is horizontal, ``ins_wander`` counterclockwise from north, y a quarter turn further, z up,
    gravity included (MagNav.jl, ``readmes/INS_readme.txt``).
    """
    angles = [columns.INS_ATTITUDE.name(angle=angle) for angle in ("roll", "pitch", "heading")]
    names = [columns.INS_ACCELERATION.name(axis=axis) for axis in columns.AXES]
    if not all(name in recording for name in (*angles, *names)):
        return {}
    force_n = rotate(rot_nb_from_attitude(np.radians(recording.stack(angles))), recording.stack(names))
    north, east, down = force_n.T
    return {"ins_acc_x": north, "ins_acc_y": -east, "ins_acc_z": -down, "ins_wander": np.zeros(len(recording))}


def _magnetic(recording: Recording, found: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the readings, and Mag 1 after each stage of SGL's processing."""
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
