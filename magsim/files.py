"""Reading of files that users name, with one set of error messages."""

from pathlib import Path

from magsim.errors import RequestError


def first_bytes(path: Path, most_bytes: int, *, kind: str, source: str | None = None) -> bytes:
    """Return the bytes of a regular file, up to a limit.

    Parameters
    ----------
    path : Path
    most_bytes : int
        Limit. To read a whole file of a bounded size, ask for one byte more than is allowed and check the length.
    kind : str
        Kind of file that was expected, with its article, for the message about a folder.
    source : str, optional
        Name of the file in messages; by default its path.

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
