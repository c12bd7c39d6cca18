"""Lines for people beside the output: errors and warnings, all of them on stderr."""

from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from magsim.recording import Recording


def print_error(text: str) -> None:
    """Write lines to stderr, with control characters, which a path may hold, escaped."""
    plain = "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)
    with suppress(OSError):
        click.echo(plain, err=True)


def warn(recordings: Iterable["Recording"]) -> None:
    """Write a line to stderr for everything about recordings that is hardly meant."""
    from magsim.recording.plausibility import warnings_of

    for recording in recordings:
        for text in warnings_of(recording):
            print_error(f"warning: {recording.name}: {text}")
