"""The shipped data sets: the files beside their recipes belong to them, and are up to date."""

import hashlib
import json

import numpy as np
import pytest

from magsim import assets, columns
from magsim.cli import main
from magsim.dataset import MANIFEST, read_manifest
from magsim.generation import load_recipe
from magsim.generation.builder import check_recipe, describe
from magsim.generation.comparison import Reference
from magsim.generation.description import statistics
from magsim.generation.description.samples import SAMPLES
from magsim.generation.description.statistics import STATISTICS
from magsim.storage.machine import differences, fingerprint

RENEW = "run: magsim dataset build {} --renew --force"

NAMES = ("c208b_calibration",)


def test_they_are_listed(capsys):
    assert assets.list_datasets() == NAMES
    assert main(["dataset", "list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split() == ["name", "MB", "files", "flights", "title"]
    assert [line.split()[0] for line in lines[2:]] == list(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_manifests_are_of_the_present_recipes_scenarios_and_aircraft(name):
    loaded = load_recipe(name)
    reference = Reference.read(loaded.folder)
    check_recipe(loaded, reference)
    assert (loaded.folder / SAMPLES).stat().st_size < 400_000
    for flight in reference.manifest.flights.values():
        assert sum(flight.splits.values()) == flight.rows
    for task in loaded.tasks:
        assert set(reference.manifest.flights[task.name].splits) == task.splits


@pytest.mark.parametrize("name", NAMES)
def test_descriptions_are_those_of_recipe_and_manifest(name):
    loaded = load_recipe(name)
    manifest, table = read_manifest(loaded.folder / MANIFEST), statistics.read(loaded.folder / STATISTICS)
    for file, text in describe(loaded, manifest, table).items():
        assert (loaded.folder / file).read_text(encoding="utf-8") == text, f"{file}: {RENEW.format(name)}"
    card = (loaded.folder / "README.md").read_text(encoding="utf-8")
    assert "license: cc-by-4.0" in card
    assert "Creative Commons Attribution 4.0 International" in card


@pytest.mark.parametrize("name", NAMES)
def test_a_manifest_states_the_kind_of_machine_and_nothing_private(name):
    """One that was made before a library was added to the fingerprint lacks that: it is of another kind of machine."""
    manifest = read_manifest(assets.dataset_dir(name) / MANIFEST)
    kind = fingerprint()
    assert {"magsim", "system", "processor", "processor_features", "blas", "libc", "python"} <= set(manifest.made_on)
    assert set(manifest.made_on) <= set(kind)
    lacking = set(kind) - set(manifest.made_on)
    text = "; ".join(differences(kind, manifest.made_on))
    assert all(f"{key} {kind[key]}, not unknown" in text for key in lacking)
    assert not any("/" in value for value in manifest.made_on.values())


@pytest.mark.parametrize("name", NAMES)
def test_croissant_is_read_by_mlcroissant(name):
    import mlcroissant

    folder = assets.dataset_dir(name)
    manifest = read_manifest(folder / MANIFEST)
    dataset = mlcroissant.Dataset(jsonld=folder / "croissant.json")
    metadata = dataset.metadata
    assert not metadata.issues.errors
    assert not metadata.issues.warnings
    assert metadata.name == name
    files = {item.id: item.sha256 for item in metadata.distribution if getattr(item, "sha256", None)}
    digest = hashlib.sha256((folder / STATISTICS).read_bytes()).hexdigest()
    assert files == {entry.name: entry.sha256 for entry in manifest.files} | {STATISTICS: digest}
    splits = {record["splits/name"]: record["splits/code"] for record in dataset.records("splits")}
    assert splits == {word: code for code, word in columns.SPLITS.items()}
    flights = {record["flights/name"]: record["flights/test_rows"] for record in dataset.records("flights")}
    assert flights == {flight.name: flight.splits.get("test", 0) for flight in manifest.flights.values()}
    (rows,) = (record_set for record_set in metadata.record_sets if record_set.id == "rows")
    fields = {field.name for field in rows.fields}
    assert fields == {columns.TIME, *(column for _, _, column in statistics.read(folder / STATISTICS))}
    record = next(iter(dataset.records("statistics")))
    assert record["statistics/column"] == b"mag_cabin_nt"
    assert np.isfinite(record["statistics/std"])


def test_croissant_has_the_properties_that_its_specification_requires():
    text = (assets.dataset_dir("c208b_calibration") / "croissant.json").read_text(encoding="utf-8")
    whole = json.loads(text)
    required = {"@context", "@type", "conformsTo", "name", "description", "license", "url", "creator", "datePublished"}
    assert required <= set(whole)
    assert whole["conformsTo"] == "http://mlcommons.org/croissant/1.0"
    assert "CC-BY-4.0" in whole["license"]
