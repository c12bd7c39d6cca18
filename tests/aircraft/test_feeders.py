"""What the wiring of a magnetic file may contain, and the errors of what it may not."""

import copy
import math
import tomllib

import pytest
from pydantic import ValidationError

from magsim import assets, columns
from magsim.aircraft import KinematicFacts, Magnetics, load_aircraft
from magsim.exchange.aliases import alias_sgl
from tests.benchmarks.aircraft_levels import vehicle


@pytest.fixture
def settings() -> dict:
    path = assets.aircraft_dir("c208b") / "magnetics.toml"
    return copy.deepcopy(tomllib.loads(path.read_text(encoding="utf-8")))


def feeder(settings: dict, name: str) -> dict:
    return next(item for item in settings["feeders"] if item["name"] == name)


def refused(settings: dict, text: str) -> None:
    with pytest.raises(ValidationError, match=text):
        Magnetics.model_validate(settings)


@pytest.mark.parametrize("name", [*assets.list_aircraft(), *assets.list_birds()])
def test_every_feeder_and_bus_says_where_it_comes_from(name):
    magnetics = vehicle(name).magnetics
    assert magnetics.feeders
    assert magnetics.buses
    assert all(len(item.source) >= 10 for item in (*magnetics.feeders, *magnetics.buses))


def _is_kinematic(name: str) -> bool:
    return isinstance(load_aircraft(name).facts, KinematicFacts)


@pytest.mark.parametrize("name", [*filter(_is_kinematic, assets.list_aircraft()), *assets.list_birds()])
def test_what_has_no_controls_has_nothing_that_follows_them(name):
    magnetics = vehicle(name).magnetics
    assert {feeder.load.kind for feeder in magnetics.feeders} <= {"constant", "pulse", "duty", "charge", "sum"}
    assert not magnetics.hinged


@pytest.mark.parametrize("bird", assets.list_birds())
@pytest.mark.parametrize("carrier", assets.list_aircraft())
def test_channels_of_a_bird_and_of_its_carrier_have_names_of_their_own(bird, carrier):
    """Both stand in one recording."""
    channels = [
        {item.name for item in (*magnetics.feeders, *magnetics.buses)}
        for magnetics in (vehicle(bird).magnetics, vehicle(carrier).magnetics)
    ]
    assert channels[0].isdisjoint(channels[1])


def test_channels_that_sgl_recorded_carry_its_names():
    magnetics = load_aircraft("c208b").magnetics
    names = [alias_sgl(columns.CURRENT.name(feeder=feeder.name)) for feeder in magnetics.feeders]
    assert {"cur_com_1", "cur_tank", "cur_flap", "cur_strb", "cur_heat", "cur_acpwr", "cur_bat_1"} <= set(names)
    voltages = [alias_sgl(columns.VOLTAGE.name(bus=bus.name)) for bus in magnetics.buses]
    assert {"vol_acpwr", "vol_bat_1"} <= set(voltages)


def test_a_mount_in_a_wire_is_refused_by_name(settings):
    wire = feeder(settings, "fuel_pump")["paths"][0]["vertices_m"]
    middle = [0.5 * (a + b) for a, b in zip(wire[1], wire[2], strict=True)]
    settings["mounts"]["floor"] = {"position_m": [middle[0], middle[1], middle[2] - 0.002], "source": "a test"}
    text = r"mount 'floor' is 0.002 m from the wire of feeder 'fuel_pump', paths\[0\]; allowed: beyond its radius"
    refused(settings, text)
    settings["mounts"]["floor"]["position_m"][2] -= 0.002
    Magnetics.model_validate(settings)


def test_the_mirror_image_and_the_return_are_wires_too(settings):
    settings["mounts"]["tip"] = {"position_m": [-0.2, 7.7, -0.97], "source": "a test"}
    refused(settings, "mount 'tip' is 0 m from the wire of feeder 'strobe'")
    wire = feeder(settings, "fuel_pump")["paths"][0]
    back = [a + b for a, b in zip(wire["vertices_m"][2], wire["offset_m"], strict=True)]
    settings["mounts"]["tip"]["position_m"] = back
    refused(settings, "mount 'tip' is 0 m from the wire of feeder 'fuel_pump'")


