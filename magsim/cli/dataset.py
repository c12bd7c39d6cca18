"""``magsim dataset``: data sets and their recipes."""

from pathlib import Path

import click


@click.group(short_help="Build and check data sets.")
def dataset() -> None:
    """Build data sets from their recipes, and check them."""


@dataset.command(name="list", short_help="List the shipped data sets.")
def list_() -> None:
    """List the shipped data sets: name, size, flights, title."""
    from magsim import assets
    from magsim.cli.info import TitledTable, show
    from magsim.dataset import MANIFEST, read_manifest
    from magsim.generation import load_recipe

    rows = []
    for name in assets.list_datasets():
        loaded = load_recipe(name)
        manifest = read_manifest(loaded.folder / MANIFEST)
        size = f"{manifest.size / 1e6:.1f}"
        rows.append((name, size, str(len(manifest.files)), str(len(manifest.flights)), loaded.recipe.title))
    show([TitledTable("Data sets", ("name", "MB", "files", "flights", "title"), tuple(rows))])


@dataset.command(short_help="Fly a data set from its recipe.")
@click.argument("name")
@click.option("-o", "--output", metavar="FOLDER", type=click.Path(path_type=Path), help="Where; default ./data/<name>")
@click.option("-j", "--jobs", type=click.IntRange(1, 1000), default=1, show_default=True, help="Processes that fly.")
@click.option("--renew", is_flag=True, help="Write a new manifest for the recipe instead of comparing.")
@click.option("--force", is_flag=True, help="Replace an existing data set.")
@click.option("-q", "--quiet", is_flag=True, help="Show no progress.")
def build(  # noqa: PLR0917 - the options
    name: str, output: Path | None, jobs: int, renew: bool, force: bool, quiet: bool
) -> None:
    """Fly the recipe of data set NAME, write its files, and compare them with its manifest.

    NAME is c208b_calibration, or the path of a folder of your own with a recipe.toml: ./mine. On the kind
    of machine that made the manifest the files must be the same in every byte, on another kind within 1e-4 nT; the last
    line states which of the two applies. Otherwise the exit code is 3, and nothing is written.
    """
    from magsim.cli.interrupts import delayed

    with delayed():
        from magsim import generation

    progress = (lambda _text: None) if quiet else (lambda text: click.echo(text, err=True))
    loaded = generation.load_recipe(name)
    target = output or Path("data") / loaded.name
    agreement = generation.build(loaded, target, jobs=jobs, force=force, renew=renew, progress=progress)
    click.echo(f"{target}: {agreement.text}")


@dataset.command(short_help="Check the files of a data set.")
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--recipe", metavar="NAME|PATH", help="Recipe to compare with; default the shipped one of its name.")
@click.option("-q", "--quiet", is_flag=True, help="Show no progress.")
def check(folder: Path, recipe: str | None, quiet: bool) -> None:
    """Check the files of FOLDER against their checksums and against the manifest or the index of their data set.

    The exit code is 0 if all is right, else 3, with a line for each difference.
    """
    from magsim import assets
    from magsim.dataset import MANIFEST, Dataset, index_differences, parquet
    from magsim.errors import DataError
    from magsim.generation import check_folder, reference_of

    if parquet.is_there(folder):
        lines = index_differences(folder, None if quiet else lambda text: click.echo(text, err=True))
        if lines:
            raise DataError("\n".join(lines))
        if not (folder / MANIFEST).is_file():
            count = len(Dataset(folder))
            click.echo(f"{folder}: as {parquet.INDEX} lists it: {count} flights; there is no recipe to compare with")
            return
    name = Dataset(folder).manifest.dataset
    known = name in assets.list_datasets()
    place = assets.dataset_dir(recipe or name) if recipe or known else None
    agreement = check_folder(folder, reference_of(name, place))
    click.echo(f"{folder}: {agreement.text}")
