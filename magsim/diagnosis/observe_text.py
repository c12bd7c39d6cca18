"""Observability as people and programs read it."""

import json
from dataclasses import asdict

from magsim.compensation.observability import LEAST_ANGLE_DEG
from magsim.diagnosis.maneuvers import AMPLITUDES_DEG, PERIOD_S
from magsim.diagnosis.observe import Observability


def to_json(found: Observability) -> str:
    """Return the whole as JSON: the same bytes for the same flight."""
    whole = asdict(found)
    whole["observable"] = found.is_observable
    whole["noise"] = found.noise._asdict()
    whole["columns"] = [column._asdict() for column in found.columns]
    whole["advice"] = [advice._asdict() for advice in found.advice]
    return json.dumps(whole, indent=1, allow_nan=False) + "\n"


def to_text(found: Observability) -> str:
    """Return the whole as lines of text."""
    rows = f"{found.rows} rows in band that count as {found.effective_rows:.0f}"
    lines = [
        f"{', '.join(found.recordings)}: {found.minutes:.1f} min, {rows}",
        f"magnetometer {found.sensor}, fluxgate {found.fluxgate}, inclination {found.inclination_deg:.0f} deg",
        f"the field sweeps {found.angle_deg:.1f} deg in the axes of the aircraft; a fit needs {LEAST_ANGLE_DEG:g}",
        f"noise of the reading in band: {found.noise.std_nt:.4g} nT ({found.noise.source})",
    ]
    if found.columns:
        lines += ["", *_table(found), "", *_line(found), "", *_advice(found)]
    for title, texts in (("unobservable", found.reasons), ("warning", found.warnings)):
        lines += ["", *(f"{title}: {text}" for text in texts)] if texts else []
    return "\n".join(lines) + "\n"


def _table(found: Observability) -> list[str]:
    head = f"{'column':<14}{'group':<11}{'in band':>11}{'its own':>11}{'error':>11}  unit"
    rows = [
        f"{c.name:<14}{c.group:<11}{c.std_nt:>11.3g}{c.own_nt:>11.3g}{c.error:>11.2g}  {c.unit}"
        f"{'' if c.known else '   not known: larger than such coefficients are'}"
        for c in found.columns
    ]
    return [
        f"{found.terms} Tolles-Lawson terms, condition {found.condition:.3g}; nT in band per unit of the coefficient,",
        "what of it no other column has, and the standard error to expect of the coefficient:",
        head,
        *rows,
    ]


def _line(found: Observability) -> list[str]:
    by_heading = ", ".join(f"{heading} {error:.2g}" for heading, error in found.line_errors_nt.items())
    lines = [
        f"survey line: {found.line}",
        f"error to expect there in band, from the coefficients: {found.line_error_nt:.3g} nT ({by_heading})",
    ]
    if found.minutes_enough is not None:
        lines.append(
            f"{found.minutes_enough:.2g} min of such flying are enough for an error of {found.goal_nt:.3g} nT there"
        )
    return lines


def _advice(found: Observability) -> list[str]:
    swings = ", ".join(f"{axis} {size:g} deg" for axis, size in AMPLITUDES_DEG.items())
    best = [
        f"  {a.maneuver:<6} on magnetic {a.heading:<6} {a.line_error_nt:>10.3g} nT{-100.0 * a.gain:>8.1f} %"
        for a in found.advice
    ]
    return [f"one more minute of a maneuver ({swings}; {PERIOD_S:g} s) would bring that error to:", *best]
