"""The card of a data set: a description for users, from its recipe, manifest and statistics."""

import json
from collections.abc import Sequence

from magsim import columns
from magsim.dataset import Manifest
from magsim.generation.description.statistics import STATISTICS, Statistics
from magsim.generation.recipe import LoadedRecipe

CARD = "README.md"
"""Name of the file."""

LICENSES = {"CC-BY-4.0": "Creative Commons Attribution 4.0 International"}


def license_url(license_: str) -> str:
    """Return the address of the page of an SPDX identifier."""
    return f"https://spdx.org/licenses/{license_}.html"


def citation(loaded: LoadedRecipe) -> str:
    """Return the BibTeX entry of a data set."""
    recipe = loaded.recipe
    return (
        f"@misc{{magsim_{loaded.name}, title = {{{recipe.title}}}, author = {{{{{recipe.creator}}}}}, "
        f"year = {{{recipe.date.year}}}, note = {{data set {loaded.name} {recipe.version}, made with magsim}}}}"
    )


def card(loaded: LoadedRecipe, manifest: Manifest, statistics: Statistics) -> str:
    """Return the card in Markdown: the same text for the same recipe, manifest and statistics."""
    recipe = loaded.recipe
    blocks = [
        _front_matter(loaded),
        f"# {recipe.title}",
        recipe.description.strip(),
        _section("Contents", _files(loaded, manifest)),
        _section("Splits", SPLITS),
        _section("Columns", _columns(manifest, statistics)),
        _section("Statistics", _numbers(manifest, statistics)),
        _section("Generation", _made(loaded, manifest)),
        _section("Uses", _list(recipe.uses)) if recipe.uses else "",
        _section("Limits", _list(recipe.limits)) if recipe.limits else "",
        _section("License and citation", _license(loaded)),
    ]
    return "\n\n".join(block for block in blocks if block) + "\n"


SPLITS = (
    "The column `split` states the purpose of each row: 0 train, 1 valid, 2 test. Rows are split by flight, circuit or "
    "leg, never at random and never by window: a part can be filtered as one, without its first and last 30 s."
)


def _section(title: str, text: str) -> str:
    return f"## {title}\n\n{text}"


def _list(texts: Sequence[str]) -> str:
    return "\n".join(f"- {text}" for text in texts)


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def _front_matter(loaded: LoadedRecipe) -> str:
    """Return the lines that data hubs read."""
    recipe = loaded.recipe
    tags = ["tags:", *(f"- {word}" for word in recipe.keywords)] if recipe.keywords else []
    title = json.dumps(recipe.title, ensure_ascii=False)
    return "\n".join(["---", f"license: {recipe.license.lower()}", f"pretty_name: {title}", *tags, "---"])


def _files(loaded: LoadedRecipe, manifest: Manifest) -> str:
    """Return the table of files and flights, and the commands that build and read them."""
    notes = {f"{shard.name}.h5": shard.note for shard in loaded.recipe.shards}
    rows = []
    for entry in manifest.files:
        for number, flight in enumerate(entry.flights):
            counts = [str(flight.rows_in(split)) for split in columns.SPLITS.values()]
            first = (f"`{entry.name}`", notes.get(entry.name, "")) if not number else ("", "")
            rows.append([*first, f"`{flight.name}`", *counts])
    table = _table(["file", "content", "flight", "train rows", "valid rows", "test rows"], rows)
    files = f"{manifest.size / 1e6:.1f} MB in {len(manifest.files)} file{'s' if len(manifest.files) > 1 else ''}, HDF5"
    folder = f"data/{loaded.name}"
    commands = [
        f"magsim dataset build {loaded.name}        # -> {folder}/",
        f"magsim dataset check {folder}",
        f"magsim benchmark {folder}/{manifest.files[0].name}",
    ]
    code = [
        "from magsim import Dataset",
        "",
        f'data = Dataset("{folder}")',
        'train, test = data.split("train"), data.split("test")',
    ]
    blocks = [table, f"{files}. The data are generated, not downloaded:", _code("", commands), _code("python", code)]
    return "\n\n".join(blocks)


def _code(language: str, lines: Sequence[str]) -> str:
    return "\n".join([f"```{language}", *lines, "```"])


def _columns(manifest: Manifest, statistics: Statistics) -> str:
    """Return the families of columns, with the files that have them unless all do."""
    named: dict[columns.Family, dict[str, None]] = {}
    files: dict[columns.Family, dict[str, None]] = {}
    for file, _, column in statistics:
        family = columns.family_of(column)
        named.setdefault(family, {})[column] = None
        files.setdefault(family, {})[file] = None
    rows = []
    for family in (family for family in columns.FAMILIES if family in named):
        where = "" if len(files[family]) == len(manifest.files) else ", ".join(f"`{name}`" for name in files[family])
        count = len(named[family])
        rows.append([f"`{family.pattern}`", family.role, family.unit, str(count), family.meaning, where or "all"])
    return _table(["family", "role", "unit", "columns", "meaning", "files"], rows)


def _numbers(manifest: Manifest, statistics: Statistics) -> str:
    """Return the statistics of readings and labels; those of all columns are in a file beside the card."""
    rows = [
        [f"`{file}`", split, f"`{column}`", str(s.rows), *(f"{x:.3f}" for x in (s.least, s.largest, s.mean, s.std))]
        for (file, split, column), s in statistics.items()
        if columns.find(column) in (columns.MAG, columns.INTERFERENCE)
    ]
    table = _table(["file", "split", "column", "rows", "min nT", "max nT", "mean nT", "std nT"], rows)
    return f"{table}\n\n`{STATISTICS}` has the statistics of every column."


def _made(loaded: LoadedRecipe, manifest: Manifest) -> str:
    """Return the scenarios, their settings, and the kind of machine."""
    rows = []
    for shard in loaded.recipe.shards:
        for flight in shard.flights:
            settings = "<br>".join(f"`{text}`" for text in (*shard.set_, *flight.set_))
            rows.append([f"`{flight.name}`", f"`{flight.scenario}`", settings or "none"])
    machine = "; ".join(f"{name.replace('_', ' ')} {value}" for name, value in manifest.made_on.items())
    text = (
        "Every flight is simulated from a scenario, whose text and seed are in the file. On a machine of this kind the "
        "files equal those of the manifest in every byte; on another kind each sample is within 1e-4 nT. "
        "`magsim dataset build` checks this.\n\n"
        f"Made on: {machine}."
    )
    return f"{_table(['flight', 'scenario', 'settings'], rows)}\n\n{text}"


def _license(loaded: LoadedRecipe) -> str:
    identifier = loaded.recipe.license
    name = LICENSES.get(identifier, identifier)
    return f"[{name}]({license_url(identifier)}).\n\n```bibtex\n{citation(loaded)}\n```"
