"""Key paths: their parts, how they are written, and where in a TOML text they stand."""

import json
import re
from bisect import bisect_right

Path = tuple[str | int, ...]
"""Parts of a key path: names of tables and keys, and indices of lists."""

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_PART = re.compile(r"""(?P<key>[A-Za-z0-9_-]+|"(?:[^"\\]|\\.)*"|'[^']*')|\[(?P<index>\d{1,9})\]""")

_BASIC = re.compile(r'"(?:[^"\\]++|\\.)*+"')
_LITERAL = re.compile(r"'[^']*'")
_LONG_BASIC = re.compile(r'"""(?:[^"\\]++|\\.|"{1,2}(?!"))*+"{3,5}', re.DOTALL)
_LONG_LITERAL = re.compile(r"'''(?:[^']++|'{1,2}(?!'))*+'{3,5}")
_SCALAR = re.compile(r"[^,\]}\n#]*")
_SPACE = re.compile(r"[ \t]*")
_SPACE_LINES = re.compile(r"(?:[ \t\n]++|#[^\n]*+)*+")


def show(path: Path) -> str:
    """Return a key path as people write it: ``pattern.maneuvers[1].amplitude_deg``."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            name = part if _BARE.fullmatch(part) else json.dumps(part, ensure_ascii=False)
            text += f".{name}" if text else name
    return text


def split(text: str) -> Path | None:
    """Return the parts of a written key path, or None where it is none."""
    parts: list[str | int] = []
    position = 0
    text = text.strip()
    while position < len(text):
        if parts and text[position] == ".":
            position += 1
            dotted = True
        else:
            dotted = not parts
        found = _PART.match(text, position)
        if found is None or dotted == (found["key"] is None):
            return None
        if found["key"] is None:
            parts.append(int(found["index"]))
        else:
            parts.append(_unquote(found["key"]))
        position = found.end()
    return tuple(parts) or None


def _unquote(key: str) -> str:
    if key.startswith('"'):
        try:
            return str(json.loads(key))
        except ValueError:
            return key[1:-1]
    return key[1:-1] if key.startswith("'") else key


class Lines:
    """Line of every key of a TOML text that tomllib has accepted.

    Knows tables, arrays of tables, dotted keys, inline tables, arrays and all four kinds of strings. The text
    is known to be right, so anything but keys only needs to be stepped over.
    """

    def __init__(self, text: str) -> None:
        # tomllib counts lines by "\n" after it has replaced "\r\n"
        self._text = text.replace("\r\n", "\n")
        self._starts = [0, *(found.end() for found in re.finditer("\n", self._text))]
        self._position = 0
        self._lines: dict[Path, int] = {}
        self._tables: dict[Path, int] = {}
        self._scan()

    def of(self, path: Path) -> int:
        """Return the line of a key, from 1; that of the nearest table around a key that the text lacks."""
        for length in range(len(path), 0, -1):
            if path[:length] in self._lines:
                return self._lines[path[:length]]
        return 1

    def __contains__(self, path: object) -> bool:
        return path in self._lines

    def _note(self, path: Path, position: int) -> None:
        line = bisect_right(self._starts, position)
        for length in range(1, len(path) + 1):
            self._lines.setdefault(path[:length], line)

    def _scan(self) -> None:
        table: Path = ()
        while True:
            self._skip(newlines=True)
            if self._position >= len(self._text):
                return
            start = self._position
            if self._text.startswith("[[", start):
                self._position += 2
                table = self._resolve(self._key())
                self._tables[table] = self._tables.get(table, -1) + 1
                table = (*table, self._tables[table])
                self._note(table, start)
                self._position = self._text.index("]]", self._position) + 2
            elif self._text[start] == "[":
                self._position += 1
                table = self._resolve(self._key())
                self._note(table, start)
                # a table that was made by a key of a sub-table gets its own line now
                self._lines[table] = bisect_right(self._starts, start)
                self._position = self._text.index("]", self._position) + 1
            else:
                self._pair(table)

    def _resolve(self, key: Path) -> Path:
        """Return the path of a table's header: names of arrays of tables stand for their last element."""
        path: Path = ()
        for i, part in enumerate(key):
            path = (*path, part)
            if i < len(key) - 1 and path in self._tables:
                path = (*path, self._tables[path])
        return path

    def _pair(self, table: Path) -> None:
        start = self._position
        path = (*table, *self._key())
        self._note(path, start)
        self._skip()
        self._position += 1  # "="
        self._value(path)

    def _key(self) -> Path:
        parts: list[str] = []
        while True:
            self._skip()
            start = self._position
            if self._text[start] in "\"'":
                self._string()
                parts.append(_unquote(self._text[start : self._position]))
            else:
                found = _BARE.match(self._text, start)
                assert found is not None  # tomllib has read this text
                parts.append(found[0])
                self._position = found.end()
            self._skip()
            if self._text[self._position] != ".":
                return tuple(parts)
            self._position += 1

    def _value(self, path: Path) -> None:
        self._skip()
        first = self._text[self._position]
        if first in "\"'":
            self._string()
        elif first == "[":
            self._array(path)
        elif first == "{":
            self._inline_table(path)
        else:
            found = _SCALAR.match(self._text, self._position)
            assert found is not None  # matches the empty text too
            self._position = found.end()

    def _array(self, path: Path) -> None:
        self._position += 1
        index = 0
        while True:
            self._skip(newlines=True)
            if self._text[self._position] == "]":
                self._position += 1
                return
            if self._text[self._position] == ",":
                self._position += 1
                continue
            self._note((*path, index), self._position)
            self._value((*path, index))
            index += 1

    def _inline_table(self, path: Path) -> None:
        self._position += 1
        while True:
            self._skip(newlines=True)
            if self._text[self._position] == "}":
                self._position += 1
                return
            if self._text[self._position] == ",":
                self._position += 1
                continue
            self._pair(path)

    def _string(self) -> None:
        quote = self._text[self._position]
        if self._text.startswith(quote * 3, self._position):
            pattern = _LONG_BASIC if quote == '"' else _LONG_LITERAL
        else:
            pattern = _BASIC if quote == '"' else _LITERAL
        found = pattern.match(self._text, self._position)
        assert found is not None  # tomllib has read this text
        self._position = found.end()

    def _skip(self, *, newlines: bool = False) -> None:
        found = (_SPACE_LINES if newlines else _SPACE).match(self._text, self._position)
        assert found is not None  # matches the empty text too
        self._position = found.end()
