"""The two ways in which a user's wish can fail, each with its exit code."""


class MagsimError(Exception):
    """A failure that is told in plain words, without a traceback.

    The text is one or more complete lines; each names what and where, and what is allowed.
    """

    exit_code = 1


class RequestError(MagsimError):
    """What was asked cannot be done: a scenario, an option, a path that is not there."""

    exit_code = 2


class DataError(MagsimError):
    """What was met is bad: a broken file, a flight that diverged."""

    exit_code = 3
