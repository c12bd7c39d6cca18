"""One contest for the tests of a file."""

from collections.abc import Iterator

import pytest

from magsim.benchmark.contest import Contest


@pytest.fixture(scope="module")
def contest() -> Iterator[Contest]:
    with Contest() as one:
        yield one
