"""How far the aircraft of a type, and the days of an aircraft, differ: every size with its source.

``docs/population.md`` prints this table. Sizes without a published source are estimates of ours.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Spread:
    """Scatter of one quantity.

    Attributes
    ----------
    of : str
        What scatters.
    law : str
        Distribution, in words.
    size : tuple of float
        Its numbers, in the order of ``law``.
    unit : str
    source : str
    """

    of: str
    law: str
    size: tuple[float, ...]
    unit: str
    source: str

    @property
    def row(self) -> str:
        """The spread as a row of a Markdown table."""
        sizes = ", ".join(f"{size:g}" for size in self.size)
        return f"| {self.of} | {self.law} | {sizes} | {self.unit} | {self.source} |"


INDIVIDUAL: Mapping[str, Spread] = {
    "fitting": Spread(
        "moment of a small fitting",
        "lognormal in size (sigma of the logarithm), in any direction",
        (0.5,),
        "1",
        "estimate: remanence of small steel parts is that of their history",
    ),
    "machine": Spread(
        "moment of engine or motor",
        "normal in size, and turned about any axis across it by a normal angle",
        (0.1, 10.0),
        "1, deg",
        "estimate: series of one design, mounted by hand",
    ),
    "susceptibility": Spread(
        "`mu_r - 1` of a steel part",
        "lognormal (sigma of the logarithm)",
        (0.3,),
        "1",
        "estimate: heats of one steel differ in weak fields as 100 to 300 do",
    ),
    "thickness": Spread(
        "thickness of steel sheets and of the skin",
        "normal",
        (0.05,),
        "1",
        "estimate: rolling tolerance of sheets of about 1 mm",
    ),
    "wire": Spread(
        "place of a wire",
        "even along each axis, either way",
        (0.02,),
        "m",
        "estimate: bundles between clamps",
    ),
    "pitch": Spread(
        "turn of a twisted pair",
        "lognormal in length (sigma of the logarithm); two wires side by side lie any way around",
        (0.1,),
        "1",
        "estimate: twisted by hand or by machine",
    ),
    "chassis": Spread(
        "share of return current through chassis or skin: field of a `loop` path",
        "even about 1, either way",
        (0.3,),
        "1",
        "estimate: bonds of different resistance",
    ),
    "mount": Spread(
        "place of a mount",
        "even along each axis, either way",
        (0.005,),
        "m",
        "estimate: brackets drilled by hand",
    ),
    "seat": Spread(
        "seat (`notch_m` of a part)",
        "whole notches, either way, all alike",
        (3.0,),
        "notches",
        "estimate: rail with a notch every 25 mm, crews of different height",
    ),
    "seam": Spread(
        "resistance of a joint of the skin, times its length",
        "lognormal (median, sigma of the logarithm)",
        (5e-6, 0.7),
        "ohm m, 1",
        "estimate: 0.2 milliohm for each rivet, 25 mm between them: as much as 0.09 m of 1 mm sheet",
    ),
    "loop": Spread(
        "joints in a loop that stands for the skin, over its resistance",
        "lognormal (median, sigma of the logarithm)",
        (0.1, 0.7),
        "1",
        "estimate: as the joints of a skin, one each meter",
    ),
    "offset_drift": Spread(
        "fluxgate: offset over temperature, where the scenario gives none",
        "even between two sizes, either sign",
        (0.1, 0.6),
        "nT/K",
        "estimate: range of makers' sheets",
    ),
    "scale_drift": Spread(
        "fluxgate: scale over temperature, where the scenario gives none",
        "even between two sizes, either sign",
        (20.0, 100.0),
        "ppm/K",
        "estimate: range of makers' sheets; about 100 is published for closed-loop fluxgates (Compensation of the "
        "thermal drift in the sensitivity of fundamental-mode orthogonal fluxgates, J. Appl. Phys.)",
    ),
    "refit": Spread(
        "fluxgate refitted: misalignment, each angle",
        "normal",
        (0.3,),
        "deg",
        "estimate: bracket taken off and put back",
    ),
}
"""How individuals differ."""

DAY: Mapping[str, Spread] = {
    "remanence": Spread(
        "moment of a part without `magnet`: step from one day to the next, over its size, in any direction",
        "lognormal (median, 95th percentile)",
        (0.01, 0.05),
        "1",
        "estimate: shocks, heat and fields on the ground",
    ),
    "air": Spread(
        "outside temperature over that of the standard atmosphere at the start's height",
        "normal",
        (8.0,),
        "K",
        "estimate: days of one season at middle latitudes; lapse of 6.5 K/km: published, ICAO Doc 7488",
    ),
    "magnet_lag": Spread(
        "magnets follow the air at the height flown: time constant",
        "fixed",
        (1100.0,),
        "s",
        "estimate: a motor of 1 kg and 450 J/(kg K) in a bay, 10 W/(m^2 K) on 0.04 m^2",
    ),
    "metal_lag": Spread(
        "skin and loops, likewise",
        "fixed",
        (20.0,),
        "s",
        "estimate: 1 mm of aluminum, 2.4 kJ/(m^2 K), at 70 m/s: 120 W/(m^2 K) by Nu = 0.037 Re^0.8 Pr^(1/3) on 2 m",
    ),
    "cabin": Spread(
        "cabin of a crew after a long time",
        "normal (mean, standard deviation)",
        (18.0, 3.0),
        "degC",
        "estimate: heater by hand",
    ),
    "bay": Spread(
        "instruments without a crew, over the outside",
        "fixed",
        (8.0,),
        "K",
        "estimate: their own heat",
    ),
    "climb": Spread(
        "time from the ground to the first row, in which the cabin approaches its temperature",
        "even between two",
        (600.0, 1800.0),
        "s",
        "estimate: climb to 3000 m and transit",
    ),
    "seam": Spread(
        "resistance of each joint of the skin, over that of the individual",
        "lognormal (sigma of the logarithm)",
        (0.1,),
        "1",
        "estimate: joints work with load and temperature",
    ),
    "payload": Spread(
        "payload over that of the aircraft's file",
        "normal",
        (0.06,),
        "1",
        "estimate: one of the crew more or less",
    ),
    "fuel": Spread(
        "fuel over the capacity of the tanks",
        "even between two",
        (0.4, 0.85),
        "1",
        "estimate: from two hours to a long survey flight",
    ),
    "wind": Spread(
        "each component of the wind over the airspeed",
        "normal",
        (0.05,),
        "1",
        "estimate: surveys and drones fly in weak wind",
    ),
    "turbulence": Spread(
        "standard deviation of the vertical gusts",
        "even between two",
        (0.3, 1.0),
        "m/s",
        "estimate: light air, in which surveys are flown",
    ),
    "daily": Spread(
        "daily variation over the defaults of `[field.variation]`",
        "lognormal (sigma of the logarithm)",
        (0.3,),
        "1",
        "estimate: it changes from day to day by about a third",
    ),
    "pulsations": Spread(
        "pulsations and drift over those defaults, each",
        "lognormal (sigma of the logarithm)",
        (0.6,),
        "1",
        "estimate: quiet and restless days differ by more than three",
    ),
}
"""How the days of an individual differ."""

SEATED: Mapping[str, Spread] = {
    "shift": Spread(
        "time to the next shift in the seat, to a posture that is kept",
        "exponential (mean)",
        (100.0,),
        "s",
        "published: 9 in 15 minutes of office work (Davidson, Callaghan, Applied Ergonomics 2025, 104374)",
    ),
    "fidget": Spread(
        "time to the next fidget, there and back",
        "exponential (mean)",
        (70.0,),
        "s",
        "published: 13 in 15 minutes (the same)",
    ),
    "lasting": Spread(
        "how long a shift takes, and each way of a fidget",
        "even between two",
        (1.0, 2.0),
        "s",
        "estimate: a trunk that leans over",
    ),
    "posture": Spread(
        "place in a posture over the mean one, forward and right",
        "even along each axis, either way",
        (0.04,),
        "m",
        "estimate: 5 degrees of the trunk are 4 cm at 0.5 m above the hips",
    ),
    "height": Spread(
        "the same, down",
        "even, either way",
        (0.01,),
        "m",
        "estimate: a back that slumps",
    ),
    "turning": Spread(
        "turn of a posture about the vertical",
        "even, either way",
        (10.0,),
        "deg",
        "estimate: looking to the side",
    ),
    "fidgeting": Spread(
        "a fidget over the change from one posture to another",
        "fixed",
        (0.4,),
        "1",
        "estimate: 1 to 5 degrees of the trunk instead of 5 and more",
    ),
    "sway": Spread(
        "sway along each axis",
        "Gauss-Markov (standard deviation, correlation time), a value each second, joined smoothly",
        (0.003, 5.0),
        "m, s",
        "estimate: quiet sitting in light air",
    ),
}
"""How people move in their seats during a flight."""

MAGNETS: Mapping[str, tuple[float, str]] = {
    "ferrite": (-0.0020, "estimate: makers' figures of sintered ferrite"),
    "alnico": (-0.0002, "published: about -0.02 %/K (sourcebyspec.com, magnetic material selection)"),
    "ndfeb": (-0.0011, "published: -0.09 to -0.12 %/K (advancedmagnets.com, temperature coefficients)"),
}
"""Relative change of a magnet's moment for each kelvin, with its source."""

ALUMINUM_PER_K = 0.002
"""Relative change of the resistivity of 2024-T3 for each kelvin: estimate, 0.004 of the pure metal times its 30 % IACS
over 61 % (Matthiessen's rule)."""

REFERENCE_C = 20.0
"""Temperature at which the moments and the conductivities of aircraft files hold."""
