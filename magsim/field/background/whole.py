"""The whole background of a flight: every part that is on, at any places of a body."""

from collections.abc import Callable, Mapping
from functools import cached_property

import numpy as np

from magsim.columns import BACKGROUND
from magsim.field.background import crust, departure, main_field, swell, targets, variation
from magsim.field.background.path import BodyPlaces
from magsim.field.situation import Passage

BACKGROUNDS: Mapping[str, Callable[[Passage], Callable[[BodyPlaces], np.ndarray]]] = {
    "earth": main_field.earth,
    "departure": departure.departure,
    "crust": crust.crust,
    "target": targets.target,
    "variation": variation.variation,
    "swell": swell.swell,
}
"""What makes each part of the background: of a passage, a function from places (p,) to fields (p, n, 3) [nT] in body
axes. The names are those of ``columns.BACKGROUND``."""

CENTER = "the reference point"
"""Name in messages of the place whose background magnetizes the aircraft."""


class Background:
    """The background along one passage.

    What does not depend on places is computed once; so are fields at places that are asked for again. Fields are the
    same to the last bit whatever was asked for before.

    Parameters
    ----------
    passage : Passage
    """

    def __init__(self, passage: Passage) -> None:
        self.passage = passage
        self.names = tuple(name for name in BACKGROUND if name in BACKGROUNDS and passage.scenario.field.is_on(name))
        self._parts: dict[str, Callable[[BodyPlaces], np.ndarray]] = {}
        self._known: dict[str, dict[tuple[float, bytes], np.ndarray]] = {}

    def at(self, arms_b: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return every part at some places of the body.

        Parameters
        ----------
        arms_b : mapping of str to (3,) [m]
            By name, from the reference point, body axes.

        Returns
        -------
        dict of str to (p, n, 3) [nT]
            By the name of the part, body axes.

        Raises
        ------
        DataError
            If the flight leaves what a part is defined for.
        """
        places = BodyPlaces.of(arms_b)
        return {name: self._part(name)(places) for name in self.names}

    @cached_property
    def center(self) -> np.ndarray:
        """The whole background at the reference point, (n, 3) [nT] body axes."""
        places = BodyPlaces.of({CENTER: np.zeros(3)})
        out = np.zeros((len(self.passage.time_s), 3))
        for name in self.names:
            out += self._part(name)(places)[0]
        return out

    def at_mounts(self, arms_b: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the same as ``at``, and keep it: places of the call before are not computed again."""
        places = BodyPlaces.of(arms_b)
        shape = (len(arms_b), len(self.passage.time_s), 3)
        return {name: np.array(self._kept(name, places)).reshape(shape) for name in self.names}

    def _part(self, name: str) -> Callable[[BodyPlaces], np.ndarray]:
        """Return the function from places to a part."""
        if name not in self._parts:
            self._parts[name] = BACKGROUNDS[name](self.passage)
        return self._parts[name]

    def _kept(self, name: str, places: BodyPlaces) -> list[np.ndarray]:
        """Return a part at some places, (n, 3) each: what is known, or computed and kept until places change."""
        known = self._known.get(name, {})
        keys = [(places.reach_m, arm_b.tobytes()) for arm_b in places.arms_b]
        missing = [p for p, key in enumerate(keys) if key not in known]
        if missing:
            found = dict(zip(missing, self._part(name)(places.some(missing)), strict=True))
            known = {key: found[p] if p in found else known[key] for p, key in enumerate(keys)}
            self._known[name] = known
        return [known[key] for key in keys]
