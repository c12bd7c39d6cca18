"""Names of columns in the SGL 2020 layout: those of single columns, beside the patterns of families."""

from collections.abc import Mapping

from magsim import columns

ALIASES_SGL: Mapping[str, str] = {
    "cur_com_1_a": "cur_com_1",
    "cur_fan_high_a": "cur_ac_hi",
    "cur_fan_low_a": "cur_ac_lo",
    "cur_fuel_pump_a": "cur_tank",
    "cur_flap_a": "cur_flap",
    "cur_strobe_a": "cur_strb",
    "cur_ins_servo_outer_a": "cur_srvo_o",
    "cur_ins_servo_middle_a": "cur_srvo_m",
    "cur_ins_servo_inner_a": "cur_srvo_i",
    "cur_ins_heater_a": "cur_heat",
    "cur_survey_supply_a": "cur_acpwr",
    "cur_survey_output_a": "cur_outpwr",
    "cur_battery_a": "cur_bat_1",
    "cur_battery_2_a": "cur_bat_2",
    "vol_survey_supply_v": "vol_acpwr",
    "vol_survey_output_v": "vol_outpwr",
    "vol_battery_v": "vol_bat_1",
    "vol_battery_2_v": "vol_bat_2",
    "vol_resolver_plus_v": "vol_res_p",
    "vol_resolver_minus_v": "vol_res_n",
    "vol_backplane_plus_v": "vol_back_p",
    "vol_backplane_minus_v": "vol_back_n",
    "vol_gyro_1_v": "vol_gyro_1",
    "vol_gyro_2_v": "vol_gyro_2",
    "vol_accelerometer_plus_v": "vol_acc_p",
    "vol_accelerometer_minus_v": "vol_acc_n",
    "vol_block_v": "vol_block",
    "vol_backplane_v": "vol_back",
    "vol_servo_v": "vol_srvo",
    "vol_cabinet_v": "vol_cabt",
    "vol_fan_v": "vol_fan",
}
"""Electrical channels of the SGL 2020 layout (MagNav.jl, readme of the 2020 data): our column, their name.

An aircraft with such a feeder or bus uses the name that is given here.
"""


def alias_sgl(name: str) -> str:
    """Return the name of a column in the SGL 2020 layout; ``""`` if it has none."""
    if name in ALIASES_SGL:
        return ALIASES_SGL[name]
    family = columns.find(name)
    return "" if family is None else family.alias_sgl.format(**(family.match(name) or {}))
