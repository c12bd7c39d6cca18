"""Interrupts during imports."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def delayed() -> Iterator[None]:
    """Delay interrupts until the end of the block.

    For imports of large libraries: some of them catch every exception while they look for optional parts, so that an
    interrupt would be lost.
    """
    caught: list[int] = []
    try:
        before = {
            number: signal.signal(number, lambda number, _frame: caught.append(number))
            for number in (signal.SIGINT, signal.SIGTERM)
        }
    except ValueError:  # not in the main thread, where interrupts do not arrive
        before = {}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if caught:
        signal.raise_signal(caught[0])
