"""Interrupts that come at a bad moment."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def held() -> Iterator[None]:
    """Hold back interrupts until the end of the block, then let them act.

    For imports of large libraries: some of them catch everything while they look for optional parts, an interrupt
    included, which would be lost.
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
