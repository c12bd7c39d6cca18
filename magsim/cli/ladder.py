"""``magsim benchmark --ladder``: judge compensators on the ladder."""

import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from magsim.errors import RequestError

if TYPE_CHECKING:
    from magsim.ladder.run import Settings

TRACKS_BY_DEFAULT = ("no-labels", "open")
SETS, NETWORK_SETS = (12, 30), (4, 12)
"""By default, and of a full run: of closed forms, and of networks."""

OPTIONS = (
    click.option(
        "--ladder",
        is_flag=True,
        help="Judge on the ladder, without RECORDINGS: sets of flights that are flown in memory, each method in "
        "processes of its own.",
    ),
    click.option("--levels", metavar="LIST", help="Levels of the ladder; default six, with --full all."),
    click.option(
        "--track",
        metavar="LIST",
        help="no-labels, frozen, classic, closed, open, reference; default no-labels,open, with --full all.",
    ),
    click.option("--sets", type=click.IntRange(1, 1000), help="Sets of flights; default 12, with --full 30."),
    click.option(
        "--archive",
        type=click.Path(path_type=Path),
        help="A submission, whose digest makes the hidden seed together with --randomness.",
    ),
    click.option("--randomness", metavar="TEXT", help="Public randomness that is dated after the archive."),
    click.option(
        "-j",
        "--jobs",
        type=click.IntRange(min=1),
        default=1,
        show_default=True,
        help="Processes that fly and judge the ladder.",
    ),
    click.option("--resume", is_flag=True, help="Go on with a run of the ladder that was broken off."),
    click.option(
        "--full", is_flag=True, help="All levels and tracks of the ladder, networks by their defaults: many hours."
    ),
    click.option(
        "--flights",
        is_flag=True,
        help="Write the ladder's flights with their truth, for development, and judge nothing.",
    ),
)


def with_ladder_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of the ladder."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


@dataclass(frozen=True)
class LadderOptions:
    """What was asked for; None where it was not."""

    ladder: bool
    levels: str | None
    track: str | None
    sets: int | None
    archive: Path | None
    randomness: str | None
    jobs: int
    resume: bool
    full: bool
    flights: bool

    @property
    def given(self) -> list[str]:
        """Names of the options that were given."""
        values = {
            "--levels": self.levels, "--track": self.track, "--sets": self.sets, "--archive": self.archive,
            "--randomness": self.randomness, "--resume": self.resume, "--full": self.full, "--flights": self.flights,
        }  # fmt: skip
        return [name for name, value in values.items() if value not in (None, False)]


def run_ladder(
    options: LadderOptions,
    methods: Sequence[str] | None,
    *,
    seed: int | None,
    quick: bool,
    output: Path | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run the ladder and print its board.

    Raises
    ------
    RequestError
        If an option does not fit.
    """
    from magsim.ladder import pages, run
    from magsim.ladder.definition import read_ladder

    folder = output or Path("ladder_board")
    settings = settings_of(options, methods, seed=seed, quick=quick)

    def announce(line: str) -> None:
        if not quiet:
            click.echo(line, err=True)

    if options.flights:
        from magsim.ladder.export import write_flights

        levels = read_ladder().chosen(settings.levels)
        for number in range(settings.sets):
            announce(f"flying set {number}")
            for path in write_flights(folder, levels, settings.seed, number):
                click.echo(path)
        return
    announce(
        f"{folder}: {settings.sets} sets on {len(settings.levels)} levels and {len(settings.tracks)} tracks, "
        f"{len(settings.methods)} methods and {len(settings.networks)} networks"
    )
    board = run.run_ladder(settings, folder, workers=options.jobs, resume=options.resume, announce=announce)
    click.echo((folder / "report.json").read_text(encoding="utf-8") if as_json else pages.text(board), nl=False)
    announce(f"{folder / 'board.html'} has the whole")


def settings_of(options: LadderOptions, methods: Sequence[str] | None, *, seed: int | None, quick: bool) -> "Settings":
    """Return what is run, checked."""
    from magsim.benchmark.contest import Allowance
    from magsim.ladder.definition import read_ladder
    from magsim.ladder.run import Settings, entries_of
    from magsim.ladder.seeds import PUBLIC_SEED, hidden_seed
    from magsim.ladder.tracks import TRACKS, chosen_tracks

    ladder = read_ladder()
    if quick and options.full:
        msg = "--quick and --full exclude each other"
        raise RequestError(msg)
    if (options.archive is None) != (options.randomness is None):
        msg = "--archive and --randomness belong together: a hidden seed is made of both"
        raise RequestError(msg)
    names = _names(options.levels, tuple(ladder.levels) if options.full else ladder.quick)
    levels = tuple(level.name for level in ladder.chosen(names))
    tracks = tuple(
        t.name for t in chosen_tracks(_names(options.track, tuple(TRACKS) if options.full else TRACKS_BY_DEFAULT))
    )
    closed, networks = _methods(methods)
    if options.archive is not None and options.randomness is not None:
        seed = hidden_seed(options.archive, options.randomness)
    else:
        seed = PUBLIC_SEED if seed is None else seed
    sets = options.sets or SETS[options.full]
    return Settings(
        levels,
        tracks,
        sets,
        seed,
        entries_of(closed, quick=not options.full),
        entries_of(networks, quick=not options.full),
        tuple(name for name in ladder.networks if name in levels) if methods is None else levels,
        min(NETWORK_SETS[options.full], sets) if methods is None else sets,
        Allowance(),
        f"magsim {shlex.join(sys.argv[1:])}",
    )


def _names(text: str | None, default: tuple[str, ...]) -> tuple[str, ...]:
    return default if text is None else tuple(part.strip() for part in text.split(",") if part.strip())


def _methods(methods: Sequence[str] | None) -> tuple[list[str], list[str]]:
    """Return closed forms and networks: those that were asked for, or all that there are."""
    from magsim.compensation import make, names
    from magsim.ladder.baselines import BASELINES
    from magsim.ladder.run import check_entry

    if methods is None:
        every = [name for name in names() if name not in (*BASELINES, "tolles_lawson")]
        trained = [name for name in every if make(name).trains]
        return [name for name in every if name not in trained], [name for name in trained if name in NETWORKS]
    asked = [name for name in dict.fromkeys(methods) if name not in BASELINES]
    for name in asked:
        check_entry(name)
    # every board has the method that all others are compared with
    return [*(name for name in ("tl16", "tl16_measured") if name not in asked), *asked], []


NETWORKS = ("bp", "magtcn")
"""Networks of a run that names no methods."""
