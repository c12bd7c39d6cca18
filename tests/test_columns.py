import pytest
from hypothesis import given
from hypothesis import strategies as st

from magsim import columns

names = st.from_regex(columns.NAME_PATTERN, fullmatch=True).filter(lambda name: len(name) <= 40)
FIELDS = {
    "sensor": names,
    "feeder": names,
    "bus": names,
    "surface": names,
    "component": st.sampled_from(columns.COMPONENTS),
    "axis": st.sampled_from(columns.AXES),
    "angle": st.sampled_from(columns.INS_ANGLES),
    "direction": st.sampled_from(columns.DIRECTIONS),
    "way": st.sampled_from(columns.ROPE_WAYS),
}


@st.composite
def named(draw):
    family = draw(st.sampled_from(columns.FAMILIES))
    fields = {key: draw(FIELDS[key]) for key in family.regex.groupindex}
    return family, fields


@given(named())
def test_every_name_leads_back_to_its_family(pair):
    family, fields = pair
    name = family.name(**fields)
    assert columns.find(name) is family
    assert family.match(name) == fields
    assert columns.role_of(name) == family.role


@given(st.lists(named(), min_size=2, max_size=2))
def test_two_columns_never_share_a_name(pairs):
    (one, first), (other, second) = pairs
    if one is not other or first != second:
        assert one.name(**first) != other.name(**second)


@pytest.mark.parametrize(
    "name", ["", "mag__nt", "mag_A_nt", "flux_a_w_nt", "ins_yaw_deg", "true_vx_mps", "x", "time_s"]
)
def test_unknown_names(name):
    assert columns.find(name) is None
    with pytest.raises(KeyError, match="no column family"):
        columns.role_of(name)


def test_every_family_is_complete_and_in_order():
    order = [columns.ROLES.index(family.role) for family in columns.FAMILIES]
    assert order == sorted(order)
    assert len({family.pattern for family in columns.FAMILIES}) == len(columns.FAMILIES)
    for family in columns.FAMILIES:
        assert family.meaning
        assert family.unit
    units = {"_nt": "nT", "_deg": "deg", "_mps": "m/s", "_dps": "deg/s", "_m": "m", "_a": "A", "_v": "V", "_c": "degC"}
    units |= {"_mps2": "m/s^2", "_pa": "Pa", "_n": "N"}
    for family in columns.FAMILIES:
        suffix = "_" + family.pattern.rsplit("_", 1)[-1]
        assert family.unit == units.get(suffix, "1")


def test_sensors_in_order_of_appearance():
    table = ["mag_tail_nt", "flux_a_x_nt", "flux_a_y_nt", "mag_cabin_nt", "total_cabin_nt", "time_s"]
    assert columns.sensors_of(table, columns.MAG) == ("tail", "cabin")
    assert columns.sensors_of(table, columns.FLUX) == ("a",)
