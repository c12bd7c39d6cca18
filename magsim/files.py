"""Reading a file that a user named: the one place that says why there is nothing to read."""

from pathlib import Path

from magsim.errors import RequestError


def first_bytes(path: Path, most_bytes: int, *, kind: str, source: str | None = None) -> bytes:
    """Bytes of a regular file, as many as there are up to a limit.

    Parameters
    ----------
    path : Path
    most_bytes : int
        Limit. Whoever wants the whole file asks for one byte more than is allowed and looks whether it came.
    kind : str
        What was looked for, with its article, for the message about a folder.
    source : str, optional
        What the messages call the file; its path without.

    Raises
    ------
    RequestError
        If there is no such file, it is no regular file or cannot be read. Pipes and devices are not opened.
    """
    source = source or str(path)
    try:
        if path.is_dir():
            msg = f"{source}: is a folder, not {kind}"
            raise RequestError(msg)
        if path.exists() and not path.is_file():
            msg = f"{source}: is not a regular file"
            raise RequestError(msg)
        with path.open("rb") as file:
            return file.read(most_bytes)
    except FileNotFoundError:
        msg = f"{source}: there is no such file"
        raise RequestError(msg) from None
    except (OSError, ValueError) as error:
        msg = f"{source}: cannot be read: {getattr(error, 'strerror', None) or error}"
        raise RequestError(msg) from None
