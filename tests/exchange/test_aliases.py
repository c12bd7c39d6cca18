"""Names of the SGL 2020 layout."""

from magsim import columns
from magsim.exchange.aliases import ALIASES_SGL, alias_sgl

SGL_ELECTRICAL = [
    "cur_com_1",
    "cur_ac_hi",
    "cur_ac_lo",
    "cur_tank",
    "cur_flap",
    "cur_strb",
    "cur_srvo_o",
    "cur_srvo_m",
    "cur_srvo_i",
    "cur_heat",
    "cur_acpwr",
    "cur_outpwr",
    "cur_bat_1",
    "cur_bat_2",
    "vol_acpwr",
    "vol_outpwr",
    "vol_bat_1",
    "vol_bat_2",
    "vol_res_p",
    "vol_res_n",
    "vol_back_p",
    "vol_back_n",
    "vol_gyro_1",
    "vol_gyro_2",
    "vol_acc_p",
    "vol_acc_n",
    "vol_block",
    "vol_back",
    "vol_srvo",
    "vol_cabt",
    "vol_fan",
]
"""Fields 69 to 99 of the SGL 2020 layout: 14 currents and 17 voltages (MagNav.jl, readme of the data)."""


def test_every_electrical_channel_of_sgl_has_one_column_of_ours():
    assert list(ALIASES_SGL.values()) == SGL_ELECTRICAL
    for name in ALIASES_SGL:
        assert columns.find(name) in (columns.CURRENT, columns.VOLTAGE)


def test_names_of_sgl():
    assert alias_sgl("cur_fuel_pump_a") == "cur_tank"
    assert alias_sgl("mag_cabin_nt") == "mag_cabin_uc"
    assert alias_sgl("flux_a_x_nt") == "flux_a_x"
    assert alias_sgl("cur_propulsion_a") == alias_sgl("true_alt_m") == alias_sgl("?") == ""