def test_distance_to_a_loop_counts_its_closing_piece(settings):
    loop = Magnetics.model_validate(settings).feeders[2].paths[0]
    first, last = loop.vertices_m[0], loop.vertices_m[-1]
    middle = tuple(0.5 * (a + b) for a, b in zip(first, last, strict=True))
    assert loop.clearance_m(middle) == pytest.approx(0.0, abs=1e-15)
    assert loop.clearance_m((0.0, 50.0, 0.0)) == pytest.approx(
        math.dist((0.0, 50.0, 0.0), (-0.175, 7.7, -0.97)), rel=1e-4
    )


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (
            {"kind": "pulse", "current_a": 8.0, "period_s": 1.0, "width_s": 1.2},
            "width_s = 1.2 is not below period_s = 1",
        ),
        (
            {"kind": "pulses", "current_a": 8.0},
            "'constant', 'pulse', 'duty', 'switch', 'servo', 'motor', 'charge', 'sum'",
        ),
        ({"kind": "constant", "current_a": 8.0, "period_s": 1.0}, "period_s"),
        ({"kind": "switch", "switch": "gear", "current_a": 8.0}, "flap_motor"),
        ({"kind": "servo", "surface": "canard", "idle_a": 1.0}, "elevator"),
        (
            {
                "kind": "duty",
                "current_a": 1.0,
                "on_s": 1.0,
                "off_s": 1.0,
                "rise_s": 0.3,
                "inrush": 2.0,
                "inrush_s": 0.2,
            },
            "inrush_s = 0.2 is not above rise_s = 0.3",
        ),
        (
            {"kind": "sum", "of": ["flap"]},
            "feeder 'strobe': load.of: 'flap' is not there; allowed: feeders above it: avi",
        ),
        ({"kind": "sum", "of": ["avionics", "avionics"]}, "'avionics' stands twice"),
    ],
)
def test_wrong_loads(settings, change, text):
    feeder(settings, "strobe")["load"] = change
    refused(settings, text)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"kind": "loop", "vertices_m": [[0, 0, 0], [1, 0, 0]]}, "at least 3 items"),
        ({"kind": "pair", "vertices_m": [[0, 0, 0], [1, 0, 0]], "offset_m": [0, 0, 0]}, "at least 0.1 mm"),
        (
            {"kind": "pair", "vertices_m": [[5, 0, 0], [5, 0, 0]], "offset_m": [0, 0, 1]},
            r"vertices_m\[0\] and the next",
        ),
        (
            {"kind": "twisted", "vertices_m": [[5, 0, 0], [9, 0, 0]], "spacing_m": 0.1, "pitch_m": 0.05},
            "wider than a turn",
        ),
        ({"kind": "twisted", "vertices_m": [[5, 0, 0], [9, 0, 0]], "spacing_m": 1e-4, "pitch_m": 1e-3}, "4000 turns"),
    ],
)
def test_wrong_paths(settings, change, text):
    feeder(settings, "strobe")["paths"] = [change]
    refused(settings, text)


def test_wrong_buses(settings):
    settings["buses"][1]["fed_by"] = "panel"
    refused(settings, "bus 'battery': fed_by: 'panel' is not there; allowed: buses above it: main")
    settings["buses"][1]["fed_by"] = "main"
    settings["buses"][1]["open_circuit_v"] = 24.0
    refused(settings, "either open_circuit_v or fed_by")
    del settings["buses"][1]["open_circuit_v"]
    settings["buses"][1]["feeders"] = ["starter"]
    refused(settings, "bus 'battery': feeders: 'starter' is not there; allowed: feeders: avionics, com_1")


def test_names_differ(settings):
    settings["feeders"][0]["name"] = "strobe"
    refused(settings, "names of feeders must differ, used twice: strobe")
