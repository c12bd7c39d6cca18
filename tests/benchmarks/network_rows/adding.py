"""What a network adds to a first stage of ours on flights, days and individuals that it has not seen."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from tests.benchmarks.network_rows.measuring import Case, Found
from tests.benchmarks.network_rows.subjects import STAGES_OF_OURS, Results, with_ours
from tests.benchmarks.physics_rows.intervals import Mean, geometric_mean
from tests.benchmarks.rows import Row, stated

TESTS: Mapping[str, str] = {
    "flight": "the second circuit of the flight whose first was learned",
    "day": "the same individual on another day",
    "individual": "another individual",
}


LEAST = 0.01
"""What counts as a gain or a loss: a share that no user would notice is neither."""


class Added(NamedTuple):
    """What a network adds in one place.

    Attributes
    ----------
    method, stage, world, test : str
    over : Mean
        Geometric mean over sets of its improvement ratio over that of its stage.
    ir, stage_ir : float
        Geometric means.
    sets : int
    """

    method: str
    stage: str
    world: str
    test: str
    over: Mean
    ir: float
    stage_ir: float
    sets: int

    @property
    def helps(self) -> bool:
        """Whether the whole interval is above 1, and the gain counts."""
        return self.over.low > 1.0 and self.over.value >= 1.0 + LEAST

    @property
    def harms(self) -> bool:
        """Whether the whole interval is below 1, and the loss counts."""
        return self.over.high < 1.0 and self.over.value <= 1.0 - LEAST


def cases(methods: Sequence[str], worlds: Sequence[str], count: int) -> list[Case]:
    """Return the fits: every network on both stages, in every set of every world."""
    return [
        Case(method, world, number, params=with_ours(method, stage))
        for world in worlds
        for stage in STAGES_OF_OURS
        for method in methods
        for number in range(count)
    ]


def added(results: Results) -> list[Added]:
    """Return what networks add, place by place.

    Raises
    ------
    RuntimeError
        If a fit failed.
    """
    found: dict[tuple[str, str, str, str], list[Found]] = {}
    for case, one in results:
        if "failed" in one:
            msg = f"{case.text}: {one['failed']}"
            raise RuntimeError(msg)
        for test in TESTS:
            place = (case.world, test, str(case.params["first_stage"]), case.method)
            found.setdefault(place, []).append(Found(**one["tests"][test]))
    return [
        Added(
            method,
            stage,
            world,
            test,
            geometric_mean([one.over_stage for one in some]),
            geometric_mean([one.ir for one in some]).value,
            geometric_mean([one.stage_ir for one in some]).value,
            len(some),
        )
        for (world, test, stage, method), some in found.items()
    ]


def rows(found: Sequence[Added]) -> list[Row]:
    """Return the figures, and how many places a network helps and harms in."""
    out = [
        stated(
            f"{one.method}_over_{one.stage}_{one.world}_{one.test}",
            one.over.value,
            f"1, {one.over.text}; {one.sets} sets; IR {one.ir:.4g} over {one.stage_ir:.4g}",
        )
        for one in found
    ]
    for stage in dict.fromkeys(one.stage for one in found):
        places = [one for one in found if one.stage == stage]
        unit = f"of {len(places)} networks and places, by {LEAST:.0%} or more, 95 % interval"
        out.append(stated(f"helps_on_{stage}", sum(one.helps for one in places), f"{unit} above 1"))
        out.append(stated(f"harms_on_{stage}", sum(one.harms for one in places), f"{unit} below 1"))
    return out


def markdown(found: Sequence[Added]) -> str:
    """Return the table of the documentation: a line for each place and stage, a column for each network."""
    methods = [*dict.fromkeys(one.method for one in found)]
    places: dict[tuple[str, str, str], dict[str, Added]] = {}
    for one in found:
        places.setdefault((one.stage, one.world, one.test), {})[one.method] = one
    lines = [f"| stage | world | unseen | its IR | {' | '.join(f'`{name}`' for name in methods)} |"]
    lines.append("|---" * (4 + len(methods)) + "|")
    for (stage, world, test), some in places.items():
        first = next(iter(some.values()))
        each = [_cell(some[name]) for name in methods]
        lines.append(f"| `{stage}` | {world} | {test} | {first.stage_ir:.3g} | {' | '.join(each)} |")
    return "\n".join(lines) + "\n"


def _cell(one: Added) -> str:
    text = f"{one.over.value:.3g} ({one.over.low:.3g} .. {one.over.high:.3g})"
    return f"**{text}**" if one.helps else text
