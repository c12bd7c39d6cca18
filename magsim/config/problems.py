"""The error that validators raise for several problems, or for one at another key."""


class Problems(ValueError):
    """Several problems at once, each with the key that it belongs to.

    A model validator raises it to name keys below the model, so that messages find their line.

    Parameters
    ----------
    found : tuple of (str, str)
        Key path relative to the model, ``"maneuvers[0].period_s"`` (``""`` for the model itself), and what is
        wrong and what is allowed.
    """

    def __init__(self, *found: tuple[str, str]) -> None:
        super().__init__("; ".join(f"{key}: {text}" if key else text for key, text in found))
        self.found = found
