"""``magsim generate``: from a scenario to a recording."""

from pathlib import Path

import click

from magsim.cli.messages import print_error, warn


class WithScenarios(click.Command):
    """A command whose help lists the shipped scenarios."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write their names below the options."""
        del ctx
        from magsim.assets import list_scenarios

        with formatter.section("Shipped scenarios"):
            formatter.write_text(", ".join(list_scenarios()))


@click.command(short_help="Fly a scenario and write its recording.", cls=WithScenarios)
@click.argument("scenario")
@click.option(
    "-o", "--output", metavar="FILE", type=click.Path(path_type=Path), help="The recording; default ./<scenario>.h5"
)
@click.option(
    "--set",
    "overrides",
    metavar="KEY.PATH=VALUE",
    multiple=True,
    help="Change one setting of the scenario, for example --set start.alt_m=2500; may be repeated.",
)
@click.option("--force", is_flag=True, help="Replace an existing recording.")
@click.option("-q", "--quiet", is_flag=True, help="Show no progress and no summary.")
def generate(scenario: str, output: Path | None, overrides: tuple[str, ...], force: bool, quiet: bool) -> None:
    """Fly SCENARIO and write its recording.

    SCENARIO is a TOML file, or the name of a shipped scenario; magsim schema describes the keys. The same scenario,
    settings and version write the same bytes. What is hardly meant, as a setting without effect, is a line on stderr.
    """
    from magsim.cli.interrupts import delayed

    with delayed():
        from magsim import storage
        from magsim.cli.progress import simulating
        from magsim.loading import load_scenario

    loaded = load_scenario(scenario, overrides)
    target = output or Path(f"{loaded.name}.h5")
    storage.check_target(target, force=force)
    for line in loaded.resting:
        print_error(f"warning: {line}")

    with delayed():
        from magsim.simulation import simulate

    with simulating(quiet=quiet) as progress:
        recording = simulate(loaded, progress=progress)
    recording.write(target, force=force)
    warn([recording])
    if not quiet:
        duration = recording.time_s[-1] - recording.time_s[0]
        click.echo(f"{target}: {len(recording)} rows, {duration:.1f} s, {len(recording.data)} columns")
