"""The folder of a sweep: which sweep it is of, and what is written into it beside the recordings."""

import json
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from magsim.config import Strict
from magsim.dataset import MANIFEST
from magsim.dataset.parquet import INDEX
from magsim.errors import DataError, RequestError
from magsim.files import first_bytes
from magsim.storage import atomic_text, check_folder_target
from magsim.sweep.journal import JOURNAL, Journal
from magsim.sweep.plan import SweepPlan
from magsim.sweep.report import REPORT

STATE = "sweep.json"
"""What sweep a folder is of."""

COPY = "sweep.toml"
"""The sweep's file, as it was flown."""

MAX_BYTES = 10_000_000


class SweepState(Strict):
    """Which sweep a folder is of."""

    sweep: Literal[1] = Field(description="version of this format")
    name: str
    identity: str
    flights: int = Field(ge=1)
    overrides: Annotated[tuple[str, ...], Field(strict=False)] = ()


def open_folder(plan: SweepPlan, path: Path, *, resume: bool = False, shared: bool = False) -> Journal:
    """Make the folder of a sweep, or go on in it.

    Parameters
    ----------
    plan : SweepPlan
    path : Path
    resume : bool
        Go on with what an earlier run left; a new folder is all right too.
    shared : bool
        Other parts of the same sweep may have made the folder, and may be flying.

    Returns
    -------
    Journal
        Of the folder, for ``run`` and ``finish``.

    Raises
    ------
    RequestError
        If it cannot be written, holds something else, or exists and neither ``resume`` nor ``shared`` is set.
    DataError
        If it is of another sweep, another version, or of more flights.
    """
    path = Path(path).absolute()
    state = _read_state(path)
    if state is None:
        if path.is_dir() and any(path.iterdir()) and not _is_begun(path):
            msg = f"{path} holds something else than a sweep; allowed: a new or empty folder"
            raise RequestError(msg)
        if not _is_begun(path):
            check_folder_target(path)
        path.mkdir(parents=True, exist_ok=True)
    elif not (resume or shared):
        msg = f"{path} holds a sweep already; --resume goes on with it"
        raise RequestError(msg)
    else:
        _check_state(plan, state, path)
    if state is not None and state.flights < plan.space.count:
        # what told of fewer flights follows again at the end
        for name in (INDEX, MANIFEST, REPORT):
            (path / name).unlink(missing_ok=True)
    journal = Journal(path)
    journal.make()
    atomic_text(path / COPY, plan.file.text, force=True)
    wanted = SweepState(
        sweep=1,
        name=plan.file.name,
        identity=plan.identity,
        flights=plan.space.count,
        overrides=plan.file.overrides,
    )
    if state != wanted:
        atomic_text(path / STATE, json.dumps(wanted.model_dump(mode="json"), indent=1) + "\n", force=True)
    return journal


def _is_begun(path: Path) -> bool:
    """Whether a folder holds nothing but what the beginning of a sweep writes before its state."""
    if not path.is_dir():
        return False
    visible = {entry.name for entry in path.iterdir() if not entry.name.startswith(".")}
    return bool(visible) and visible <= {COPY, JOURNAL}


def _read_state(path: Path) -> SweepState | None:
    """Return which sweep a folder is of; None for a folder that is of none.

    Raises
    ------
    DataError
        If it says so in a form that cannot be understood.
    """
    if not (path / STATE).is_file():
        return None
    try:
        return SweepState.model_validate_json(first_bytes(path / STATE, MAX_BYTES, kind="the state of a sweep"))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = "".join(f"{part}: " for part in first["loc"])
        msg = f"{path / STATE}: is no state of a sweep: {where}{first['msg']}; allowed: as magsim sweep writes it"
        raise DataError(msg) from None


def _check_state(plan: SweepPlan, state: SweepState, path: Path) -> None:
    if state.identity != plan.identity:
        msg = (
            f"{path}: was begun with another sweep file, scenario, aircraft or version of magsim than the present "
            f"ones; allowed: the same, which {path / COPY} shows, or another folder"
        )
        raise DataError(msg)
    if state.flights > plan.space.count:
        msg = (
            f"{path}: was begun with {state.flights} flights, not {plan.space.count}; allowed: as many, or more, "
            "or another folder"
        )
        raise DataError(msg)
