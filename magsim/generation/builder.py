"""Building of a data set: fly its recipe, write its files, and compare them with its manifest."""

import hashlib
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from magsim import assets
from magsim.dataset import MANIFEST, Manifest, read_manifest
from magsim.errors import DataError, MagsimError, RequestError
from magsim.generation.comparison import Agreement, Reference, compare, reference_of
from magsim.generation.description import samples, statistics
from magsim.generation.description.card import CARD, card
from magsim.generation.description.contents import Contents, contents_of
from magsim.generation.description.croissant import CROISSANT, croissant
from magsim.generation.description.samples import SAMPLES
from magsim.generation.description.statistics import STATISTICS, Statistics
from magsim.generation.flying import write_shards
from magsim.generation.recipe import LoadedRecipe, RecipeTask
from magsim.recording import Recording
from magsim.storage import atomic_folder, atomic_text, check_folder_target
from magsim.storage.machine import fingerprint

DESCRIBING = (MANIFEST, STATISTICS, CARD, CROISSANT)
"""Files beside the recordings in the folder of a built data set."""


def build(
    loaded: LoadedRecipe,
    target: Path,
    *,
    jobs: int = 1,
    force: bool = False,
    renew: bool = False,
    progress: Callable[[str], None] = lambda _line: None,
) -> Agreement:
    """Generate a data set into a folder, completely or not at all.

    Parameters
    ----------
    loaded : LoadedRecipe
    target : Path
        The folder; its parents are made.
    jobs : int
        Processes that fly; the files do not depend on it.
    force : bool
        Replace an existing data set. A folder with anything else in it is never replaced.
    renew : bool
        Write a new manifest and everything that belongs to it into the folder of the recipe, instead of comparing.
    progress : callable
        Called with one line after each flight.

    Returns
    -------
    Agreement
        Agreement with the manifest.

    Raises
    ------
    RequestError
        If it cannot be written, or the recipe is part of an installed package.
    DataError
        If a flight fails, or the result differs from the manifest. Nothing is written then.
    """
    target = Path(target).absolute()
    if renew:
        check_renewable(loaded.folder)
    reference = None if renew else reference_of(loaded.name, loaded.folder)
    if reference is not None:
        check_recipe(loaded, reference)
    _check_replaceable(target, force=force)
    check_folder_target(target, force=force)
    if reference is not None:
        _check_space(target, reference.manifest)
    agreements: list[Agreement] = []

    def write(folder: Path) -> None:
        write_shards(loaded.tasks, folder, jobs=jobs, check=_check_splits, progress=progress)
        count = reference.count if reference else loaded.recipe.samples
        found = grouped(contents_of(folder, loaded.name, fingerprint(), count), loaded)
        if reference is not None:
            agreements.append(compare(found, reference))
        write_describing(loaded, found, folder)
        if renew:
            write_describing(loaded, found, loaded.folder)
            _write(loaded.folder / SAMPLES, samples.to_text(found.samples))

    atomic_folder(target, write, force=force)
    if agreements:
        return agreements[0]
    text = f"its manifest in {loaded.folder} is new" if renew else "there is no manifest to compare with"
    return Agreement("own", text)


def grouped(contents: Contents, loaded: LoadedRecipe) -> Contents:
    """Return contents whose manifest has the groups and levels of the recipe's files."""
    shards = {f"{shard.name}.h5": shard for shard in loaded.recipe.shards}
    files = tuple(
        entry.model_copy(update={"group": shards[entry.name].group, "level": shards[entry.name].level})
        for entry in contents.manifest.files
    )
    return replace(contents, manifest=contents.manifest.model_copy(update={"files": files}))


def check_renewable(folder: Path) -> None:
    """Raise an error for a recipe in an installed package, which is never written to.

    Raises
    ------
    RequestError
        If the recipe is part of one.
    """
    if assets.ROOT.name == "_assets" and folder.resolve().is_relative_to(assets.ROOT.resolve()):
        msg = f"{folder}: is part of the installed package; --renew is for a checkout, or for a recipe of your own"
        raise RequestError(msg)


def check_recipe(loaded: LoadedRecipe, reference: Reference) -> None:
    """Raise an error if a manifest is of other flights, before any is flown.

    Raises
    ------
    DataError
        If recipe, scenarios or aircraft have changed since the manifest was made.
    """
    files = reference.manifest.files
    listed = [(entry.name, entry.group, entry.level, f.name, f.digest) for entry in files for f in entry.flights]
    shards = {shard.name: shard for shard in loaded.recipe.shards}
    wanted = [
        (f"{task.shard}.h5", shards[task.shard].group, shards[task.shard].level, task.name, task.digest)
        for task in sorted(loaded.tasks, key=lambda task: task.shard)
    ]
    if listed != wanted:
        odd = next((one for one in wanted if one not in listed), None) or next(
            one for one in listed if one not in wanted
        )
        msg = (
            f"{reference.path}: was made from another recipe, scenario or aircraft than the present ones "
            f"(flight {odd[3]}); magsim dataset build {loaded.folder} --renew makes a new one"
        )
        raise DataError(msg)


def _check_replaceable(target: Path, *, force: bool) -> None:
    """Raise an error, with force, unless the folder holds only files that a build wrote."""
    if not force or not target.is_dir():
        return
    present = sorted(path.name for path in target.iterdir())
    listed: set[str] = set()
    if MANIFEST in present:
        try:
            listed = {entry.name for entry in read_manifest(target / MANIFEST).files}
        except MagsimError:
            listed = set()
    foreign = [name for name in present if name not in {*listed, *DESCRIBING}]
    if foreign:
        shown = ", ".join(foreign[:5]) + (", ..." if len(foreign) > 5 else "")
        msg = f"{target} holds files that no build of a data set wrote: {shown}; move them away, or give another folder"
        raise RequestError(msg)


def _check_space(target: Path, manifest: Manifest) -> None:
    needed, free = manifest.size, shutil.disk_usage(target.parent).free
    if free < needed:
        msg = f"cannot write {target}: it needs {needed / 1e6:.1f} MB, and {free / 1e6:.1f} MB are free"
        raise RequestError(msg)


def _check_splits(task: RecipeTask, recording: Recording) -> None:
    splits = {word for word in ("train", "valid", "test") if recording.mask(split=word).any()}
    if splits != task.splits:
        msg = (
            f"flight {task.name}: its rows have the splits {', '.join(sorted(splits))}; the recipe states "
            f"{', '.join(sorted(task.splits))} (recording.train_circuits and valid_legs of the scenario decide)"
        )
        raise DataError(msg)


def describe(loaded: LoadedRecipe, manifest: Manifest, table: Statistics) -> dict[str, str]:
    """Return the texts of the files that describe a data set, by name: a pure function of its arguments."""
    text = statistics.to_text(table)
    digest = hashlib.sha256(text.encode()).hexdigest()
    return {
        MANIFEST: manifest.to_json(),
        STATISTICS: text,
        CARD: card(loaded, manifest, table),
        CROISSANT: croissant(loaded, manifest, table, digest),
    }


def write_describing(loaded: LoadedRecipe, found: Contents, folder: Path) -> None:
    """Write manifest, statistics, card and Croissant metadata into a folder."""
    for name, text in describe(loaded, found.manifest, found.statistics).items():
        _write(folder / name, text)


def _write(path: Path, text: str) -> None:
    atomic_text(path, text, force=True)
