"""Patterns of legs and turns as a path in a plane that touches the ellipsoid at the start.

A path is a row of elements (``magsim.flight.path.elements``): straight legs, the turns between them, and transits
between patterns.
"""

import math

from magsim.errors import RequestError
from magsim.flight.path.dubins import connect
from magsim.flight.path.elements import (
    Arc,
    Element,
    PathLabel,
    PathPoint,
    Straight,
    TurnShape,
    turn_radius,
    turn_shape,
)
from magsim.scenario import (
    Cloverleaf,
    HeadingCross,
    LegPattern,
    PatternSequence,
    Square,
    SurveyPattern,
    key_of,
    parts_of,
)


class _Pen:
    """Draws a path element by element.

    Parameters
    ----------
    start : PathPoint
    side : int
        1 for turns to the right, -1 to the left.
    shape : TurnShape
        Of quarter turns.
    """

    def __init__(self, start: PathPoint, side: int, shape: TurnShape) -> None:
        self.place, self.side, self.shape = start, side, shape
        self.elements: list[Element] = []

    def straight(self, length_m: float, label: PathLabel) -> None:
        """Draw a straight on the course of the pen."""
        if length_m > 0.0:
            self._add(Straight(label, self.place, length_m))

    def turn(self, label: PathLabel) -> None:
        """Draw a quarter turn."""
        self._add(Arc(label, self.place, self.side, self.shape))

    def to(self, place: PathPoint, label: PathLabel) -> None:
        """Draw the shortest path to another point and course."""
        self.elements += connect(self.place, place, self.shape.radius_m, self.shape.ease_m, label)
        self.place = place

    def _add(self, element: Element) -> None:
        self.elements.append(element)
        self.place = element.at(element.length_m)


def _compass(degrees: float) -> float:
    """Return a heading in [0, 360) without the rounding of turned angles."""
    return round(degrees, 9) % 360.0


def path_of(
    pattern: LegPattern | PatternSequence, heading_deg: float, ground_speed_mps: float, ease_s: float
) -> tuple[Element, ...]:
    """Draw a pattern, or a sequence of them, around the plane's origin.

    Parameters
    ----------
    pattern : LegPattern or PatternSequence
    heading_deg : float
        Course of the first leg, clockwise from north, of a pattern that sets none itself.
    ground_speed_mps : float
        Largest speed over ground that any course will have: it sets the radius, so that no turn needs more than the
        planned bank.
    ease_s : float
        Time in which a turn's bank is established.

    Returns
    -------
    tuple of Element
        A square begins at its origin with its first leg and ends there with its last turn. A straight begins at its
        origin. Cloverleaf and heading cross pass it in the middle of each leg and end with the last one. The origin
        is the plane's, moved by the pattern's ``north_m`` and ``east_m``.

    Raises
    ------
    RequestError
        If the turns do not fit into the leaves.
    """
    elements: list[Element] = []
    circuits = 0
    for number, part in enumerate(parts_of(pattern)):
        shape = turn_shape(turn_radius(ground_speed_mps, part.bank_deg), ground_speed_mps * ease_s)
        heading = heading_deg if part.heading_deg is None else part.heading_deg
        label = PathLabel(circuits, 0, False, heading, part=number)
        _check_leaf(part, shape, key_of(pattern, number))
        drawn = _draw(part, heading, shape, label, part.lead_s * ground_speed_mps)
        if elements:
            last = elements[-1]
            label = last.label._replace(turn=True, transit=True)
            elements += connect(
                last.at(last.length_m), drawn[0].at(0.0), shape.radius_m, ground_speed_mps * ease_s, label
            )
        elements += drawn
        circuits += part.circuits
    return tuple(elements)


def _draw(part: LegPattern, heading_deg: float, shape: TurnShape, base: PathLabel, lead_m: float) -> list[Element]:
    """Draw one pattern; ``base`` counts the circuits before it.

    ``lead_m`` is the distance that the fastest flight covers in the pattern's lead time.
    """
    side = 1 if part.turn == "right" else -1
    origin = PathPoint(part.north_m, part.east_m, math.radians(heading_deg), 0.0)
    if isinstance(part, Square):
        return _square(part, _Pen(origin, side, shape), base)
    if isinstance(part, Cloverleaf):
        return _cloverleaf(part, origin, side, shape, base)
    if isinstance(part, HeadingCross):
        return _cross(part, origin, side, shape, base)
    if isinstance(part, SurveyPattern):
        return _survey(part, origin, side, shape, base, lead_m=lead_m)
    return [Straight(base._replace(circuit=base.circuit + 1, leg=1), origin, part.leg_m)]


