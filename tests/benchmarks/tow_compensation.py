"""What the compensators of paper 002 leave on its flights: learned from the diamond, judged on the square.

    python tests/benchmarks/tow_compensation.py                 three seeds: sways, gusts and noise of their own
    python tests/benchmarks/tow_compensation.py --seeds 8 --markdown

prints, for no compensation, Tolles-Lawson with 16 terms, the same with the height (N = 0) and with Taylor terms up to
order N, the paper's improvement ratio after a high-pass at 0.03 Hz and the one in band against truth, whole and by
heading: means over the seeds with their standard deviations. The ground is the same for all; one seed ranks nothing.
"""

import argparse

import numpy as np

from magsim.benchmark import Report, evaluate
from magsim.loading import load_scenario
from magsim.recording import Recording
from magsim.simulation import simulate
from tests.benchmarks.rows import Row, at_least, finish, stated

METHODS = ("none", "tl16_measured", *(f"tl16_gradient:order={n}" for n in range(5)), "noise_floor")
SCORES = ("ir_003", "ir")
SEGMENTS = ("test", *(f"heading {heading}" for heading in (0, 90, 180, 270)))


def flown(name: str, seed: int) -> Recording:
    """One of the paper's flights with another seed."""
    return simulate(load_scenario(f"papers/{name}", [f"seed={seed}", "recording.truth=sum"]))


def report_of(seed: int) -> Report:
    """Fit on the diamond, judge on the square."""
    return evaluate([flown("002_diamond", 1000 + seed), flown("002_square", 2000 + seed)], METHODS, seed=seed)


LABELS = {"tl16_measured": "Tolles-Lawson, 16 terms"} | {f"tl16_gradient:order={n}": f"N = {n}" for n in range(5)}
"""Of methods in the tables of docs/tow.md."""


def spreads(reports: list[Report]) -> dict[tuple[str, str, str], tuple[float, float]]:
    """Mean and standard deviation over the seeds by score, method and segment."""
    out = {}
    for score in SCORES:
        for method in METHODS:
            for segment in SEGMENTS:
                values = [report.value(method, score, segment=segment) for report in reports]
                out[score, method, segment] = float(np.mean(values)), float(np.std(values, ddof=len(values) > 1))
    return out


def markdown(found: dict[tuple[str, str, str], tuple[float, float]]) -> str:
    """One table for each score, as in docs/tow.md."""
    lines = []
    for score in SCORES:
        lines += [f"| {score} | all | {' | '.join(SEGMENTS[1:])} |", "|---" * (len(SEGMENTS) + 1) + "|"]
        for method in METHODS:
            cells = [f"{mean:.2f} ± {spread:.2f}" for mean, spread in (found[score, method, s] for s in SEGMENTS)]
            lines.append(f"| {LABELS.get(method, method)} | {' | '.join(cells)} |")
        lines.append("")
    return "\n".join(lines)


def rows_of(found: dict[tuple[str, str, str], tuple[float, float]]) -> list[Row]:
    """Means over the seeds; compensation must help against truth."""
    rows = []
    for (score, method, segment), (mean, _) in found.items():
        name = f"{score}_{method.removeprefix('tl16_').replace(':', '_')}_{segment.replace(' ', '_')}"
        helps = score == "ir" and segment == "test" and method not in ("none", "noise_floor")
        rows.append(at_least(name, mean, "1", 1.0) if helps else stated(name, mean, "1"))
    return rows


def main() -> None:
    """Fly, fit, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--markdown", action="store_true", help="print the tables of docs/tow.md")
    parser.add_argument("--json", action="store_true", help="print a JSON list and nothing else")
    arguments = parser.parse_args()
    found = spreads([report_of(seed) for seed in range(arguments.seeds)])
    if arguments.markdown:
        print(markdown(found))
        return
    finish(rows_of(found), as_json=arguments.json)


if __name__ == "__main__":
    main()
