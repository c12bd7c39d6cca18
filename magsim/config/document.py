"""A TOML text with overrides: read, parsed and validated, with every problem reported at its place."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from magsim.config import keys, toml
from magsim.config.overrides import Override, apply, read_override
from magsim.config.wording import Complaint, complaints
from magsim.errors import RequestError
from magsim.files import first_bytes

MAX_BYTES = 1_000_000
"""Largest configuration file that is read."""

MAX_LINES = 100
"""Most problems that are reported at once."""

M = TypeVar("M", bound=BaseModel)


@dataclass(frozen=True)
class Document:
    """A parsed configuration.

    Attributes
    ----------
    source : str
        How messages name the file.
    text : str
        The TOML text, without overrides.
    table : dict
        Its contents, overrides included.
    overrides : tuple of Override
        Those that could be applied.
    problems : tuple of str
        Lines about those that could not.
    """

    source: str
    text: str
    table: dict[str, object]
    overrides: tuple[Override, ...] = ()
    problems: tuple[str, ...] = ()

    @cached_property
    def _lines(self) -> keys.Lines:
        return keys.Lines(self.text)

    def validate(
        self,
        model: type[M],
        *,
        context: Mapping[str, object] | None = None,
        also: Sequence[tuple[str, str]] = (),
    ) -> M:
        """Return the settings as a model.

        Parameters
        ----------
        model : type
            The pydantic model.
        context : mapping, optional
            Passed to validators as ``info.context``.
        also : sequence of (str, str)
            Problems that are known already, each a key path and its text; reported in the same pass.

        Raises
        ------
        RequestError
            One line for each problem, in the order of the file.
        """
        found = [Complaint(keys.split(key) or (), text) for key, text in also]
        result = None
        try:
            result = model.model_validate(self.table, context=context)
        except ValidationError as error:
            lines_found = complaints(error, model, self.table)
            found += lines_found or [Complaint((), error.errors(include_url=False)[0]["msg"])]
            found += self._without_unknown_keys(model, context, error)
        lines = [*self.problems, *self._place(found)]
        if lines:
            raise RequestError(_joined(lines))
        assert result is not None  # else the error had a line
        return result

    def placed(self, text: str) -> str:
        """Return a message that begins with a key path with its place in the file, or its override, before it.

        Any other message is returned unchanged.
        """
        key, colon, rest = text.partition(": ")
        path = keys.split(key) if colon else None
        if path is None or path[0] not in self.table:
            return text
        return _joined(self._place([Complaint(path, rest)]))

    def _without_unknown_keys(
        self, model: type[M], context: Mapping[str, object] | None, error: ValidationError
    ) -> list[Complaint]:
        """Return the complaints of checks of several keys together, which run only without the unknown keys."""
        unknown = [e for e in error.errors(include_url=False) if e["type"] == "extra_forbidden"]
        if not unknown or len(unknown) < error.error_count():
            return []
        table = copy.deepcopy(self.table)
        for complaint in complaints(error, model, self.table):
            _remove(table, complaint.path)
        try:
            model.model_validate(table, context=context)
        except ValidationError as second:
            return complaints(second, model, table)
        return []

    def _place(self, found: Sequence[Complaint]) -> list[str]:
        """Return lines with their places: first those of the file in its order, then those of overrides."""
        placed: dict[str, tuple[int, int, int]] = {}
        for number, complaint in enumerate(found):
            path = complaint.path
            override = self._override_of(path)
            name = keys.show(path)
            if override is not None:
                where = f"--set {keys.show(override.path)}"
                rest = complaint.text if override.path == path else f"{name}: {complaint.text}"
                placed.setdefault(f"{where}: {rest}", (2**31, self.overrides.index(override), number))
                continue
            line = self._lines.of(path)
            rest = f"{name}: {complaint.text}" if name else complaint.text
            placed.setdefault(f"{self.source}:{line}: {rest}", (line, 0, number))
        return sorted(placed, key=placed.__getitem__)

    def _override_of(self, path: keys.Path) -> Override | None:
        """Return the override that made the value at a path: the last that set it, or a table around it."""
        for override in reversed(self.overrides):
            if path[: len(override.path)] == override.path:
                return override
        # a key that is not in the text belongs to an override that set something below it, or beside it in a new table
        for length in range(len(path), 0, -1):
            if path[:length] in self._lines:
                break
            for override in self.overrides:
                if override.path[:length] == path[:length]:
                    return override
        return None


def read(path: Path, *, overrides: Sequence[str] = (), source: str | None = None) -> Document:
    """Read and parse a TOML file; see ``magsim.config.load``.

    Raises
    ------
    RequestError
        If the file cannot be read, or its text or an override is no TOML.
    """
    source = source or str(path)
    return parse(read_text(path, source), overrides=overrides, source=source)


def read_text(path: Path, source: str) -> str:
    """Return the text of a configuration file, or raise a RequestError with the reason."""
    data = first_bytes(path, MAX_BYTES + 1, kind="a TOML file", source=source)
    if len(data) > MAX_BYTES:
        msg = f"{source}: is larger than {MAX_BYTES // 1_000_000} MB, so it is no settings file"
        raise RequestError(msg)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        msg = f"{source}:{line}: is not UTF-8 text (byte 0x{data[error.start]:02x}); save the file as UTF-8"
        raise RequestError(msg) from None


def parse(text: str, *, overrides: Sequence[str] = (), source: str = "<text>") -> Document:
    """Parse a TOML text and apply overrides on top of it; see ``magsim.config.load``.

    Raises
    ------
    RequestError
        If the text is no TOML, or an override is written wrong then too. Overrides that do not fit the text are
        reported by ``Document.validate``, together with everything else.
    """
    problems, settings = [], []
    for override in overrides:
        try:
            settings.append(read_override(override))
        except RequestError as error:
            problems.append(str(error))
    try:
        table = toml.loads(text)
    except ValueError as error:
        raise RequestError(_joined([toml.syntax_problem(str(error), text, source), *problems])) from None
    applied = []
    for setting in settings:
        try:
            apply(table, setting)
            applied.append(setting)
        except RequestError as error:
            problems.append(str(error))
    return Document(source, text, table, tuple(applied), tuple(problems))


def _remove(table: Any, path: keys.Path) -> None:
    """Remove a key from a table in place; the path leads through tables and lists."""
    for part in path[:-1]:
        table = table[part]
    table.pop(path[-1], None)


def _joined(lines: Sequence[str]) -> str:
    more = [f"... and {len(lines) - MAX_LINES} more problems"] if len(lines) > MAX_LINES else []
    return "\n".join([*lines[:MAX_LINES], *more])
