"""The command line. Commands are imported when they run, so that ``magsim --help`` is fast."""

import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from difflib import get_close_matches
from importlib import import_module

import click

import magsim
from magsim.cli.messages import print_error
from magsim.errors import MagsimError

COMMANDS = {
    "generate": ("magsim.cli.generate:generate", "Fly a scenario and write its recording."),
    "sweep": ("magsim.cli.sweep:sweep", "Fly a scenario in thousands of variations."),
    "train": ("magsim.cli.train:train", "Train a compensator on recordings."),
    "compensate": ("magsim.cli.compensate:compensate", "Compensate a survey file, or lines as they come."),
    "benchmark": ("magsim.cli.benchmark:benchmark", "Compare compensators on recordings."),
    "check": ("magsim.cli.check:check", "Check a compensator of your own."),
    "observe": ("magsim.cli.observe:observe", "Tell what a calibration flight can know of an aircraft."),
    "explain": ("magsim.cli.explain:explain", "Explain what a trained compensator does to a flight."),
    "paper": ("magsim.cli.paper:paper", "Re-run one of the five papers, its tables beside ours."),
    "demo": ("magsim.cli.demo:demo", "Generate, train, compensate, and draw: the whole chain."),
    "info": ("magsim.cli.info:info", "Show the contents of a recording."),
    "export": ("magsim.cli.export:export", "Write a recording for other programs."),
    "import": ("magsim.cli.import_:import_", "Make a recording from a survey file."),
    "plot": ("magsim.cli.plot:plot", "Draw a figure of a recording."),
    "map": ("magsim.cli.map:map_", "Predict where on an aircraft a magnetometer is quiet."),
    "verify": ("magsim.cli.verify:verify", "Check recording files in every byte."),
    "dataset": ("magsim.cli.dataset:dataset", "Build and check data sets."),
    "schema": ("magsim.cli.schema:schema", "Print the JSON schema of scenario files."),
}
"""Commands by name: module and function, and a short help."""

INTERRUPTED = 130
TERMINATED = 143
BROKEN_PIPE = 1  # as in click


class LazyGroup(click.Group):
    """Group of commands that imports a command only when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands, in the order in which a new user needs them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one command."""
        if cmd_name not in COMMANDS:
            return None
        module, _, function = COMMANDS[cmd_name][0].partition(":")
        return getattr(import_module(module), function)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that is called, or fail with the name of a similar one."""
        name = args[0] if args else ""
        if name not in COMMANDS and not name.startswith("-"):
            close = get_close_matches(name, COMMANDS, n=1)
            hint = f" (did you mean '{close[0]}'?)" if close else ""
            ctx.fail(f"there is no command '{name}'{hint}; allowed: {', '.join(COMMANDS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


@click.command(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(magsim.__version__, prog_name="magsim", message="%(prog)s %(version)s")
def cli() -> None:
    """Simulate calibration flights with known magnetic interference, and compare compensators on them.

    \b
    First steps:
      magsim generate calibration_c208b
      magsim info calibration_c208b.h5
      magsim plot flight calibration_c208b.h5
      magsim benchmark calibration_c208b.h5

    magsim COMMAND --help tells more. Exit codes: 0 done, 2 the request is wrong, 3 the data are bad.
    """  # noqa: D301 - \b is for click


def main(args: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    args : sequence of str, optional
        Arguments without the program's name; those of the process by default.

    Returns
    -------
    int
        Exit code: 0 done, 2 the request cannot be fulfilled, 3 bad data, 130 interrupted, 143 terminated.
    """
    with suppress(ValueError):  # only the main thread may set it
        signal.signal(signal.SIGTERM, _terminate)
    try:
        code = cli.main(args=args, prog_name="magsim", standalone_mode=False)
        sys.stdout.flush()
    except MagsimError as error:
        print_error(str(error))
        return error.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (click.Abort, KeyboardInterrupt):
        print_error("interrupted")
        return INTERRUPTED
    except BrokenPipeError:
        # the reader of the output has closed it; the rest of the buffer is discarded
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    return code if isinstance(code, int) else 0


def _terminate(_signal: int, _frame: object) -> None:
    raise SystemExit(TERMINATED)
