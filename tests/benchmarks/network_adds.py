"""Where a network helps on top of physics: on an unseen flight, day or individual, with intervals.

Run ``python tests/benchmarks/network_adds.py [--json | --markdown] [--methods bp] [--worlds calibration] [--sets 4]``.
Networks of preset ``default`` with the inputs of ours (calibrated direction, currents, voltages, surfaces) on
``tl16_auxiliary`` and ``exact_norm``, in the honest worlds of ``physics_methods.py``: individuals on their days, people
aboard, a main field that departs from its model. The first circuit of a flight is learned. Each figure is the
improvement ratio over that of the first stage alone, geometric mean over sets with its 95 % interval.
"""

import argparse
import sys

from tests.benchmarks.network_rows import adding, command
from tests.benchmarks.network_rows.subjects import METHODS_WITH_OURS
from tests.benchmarks.physics_rows.sets import DRAWS, WORLDS, fly_world
from tests.benchmarks.physics_rows.shown import tell
from tests.benchmarks.rows import finish


def main() -> None:
    """Fit, judge, print."""
    worlds_here = tuple(name for name, world in WORLDS.items() if "cabin" in world.sensors)
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    command.add_options(parser, command.cache("physics_methods"))
    parser.add_argument("--markdown", action="store_true", help="print the table of docs/networks.md")
    parser.add_argument("--worlds", help=f"by comma: {', '.join(worlds_here)}; default all")
    parser.add_argument("--draw", default="show", choices=sorted(DRAWS), help="tune: the sets settings come from")
    parser.add_argument("--sets", type=int, help="fewer sets than are drawn, for a quick look")
    arguments = parser.parse_args()
    draw = DRAWS[arguments.draw]
    count = draw.honest_sets if arguments.sets is None else arguments.sets
    if not 2 <= count <= draw.honest_sets:
        parser.error(f"--sets is {count}; allowed: 2 to {draw.honest_sets}")
    methods = METHODS_WITH_OURS if arguments.methods is None else command.methods_of(parser, arguments.methods)
    worlds = command.listed(parser, "--worlds", arguments.worlds, worlds_here)
    folder = arguments.folder / arguments.draw
    for world in worlds:
        fly_world(folder / world, world, draw, tell)
    bench = command.Bench.of(arguments, folder, "networks_add.jsonl")
    results, complete = bench.results(adding.cases(methods, worlds, count))
    if not complete:
        command.unfinished()
    found = adding.added(results)
    if arguments.markdown:
        sys.stdout.write(adding.markdown(found))
        return
    finish(adding.rows(found), as_json=arguments.json)


if __name__ == "__main__":
    main()
