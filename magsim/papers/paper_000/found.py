"""What the tasks of paper 000 have found, by method."""

from magsim.papers.paper import Found, Results, Task, found_of, values_of
from magsim.papers.paper_000 import worlds
from magsim.papers.paper_000.published import NETWORKS
from magsim.papers.paper_000.recipes import WHOLE
from magsim.papers.tables import counted


def trained(results: Results, network: str, world: str, output: str = "interference") -> list[Found]:
    """Return what trainings by the paper's recipe found, flight by flight."""
    return found_of(results, "train", network=network, world=world, output=output)


def of_method(results: Results, method: str, world: str, figure: str) -> tuple[float, ...]:
    """Return a figure of a network by the paper's recipe, or of a closed form, flight by flight."""
    if method in NETWORKS:
        return tuple(float(found[figure]) for found in trained(results, method, world))
    return values_of(results, figure, "judge", method=method, world=world)


def by_default(results: Results, network: str, figure: str) -> tuple[float, ...]:
    """Return a figure of a network by its own preset, Tolles-Lawson first, on the simulated flights."""
    return values_of(results, figure, "judge", method=network, world=worlds.SIMULATED)


def over(results: Results, world: str) -> str:
    """Return what the values of a cell are."""
    count = len(of_method(results, "none", world, f"ir {worlds.JUDGED[world][0]}"))
    return counted(count, "flights" if world == worlds.SIMULATED else "sets of lines")


def task_of(results: Results, network: str) -> Task:
    """Return a training of a network by the paper's recipe."""
    return next(task for task, _ in results if task.work == "train" and task.params["network"] == network)


def share_of_recipe(results: Results, network: str) -> float:
    """Return the share of the paper's windows that a network was trained on."""
    params = task_of(results, network).params
    return float(params["batch"] * params["steps"] / WHOLE.windows)


def recipe_in_words(results: Results, network: str) -> str:
    """Return how a network was trained, beside the paper's recipe."""
    params = task_of(results, network).params
    share = share_of_recipe(results, network)
    size = "small" if params["small"] else "paper's size"
    part = "as the paper has it" if share == 1.0 else f"{share:.2%} of the paper's {WHOLE.windows:,}"
    return f"{size}, {params['batch'] * params['steps']:,} windows in batches of {params['batch']}, {part}"
