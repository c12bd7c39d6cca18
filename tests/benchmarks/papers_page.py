"""Put the tables and pictures of finished runs of papers on the page ``docs/papers.md``.

Run ``python tests/benchmarks/papers_page.py [--folder papers]`` after ``magsim paper NNN -o papers/NNN``: what stands
on the page between ``<!-- run NNN -->`` and ``<!-- end -->`` becomes what the folder of that run holds; papers
without a finished run there stay as they are. Pictures go to ``docs/papers``.
"""

import argparse
import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from magsim.storage import atomic_text

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/papers.md"
PICTURES = ROOT / "docs/papers"


def parts_of(run: Path) -> Iterator[str]:
    """Yield the tables of a run in the paper's order, as Markdown."""
    for table in json.loads((run / "tables.json").read_text(encoding="utf-8"))["tables"]:
        yield (run / "tables" / f"{table['key']}.md").read_text(encoding="utf-8").rstrip()


def pictures_of(run: Path, number: str) -> Iterator[str]:
    """Copy the pictures of a run beside the page; yield what shows them."""
    PICTURES.mkdir(exist_ok=True)
    for picture in sorted((run / "figures").glob("*.png")):
        name = f"{number}_{picture.name}"
        shutil.copyfile(picture, PICTURES / name)
        yield f"![Paper {number}, {picture.stem.replace('_', ' ')}](papers/{name})"


def filled(page: str, folder: Path) -> str:
    """Return the page with the tables and pictures of the runs in a folder."""

    def of_run(match: re.Match[str]) -> str:
        number = match["number"]
        run = folder / number
        if not (run / "tables.json").exists():
            return match[0]
        parts = [*parts_of(run), *pictures_of(run, number)]
        return "\n\n".join([f"<!-- run {number} -->", *parts, "<!-- end -->"])

    return re.sub(r"<!-- run (?P<number>\d+) -->.*?<!-- end -->", of_run, page, flags=re.DOTALL)


def main() -> None:
    """Fill the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--folder", type=Path, default=Path("papers"), help="of the runs, one folder each")
    folder = parser.parse_args().folder
    atomic_text(PAGE, filled(PAGE.read_text(encoding="utf-8"), folder), force=True)


if __name__ == "__main__":
    main()
