"""The documentation tells what the program does."""

import re
from pathlib import Path

from magsim import columns

ROOT = Path(__file__).parents[1]


def test_every_column_family_is_documented_with_its_role():
    text = (ROOT / "docs" / "recording.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`.+?) \| (\w+) \|", text, flags=re.MULTILINE)
    told = {name: role for names, role in rows for name in re.findall(r"`([^`]+)`", names)}
    assert told == {family.pattern: family.role for family in columns.FAMILIES}


def test_links_between_pages_lead_somewhere():
    for page in [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]:
        for link in re.findall(r"\]\((?!https?://)([^)#]+)", page.read_text(encoding="utf-8")):
            assert (page.parent / link).exists(), f"{page.name}: {link}"


def test_files_that_the_readme_names_exist():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for path in re.findall(r"`((?:scenarios|aircraft|docs|magsim)/[\w/.]*)`", text):
        assert (ROOT / path).exists(), path
