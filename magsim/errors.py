"""The two kinds of failure, each with its exit code."""


class MagsimError(Exception):
    """A failure that is reported to the user in plain words, without a traceback.

    The text is one or more complete lines; each names what and where, and what is allowed.
    """

    exit_code = 1


class RequestError(MagsimError):
    """A request that cannot be fulfilled: a scenario, an option, a path that does not exist."""

    exit_code = 2


class DataError(MagsimError):
    """Bad data: a damaged file, a flight that diverged."""

    exit_code = 3