def _square(part: Square, pen: _Pen, base: PathLabel) -> list[Element]:
    """Draw square circuits: quarter turns between adjacent sides, else the shortest path to the next side."""
    first, side = base.heading_deg, pen.side
    starts: list[PathPoint] = []
    for _ in range(4):
        starts.append(pen.place)
        pen.straight(part.leg_m, base)
        pen.turn(base)
    pen = _Pen(starts[0], side, pen.shape)
    for index in range(4 * part.circuits):
        number = part.order[index % 4] - 1
        following = part.order[(index + 1) % 4] - 1
        heading = _compass(first + 90.0 * side * number)
        label = PathLabel(base.circuit + index // 4 + 1, index % 4 + 1, False, heading, part=base.part, leg_index=index)
        pen.straight(part.leg_m, label)
        if following == (number + 1) % 4:
            pen.turn(label._replace(turn=True))
        else:
            pen.to(starts[following], label._replace(turn=True))
    return pen.elements


def _check_leaf(part: LegPattern, shape: TurnShape, key: str) -> None:
    """Check that the turns fit into the leaves; ``key`` is the pattern's in the scenario."""
    if isinstance(part, Cloverleaf) and shape.offset_m > part.leaf_m:
        msg = (
            f"{key}.leaf_m: turns of {part.bank_deg:g} deg bank with a radius of {shape.radius_m:.0f} m over ground "
            f"take {shape.offset_m:.0f} m, more than a leaf of {part.leaf_m:g} m; allowed: a leaf of at least "
            f"{math.ceil(shape.offset_m)} m, or more bank"
        )
        raise RequestError(msg)


def _cloverleaf(part: Cloverleaf, origin: PathPoint, side: int, shape: TurnShape, base: PathLabel) -> list[Element]:
    """Draw four passes over the origin, joined by square leaves."""
    leaf = part.leaf_m
    pen = _Pen(_before(origin, leaf), side, shape)
    for leg in range(4):
        heading = _compass(base.heading_deg + 270.0 * side * leg)
        label = PathLabel(base.circuit + 1, leg + 1, False, heading, part=base.part, leg_index=leg)
        pen.straight(2.0 * leaf, label)
        if leg < 3:
            _leaf(pen, leaf - shape.offset_m, label._replace(turn=True))
    return pen.elements


def _leaf(pen: _Pen, side_m: float, label: PathLabel) -> None:
    """Draw three quarter turns and two straights: from the end of a pass to the beginning of the next."""
    pen.turn(label)
    for _ in range(2):
        pen.straight(side_m, label)
        pen.turn(label)


def _cross(part: HeadingCross, origin: PathPoint, side: int, shape: TurnShape, base: PathLabel) -> list[Element]:
    """Draw passes over the origin on one heading after another."""
    headings = [_compass(base.heading_deg + side * turned) for turned in part.turned_deg]
    starts = [_before(origin._replace(course=math.radians(heading)), 0.5 * part.leg_m) for heading in headings]
    pen, count = _Pen(starts[0], side, shape), len(headings)
    for index in range(count * part.circuits):
        leg = index % count
        label = PathLabel(
            base.circuit + index // count + 1, leg + 1, False, headings[leg], part=base.part, leg_index=index
        )
        if index:
            last = pen.elements[-1].label
            pen.to(starts[leg], last._replace(turn=True))
        pen.straight(part.leg_m, label)
    return pen.elements


def _survey(
    part: SurveyPattern, origin: PathPoint, side: int, shape: TurnShape, base: PathLabel, *, lead_m: float
) -> list[Element]:
    """Draw lines to and fro, then tie lines to and fro across them, beginning where the last line ended."""

    def leg(along_m: float, aside_m: float, turned: float) -> PathPoint:
        sin, cos, aside = math.sin(origin.course), math.cos(origin.course), side * aside_m
        north, east = origin.north_m + along_m * cos - aside * sin, origin.east_m + along_m * sin + aside * cos
        return PathPoint(north, east, origin.course + side * turned, 0.0)

    half, width = 0.5 * math.pi, (part.lines - 1) * part.spacing_m
    legs = [
        (1, i, 180.0 * (i % 2), part.line_m, leg(part.line_m * (i % 2), i * part.spacing_m, 2.0 * half * (i % 2)))
        for i in range(part.lines)
    ]
    first = 0.5 * (part.line_m - (part.ties - 1) * part.tie_spacing_m)
    far_end = part.lines % 2 == 1
    for i in range(part.ties):
        along = first + (part.ties - 1 - i if far_end else i) * part.tie_spacing_m
        back = i % 2 == 0  # the last line is the one that lies farthest aside
        start = leg(along, width + part.tie_overlap_m if back else -part.tie_overlap_m, 3.0 * half if back else half)
        legs.append((2, i, 270.0 if back else 90.0, part.tie_m, start))
    elements: list[Element] = []
    for index, (circuit, i, turned, length, start) in enumerate(legs):
        if elements:
            last, before = elements[-1], _before(start, lead_m)
            label = last.label._replace(turn=True)
            elements += connect(last.at(last.length_m), before, shape.radius_m, shape.ease_m, label)
            if lead_m > 0.0:
                elements.append(Straight(label, before, lead_m))
        heading = _compass(base.heading_deg + side * turned)
        label = PathLabel(base.circuit + circuit, i + 1, False, heading, part=base.part, leg_index=index)
        elements.append(Straight(label, start, length))
    return elements


def _before(place: PathPoint, distance_m: float) -> PathPoint:
    """Return the point at a distance before another one, on its course."""
    north, east, course, _ = place
    return PathPoint(north - distance_m * math.cos(course), east - distance_m * math.sin(course), course, 0.0)
