"""What networks are shown by: the fits that each figure needs, and the figures."""

import statistics
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from tests.benchmarks.network_rows.flights import PAPER, WORLDS
from tests.benchmarks.network_rows.measuring import Case, Found, networks
from tests.benchmarks.rows import Row, at_least, stated

SEEDS = 5
"""Start weights of MagTCN that are tried."""

LEAST_OVER_STAGE = 0.97
LEAST_MAGTCN_OVER_TL = 2.0
LEAST_SUBNETWORKS_IR = 300.0
LEAST_IR_LEVEL_4 = 256.0

LM: Mapping[str, Any] = {"first_stage": "none", "optimizer": "lm", "steps": 100, "every": 2}
"""Sub-networks by themselves, by Levenberg-Marquardt: without a first stage they need more steps."""

OURS: Mapping[str, Any] = {
    "inputs": ["tl16", "attitude", "currents", "voltages", "surfaces"],
    "direction": "calibrated",
}
"""The inputs of our methods: the calibrated direction of the background, and every channel."""

STAGES_OF_OURS = ("tl16_auxiliary", "exact_norm")

METHODS_WITH_OURS = ("bp", "williams", "subnetworks", "magtcn")
"""Networks that are tried with the inputs of ours: of single rows, of branches, of few rows, of sequences."""


def with_ours(method: str, stage: str) -> dict[str, Any]:
    """Return the settings of a network on a stage of ours; sub-networks take Tolles-Lawson columns alone."""
    inputs = ["tl16"] if method == "subnetworks" else OURS["inputs"]
    return {**OURS, "inputs": inputs, "first_stage": stage}


class Plan(NamedTuple):
    """What was asked for: networks, worlds, and number of pairs."""

    methods: tuple[str, ...]
    worlds: tuple[str, ...]
    pairs: int

    @classmethod
    def whole(cls, pairs: int) -> "Plan":
        """Return the plan with every network and world."""
        return cls(networks(), WORLDS, pairs)


Results = Sequence[tuple[Case, Mapping[str, Any]]]


class Subject(NamedTuple):
    """Fits of a plan, and rows of their results."""

    cases: Callable[[Plan], list[Case]]
    rows: Callable[[Results], list[Row]]


def scores(results: Results, *, test: str = "test") -> dict[tuple[str, str, int], list[Found]]:
    """Return the scores of all fits by method, world and seed, in the order of the pairs.

    Raises
    ------
    RuntimeError
        If a fit failed: a figure without it would be of the others alone.
    """
    out: dict[tuple[str, str, int], list[Found]] = {}
    for case, found in sorted(results, key=lambda pair: pair[0].number):
        if "failed" in found:
            msg = f"{case.text}: {found['failed']}"
            raise RuntimeError(msg)
        out.setdefault((case.method, case.world, case.seed), []).append(Found(**found["tests"][test]))
    return out


def middle(values: Sequence[float]) -> tuple[float, str]:
    """Return the median of the pairs, and their range in words."""
    return statistics.median(values), f"median of {len(values)} pairs, {min(values):.3g} .. {max(values):.3g}"


def default_cases(plan: Plan) -> list[Case]:
    """Return a fit of every network in every world."""
    return [
        Case(method, world, number) for world in plan.worlds for method in plan.methods for number in range(plan.pairs)
    ]


def default_rows(results: Results) -> list[Row]:
    """Return what every network adds to its first stage, and its improvement ratio."""
    out = []
    for (method, world, _), found in scores(results).items():
        where = f"{method}_over_stage_{_named(world)}"
        value, text = middle([one.over_stage for one in found])
        out.append(at_least(where, value, f"1, {text}", LEAST_OVER_STAGE))
        out.append(stated(f"{where}_worst_pair", min(one.over_stage for one in found), "1"))
        value, text = middle([one.ir for one in found])
        out.append(stated(f"{method}_ir_{_named(world)}", value, f"1, {text}"))
        out.append(stated(f"{method}_fit_s_{_named(world)}", middle([one.fit_s for one in found])[0], "s of one core"))
    return out


def _named(world: str) -> str:
    return world if world == PAPER else f"level_{world}"


def seed_cases(plan: Plan) -> list[Case]:
    """Return fits of MagTCN from several start weights in paper 000's world."""
    return [Case("magtcn", PAPER, number, seed) for seed in range(SEEDS) for number in range(plan.pairs)]


def seed_rows(results: Results) -> list[Row]:
    """Return what MagTCN adds to Tolles-Lawson from the worst start weights."""
    over = {seed: [one.over_stage for one in found] for (_, _, seed), found in scores(results).items()}
    worst = min(over, key=lambda seed: middle(over[seed])[0])
    every = [value for found in over.values() for value in found]
    rows = [stated(f"magtcn_over_tl_000_seed_{seed}", *_of(middle(found))) for seed, found in sorted(over.items())]
    value, text = middle(over[worst])
    return [
        *rows,
        at_least(
            f"magtcn_over_tl_000_worst_of_{len(over)}_seeds", value, f"1, seed {worst}: {text}", LEAST_MAGTCN_OVER_TL
        ),
        stated("magtcn_over_tl_000_worst_seed_and_pair", min(every), f"1, of {len(every)} fits"),
    ]


def _of(found: tuple[float, str]) -> tuple[float, str]:
    return found[0], f"1, {found[1]}"


def lm_cases(plan: Plan) -> list[Case]:
    """Return fits of sub-networks without a first stage in paper 000's world."""
    return [Case("subnetworks", PAPER, number, params=LM) for number in range(plan.pairs)]


def lm_rows(results: Results) -> list[Row]:
    """Return the improvement ratio of sub-networks by themselves."""
    ((_, found),) = scores(results).items()
    value, text = middle([one.ir for one in found])
    return [
        at_least("subnetworks_lm_ir_000", value, f"1, {text}", LEAST_SUBNETWORKS_IR),
        stated("subnetworks_lm_fit_s_000", middle([one.fit_s for one in found])[0], "s of one core"),
    ]


def ours_cases(plan: Plan) -> list[Case]:
    """Return fits of some networks with the inputs of ours on level 4, on two first stages of ours."""
    return [
        Case(method, "4", number, params=with_ours(method, stage))
        for stage in STAGES_OF_OURS
        for method in METHODS_WITH_OURS
        for number in range(plan.pairs)
    ]


def ours_rows(results: Results) -> list[Row]:
    """Return the improvement ratios with the inputs of ours, and the best of them."""
    out, best = [], {}
    for stage in STAGES_OF_OURS:
        of_stage = [one for one in results if one[0].params["first_stage"] == stage]
        for (method, _, _), found in scores(of_stage).items():
            value, text = middle([one.ir for one in found])
            over = middle([one.over_stage for one in found])[0]
            out.append(stated(f"{method}_on_{stage}_ir_level_4", value, f"1, {text}; {over:.3g} times its stage"))
            best[f"{method} on {stage}, {over:.3g} times its stage"] = value
    name = max(best, key=lambda each: best[each])
    return [*out, at_least("best_network_inputs_of_ours_ir_level_4", best[name], f"1, {name}", LEAST_IR_LEVEL_4)]


SUBJECTS: Mapping[str, Subject] = {
    "default": Subject(default_cases, default_rows),
    "seeds": Subject(seed_cases, seed_rows),
    "lm": Subject(lm_cases, lm_rows),
    "ours": Subject(ours_cases, ours_rows),
}
