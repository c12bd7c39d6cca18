"""Ways to win without being right, and what the ladder makes of them.

Run ``python tests/benchmarks/cheats.py [--json] [--sets 2]``. Every cheat is entered beside Tolles-Lawson on level
L4, whose truth has most to offer, with all channels and labels, on sets of a hidden seed; then a method that flies
the public sets for itself, on one public and one hidden set. A cheat wins where it has a rank, no mark, and a larger
improvement ratio than the Tolles-Lawson that it begins with. It takes some minutes.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from magsim import signals
from magsim.benchmark.contest import Allowance, Contest, Contestant
from magsim.benchmark.judging import residuals_of
from magsim.benchmark.residuals import Judged
from magsim.benchmark.twins import twin_of
from magsim.compensation import create
from magsim.dataset import training_rows
from magsim.ladder.board import LevelTable, make_board
from magsim.ladder.definition import read_ladder
from magsim.ladder.flights import fly_set
from magsim.ladder.judged import CROP_S, SetTask, judge_set
from magsim.ladder.results import Score
from magsim.ladder.seeds import PUBLIC_SEED, hidden_seed
from magsim.ladder.tracks import TRACKS, blind_of, training_of
from magsim.threads import one_blas_thread
from tests.benchmarks.cheat_rows import removers, tricks
from tests.benchmarks.cheat_rows.flies import FliesPublicSets
from tests.benchmarks.rows import Row, at_least, at_most, finish, stated

LEVEL, TRACK = "L4", "open"
MARGIN = 1.02
"""By how much a cheat must exceed the method that it begins with."""

HERE = Path(__file__).parent / "cheat_rows"
RANDOMNESS = "public randomness of the cheats' own sets"
LIMITS = Allowance(fit_s=60.0, estimate_s=25.0)
HONEST = ("tl16", "tl18", "tl16_auxiliary", "vector_tl", "exact_norm", "exact_norm_whole")
TURNS = 3


def cheats() -> tuple[Contestant, ...]:
    """Return all tricks of ``tricks.py`` and ``removers.py``."""
    out = []
    for module in (tricks, removers):
        file = HERE / f"{module.__name__.rpartition('.')[2]}.py"
        own = [
            name for name, value in vars(module).items() if isinstance(value, type) and issubclass(value, module.Honest)
        ]
        out += [Contestant(name, f"{file}:{name}") for name in own if name not in {"Honest", "Reader"}]
    return tuple(out)


def judged(
    entries: Sequence[Contestant], seed: int, sets: Sequence[int], limits: Allowance = LIMITS
) -> tuple[LevelTable, list[Score]]:
    """Judge methods and return their table and scores."""
    results = [judge_set(SetTask(number, seed, (LEVEL,), (TRACK,), tuple(entries), (), (), limits)) for number in sets]
    scores = [score for one in results for score in one.scores]
    board = make_board({}, read_ladder(), scores, [one for result in results for one in result.entered])
    return board.tables[0], scores


def winners(table: LevelTable, names: Sequence[str]) -> list[str]:
    """Return the cheats that win, and say of every one what became of it."""
    won = []
    for name in names:
        one = next((one for one in table.standings if one.method == name), None)
        if one is None:
            tell(f"{name}: lost, {table.lost.get(name, 'no score')}")
            continue
        marks = table.marks.get(name, ())
        better = one.over_baseline.value > MARGIN
        state = (
            "fails: " + ", ".join(one.failed) if one.failed else f"marked {', '.join(marks)}" if marks else "no better"
        )
        if better and not one.failed and not marks:
            won.append(name)
            state = "WINS"
        tell(f"{name}: {one.over_baseline.value:.4g} times tl16, {state}")
    return won


def pretrained(seed: int) -> Contestant:
    """Return a method that was fitted to the very flight that it is judged on."""
    flown = fly_set(read_ladder(), read_ladder().chosen((LEVEL,)), seed, 0)[LEVEL]
    folder = Path(tempfile.mkdtemp()) / "has_seen_the_test"
    create("exact_norm").fit([flown.tests["circuit"], *flown.training], sensor="cabin").save(folder)
    return Contestant(folder.name, str(folder))


def differing(alone: Sequence[Score], beside: Sequence[Score]) -> int:
    """Return how many scores of Tolles-Lawson differ in any digit."""
    own = [[score for score in scores if score.method == "tl16"] for scores in (alone, beside)]
    return sum(repr(a) != repr(b) for a, b in zip(*own, strict=True)) + (0 if own[0] else 1)


def overhead(seed: int) -> Sequence[Row]:
    """Time methods in processes of their own and in this one, turn by turn; the least of each counts."""
    flown = fly_set(read_ladder(), read_ladder().chosen((LEVEL,)), seed, 0)[LEVEL]
    track, rng = TRACKS[TRACK], np.random.default_rng(1)
    training = training_of(track, flown, "cabin")
    assert training is not None
    twins = [twin_of(one, "cabin", rng, 1.0) for one in flown.tests.values()]
    rounds = [
        [blind_of(track, one, "cabin") for one in flown.tests.values()],
        [blind_of(track, one.recording, "cabin") for one in twins],
    ]

    def scored(name: str, estimates: Sequence[Sequence[np.ndarray]]) -> None:
        for role, recording, twin, one, two in zip(flown.tests, flown.tests.values(), twins, *estimates, strict=True):
            about = Judged(role, "", "cabin", None, 0, name)
            residuals_of(
                recording, sensor="cabin", estimate=one, twin=twin, twin_estimate=two, judged=about, crop_s=CROP_S
            )

    spent: dict[str, list[float]] = {"isolated": [], "together": []}
    with Contest() as contest, one_blas_thread():
        contest.run(Contestant("tl16", "tl16"), training, "cabin", rounds, LIMITS, rng)  # its server is there
        for _ in range(TURNS):
            began = time.monotonic()
            for name in HONEST:
                scored(name, contest.run(Contestant(name, name), training, "cabin", rounds, LIMITS, rng).estimates)
            spent["isolated"].append(time.monotonic() - began)
            began = time.monotonic()
            for name in HONEST:
                method = create(name).fit_rows(training_rows(training, "cabin"))
                scored(name, [[method.interference(one) for one in flights] for flights in rounds])
            spent["together"].append(time.monotonic() - began)
    least = {name: min(values) for name, values in spent.items()}
    each = 1000.0 * (least["isolated"] - least["together"]) / len(HONEST)
    unit = f"%, {least['isolated']:.3g} s over {least['together']:.3g} s of {len(HONEST)} closed forms"
    return [
        at_most("isolation_overhead_pct", 100.0 * (least["isolated"] / least["together"] - 1.0), unit, 10.0),
        stated("isolation_ms_per_method", each, "ms of wall time for each method"),
    ]


def on_public_set() -> float:
    """Return how much better than Tolles-Lawson a method is that flies the public sets, out of its sandbox."""
    flown = fly_set(read_ladder(), read_ladder().chosen((LEVEL,)), PUBLIC_SEED, 0)[LEVEL]
    test, left = flown.tests["circuit"], []
    for method in (create("tl16"), FliesPublicSets()):
        fitted = method.fit([*flown.training], sensor="cabin")
        error = test["mag_cabin_nt"] - test["clean_cabin_nt"] - fitted.interference(test)
        left.append(float(np.std(signals.band_pass(error, test.rate_hz)[600:-300])))
    return left[0] / left[1]


def tell(line: str) -> None:
    """Say a line, apart from the answer."""
    sys.stderr.write(line + "\n")


def main() -> None:
    """Enter all cheats, and print the rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    parser.add_argument("--sets", type=int, default=2, help="sets of flights that the cheats are judged on")
    arguments = parser.parse_args()
    seed = hidden_seed(HERE / "tricks.py", RANDOMNESS)
    numbers, honest, every = range(arguments.sets), Contestant("tl16", "tl16"), cheats()
    _, alone = judged([honest], seed, numbers)
    beside_table, beside = judged(
        [*every[: len(every) // 2], honest, *every[len(every) // 2 :], pretrained(seed)], seed, numbers
    )
    won = winners(beside_table, [*(one.name for one in every), "has_seen_the_test"])
    flies = Contestant("FliesPublicSets", f"{HERE / 'flies.py'}:FliesPublicSets")
    hidden, _ = judged([honest, flies], seed, [0])
    won += winners(hidden, [flies.name])
    finish(
        [
            at_most("cheats_that_win", float(len(won)), f"of {len(every) + 2}: {', '.join(won) or 'none'}", 0.0),
            at_least("cheats", float(len(every) + 2), "entered", 22.0),
            at_most(
                "honest_scores_that_differ",
                float(differing(alone, beside)),
                "scores of tl16 alone and beside all cheats",
                0.0,
            ),
            stated(
                "who_flies_public_sets_over_tl16",
                on_public_set(),
                "1, on a public set, out of its sandbox: rankings come from hidden ones",
            ),
            *overhead(seed),
        ],
        as_json=arguments.json,
    )


if __name__ == "__main__":
    main()
