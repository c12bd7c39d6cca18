"""Croissant metadata of a data set (MLCommons Croissant 1.0, JSON-LD), from its recipe, manifest and statistics.

Every file has its checksum. The rows of all flights are one set of records, with a field for each column: HDF5 has no
extraction rule of its own in Croissant, so ``column`` names the entry of ``<role>_channel``. The records of splits and
flights are in the metadata themselves, and the statistics are a table that readers of Croissant load.
"""

import json

from magsim import columns
from magsim.dataset import Manifest
from magsim.generation.description.card import CARD, citation, license_url
from magsim.generation.description.statistics import HEADER, STATISTICS, Statistics
from magsim.generation.recipe import LoadedRecipe

CROISSANT = "croissant.json"
"""Name of the file."""

CONFORMS_TO = "http://mlcommons.org/croissant/1.0"
HDF5 = "application/x-hdf5"

CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
"""The context of Croissant 1.0 as its specification prints it."""

SPLIT_URLS = {"train": "cr:TrainingSplit", "valid": "cr:ValidationSplit", "test": "cr:TestSplit"}


def croissant(loaded: LoadedRecipe, manifest: Manifest, statistics: Statistics, statistics_sha256: str) -> str:
    """Return the text of the file: the same for the same recipe, manifest and statistics.

    Parameters
    ----------
    loaded : LoadedRecipe
    manifest : Manifest
    statistics : mapping
        States which columns exist, and in which files.
    statistics_sha256 : str
        Checksum of the text of the statistics.
    """
    recipe = loaded.recipe
    whole = {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": CONFORMS_TO,
        "name": loaded.name,
        "alternateName": recipe.title,
        "description": recipe.description.strip(),
        "version": recipe.version,
        "datePublished": recipe.date.isoformat(),
        "license": license_url(recipe.license),
        "url": CARD,
        "creator": {"@type": "sc:Organization", "name": recipe.creator},
        "keywords": list(recipe.keywords),
        "citeAs": citation(loaded),
        "isLiveDataset": False,
        "distribution": _distribution(manifest, statistics_sha256),
        "recordSet": [_splits(), _flights(manifest), _rows(manifest, statistics), _statistics()],
    }
    return json.dumps({key: value for key, value in whole.items() if value != []}, indent=1) + "\n"


def _distribution(manifest: Manifest, statistics_sha256: str) -> list[dict[str, object]]:
    files: list[dict[str, object]] = [
        {
            "@type": "cr:FileObject",
            "@id": entry.name,
            "name": entry.name,
            "description": f"flights {', '.join(flight.name for flight in entry.flights)}",
            "contentUrl": entry.name,
            "contentSize": f"{entry.size} B",
            "encodingFormat": HDF5,
            "sha256": entry.sha256,
        }
        for entry in manifest.files
    ]
    table: dict[str, object] = {
        "@type": "cr:FileObject",
        "@id": STATISTICS,
        "name": STATISTICS,
        "description": "count, minimum, maximum, mean and standard deviation of every column, by file and split",
        "contentUrl": STATISTICS,
        "encodingFormat": "text/csv",
        "sha256": statistics_sha256,
    }
    flights: dict[str, object] = {
        "@type": "cr:FileSet",
        "@id": "flight-groups",
        "name": "flight-groups",
        "description": "the HDF5 groups flights/000001, flights/000002, ... of all files: one flight each",
        "containedIn": [{"@id": entry.name} for entry in manifest.files],
        "encodingFormat": HDF5,
        "includes": "flights/*",
    }
    return [*files, flights, table]


def _field(record_set: str, name: str, data_type: str, description: str, **more: object) -> dict[str, object]:
    return {
        "@type": "cr:Field",
        "@id": f"{record_set}/{name}",
        "name": name,
        "description": description,
        "dataType": data_type,
        **more,
    }


def _splits() -> dict[str, object]:
    codes = {word: code for code, word in columns.SPLITS.items()}
    return {
        "@type": "cr:RecordSet",
        "@id": "splits",
        "name": "splits",
        "description": "purpose of the rows",
        "dataType": "cr:Split",
        "key": {"@id": "splits/name"},
        "field": [
            _field("splits", "name", "sc:Text", "name of the split"),
            _field("splits", "url", "sc:URL", "its name in Croissant"),
            _field("splits", "code", "sc:Integer", "value of the column split"),
        ],
        "data": [
            {"splits/name": word, "splits/url": url, "splits/code": codes[word]} for word, url in SPLIT_URLS.items()
        ],
    }


def _flights(manifest: Manifest) -> dict[str, object]:
    fields = [
        _field("flights", "name", "sc:Text", "name of the flight: attribute name of its group"),
        _field("flights", "file", "sc:Text", "file that holds it"),
        *(_field("flights", f"{word}_rows", "sc:Integer", f"rows of the split {word}") for word in SPLIT_URLS),
    ]
    data = [
        {"flights/name": flight.name, "flights/file": entry.name}
        | {f"flights/{word}_rows": flight.rows_in(word) for word in SPLIT_URLS}
        for entry in manifest.files
        for flight in entry.flights
    ]
    return {
        "@type": "cr:RecordSet",
        "@id": "flights",
        "name": "flights",
        "description": "one record for each flight",
        "key": {"@id": "flights/name"},
        "field": fields,
        "data": data,
    }


def _rows(manifest: Manifest, statistics: Statistics) -> dict[str, object]:
    """Return the records of rows, with one field for each column that any flight has."""
    files: dict[str, dict[str, None]] = {}
    for file, _, column in statistics:
        files.setdefault(column, {})[file] = None
    fields = [_row_field(columns.TIME, "time from the first recorded row, in s")]
    order = {family: place for place, family in enumerate(columns.FAMILIES)}
    for column in sorted(files, key=lambda name: order[columns.family_of(name)]):
        family = columns.family_of(column)
        text = f"{family.role}: {family.meaning}" + ("" if family.unit == "1" else f"; in {family.unit}")
        if len(files[column]) < len(manifest.files):
            text += f"; only in {', '.join(files[column])}"
        fields.append(_row_field(column, text))
    return {
        "@type": "cr:RecordSet",
        "@id": "rows",
        "name": "rows",
        "description": "one record for each row of each flight; the column split states its purpose",
        "field": fields,
    }


def _row_field(column: str, text: str) -> dict[str, object]:
    source = {"fileSet": {"@id": "flight-groups"}, "extract": {"column": column}}
    return _field("rows", column, "sc:Float", text, source=source)


def _statistics() -> dict[str, object]:
    kinds = {"rows": "sc:Integer"} | dict.fromkeys(("min", "max", "mean", "std"), "sc:Float")
    texts = {"std": "standard deviation, divided by the number of rows", "mean": "mean of the numbers, of angles too"}
    return {
        "@type": "cr:RecordSet",
        "@id": "statistics",
        "name": "statistics",
        "description": "statistics of every column",
        "field": [
            _field(
                "statistics",
                name,
                kinds.get(name, "sc:Text"),
                texts.get(name, name),
                source={"fileObject": {"@id": STATISTICS}, "extract": {"column": name}},
            )
            for name in HEADER
        ],
    }
