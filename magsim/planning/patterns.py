"""Checks of a pattern with the start and the aircraft that fly it."""

from collections.abc import Iterator

from magsim.aircraft import Aircraft
from magsim.planning.legs import check_fit
from magsim.planning.loads import check_loads
from magsim.scenario import LegPattern, PatternSequence, Start, SurveyPattern, TrackPattern, parts_of


def heights_of(pattern: LegPattern | PatternSequence, start: Start) -> tuple[float, ...]:
    """Return the heights of the level parts of a flight, with that of the start [m]."""
    heights = [part.height_m(start.alt_m) for part in parts_of(pattern)]
    return (start.alt_m, *(height for height in heights if height is not None))


def check_pattern(
    pattern: LegPattern | PatternSequence, start: Start, aircraft: Aircraft | None
) -> Iterator[tuple[str, str]]:
    """Yield the problems of a pattern: key within it, and text."""
    for number, part in enumerate(parts_of(pattern)):
        prefix = f"parts[{number}]." if isinstance(pattern, PatternSequence) else ""
        if not number and part.alt_m not in (None, start.alt_m):
            text = f"{part.alt_m:g} m, but the flight begins with this pattern; allowed: start.alt_m, {start.alt_m:g}"
            yield prefix + "alt_m", text
        for check in (check_course(part, start), check_fit(part, start), check_loads(part, start, aircraft)):
            for key, text in check:
                yield prefix + key, text


def check_surveys(pattern: LegPattern | PatternSequence, *, has_ground: bool) -> Iterator[tuple[str, str]]:
    """Yield tie lines that do not cross the lines, and drapes without a ground to follow."""
    for number, part in enumerate(parts_of(pattern)):
        if not isinstance(part, SurveyPattern):
            continue
        prefix = f"parts[{number}]." if isinstance(pattern, PatternSequence) else ""
        span = (part.ties - 1) * part.tie_spacing_m
        if span > part.line_m:
            text = (
                f"{part.ties} tie lines {part.tie_spacing_m:g} m apart take {span:g} m, more than a line of "
                f"{part.line_m:g} m; allowed: fewer or closer tie lines"
            )
            yield f"{prefix}tie_spacing_m", text
        if part.ties and part.tie_m < 100.0:
            text = f"tie lines would be {part.tie_m:g} m long; allowed: at least 100, by overlap or more lines"
            yield f"{prefix}tie_overlap_m", text
        if part.drape_m is not None and not has_ground:
            yield f"{prefix}drape_m", "a drape needs the ground; allowed: with a table [terrain]"
        if part.drape_m is not None and part.alt_m is not None:
            yield f"{prefix}alt_m", "a draped survey follows the ground; allowed: drape_m or alt_m"


def check_course(pattern: LegPattern, start: Start) -> Iterator[tuple[str, str]]:
    """Yield a problem where a pattern that is named after its headings has others."""
    course = pattern.course(start)
    if pattern.courses_deg is not None:
        step, first = pattern.courses_deg
        if (course - first) % step:
            allowed = ", ".join(f"{first + i * step:g}" for i in range(round(360.0 / step)))
            text = (
                f"the first leg of a {pattern.kind} cannot have the course {course:g} deg (start.heading_deg, or "
                f"heading_deg of the pattern); allowed: {allowed}"
            )
            yield "heading_deg", text


def check_track(pattern: TrackPattern, *, has_ground: bool) -> Iterator[tuple[str, str]]:
    """Yield a problem where heights above the sea have no geoid."""
    if pattern.heights == "sea" and not has_ground:
        yield "heights", "heights above the sea need the geoid; allowed: with a table [terrain] and its geoid_m"
