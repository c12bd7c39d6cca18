"""The page of populations prints the spreads that are drawn from."""

import re

from magsim.population import DAY, INDIVIDUAL, MAGNETS, SEATED
from tests.support.paths import ROOT

HEAD = "| what | law | size | unit | source |\n|---|---|---|---|---|\n"


def _between(mark: str) -> str:
    text = (ROOT / "docs" / "population.md").read_text(encoding="utf-8")
    (found,) = re.findall(rf"<!-- {mark} -->\n\n(.*?)\n\n<!-- end -->", text, flags=re.DOTALL)
    return found


def test_the_spreads_of_individuals_are_on_the_page() -> None:
    assert _between("individuals") == HEAD + "\n".join(spread.row for spread in INDIVIDUAL.values())


def test_the_spreads_of_days_are_on_the_page() -> None:
    assert _between("days") == HEAD + "\n".join(spread.row for spread in DAY.values())
    assert _between("seated") == HEAD + "\n".join(spread.row for spread in SEATED.values())
    magnets = [f"| `{name}` | {100.0 * per_k:g} | {source} |" for name, (per_k, source) in MAGNETS.items()]
    assert _between("magnets").split("\n")[2:] == magnets


def test_every_spread_has_a_source() -> None:
    for source in [spread.source for spread in (*INDIVIDUAL.values(), *DAY.values(), *SEATED.values())] + [
        s for _, s in MAGNETS.values()
    ]:
        assert source.startswith("estimate") or "published" in source
