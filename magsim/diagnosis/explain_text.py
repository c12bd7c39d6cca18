"""Explanations as text, Markdown, JSON and one page of HTML: one table of contents for all."""

import html
import json
from collections.abc import Sequence
from typing import NamedTuple

from magsim.diagnosis.explain import Explanation

CHANNELS = 12
"""Channels whose coherence is listed."""


class ReportBlock(NamedTuple):
    """A table with a title."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def _number(value: float | None, digits: int = 4) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def headline(found: Explanation) -> str:
    """Return the title of the report."""
    return f"Compensation report: {found.recording}"


def head_block(found: Explanation) -> ReportBlock:
    """Return aircraft, date, sensor, and the scores of the whole flight."""
    rows = [
        ("aircraft", found.aircraft or "-"),
        ("date", found.date or "-"),
        ("magnetometer", found.sensor),
        ("method", found.method),
        ("rows", f"{found.rows}, {found.minutes:.1f} min"),
        ("before and after", found.basis),
        ("STD in 0.1 to 0.6 Hz", f"{found.before_nt:.4g} nT before, {found.after_nt:.4g} nT after"),
        ("improvement ratio", f"{found.ratio:.1f}"),
    ]
    table = found.signatures
    if table.signatures:
        before, after = table.total_nt(after=False), table.total_nt(after=True)
        count = len(table.signatures)
        rows.append((f"FOM, {count} signatures", f"{before:.4g} nT before, {after:.4g} nT after"))
        rows.append(("FOM ratio", f"{before / after:.1f}" if after > 0.0 else "-"))
    if found.noise_nt is not None:
        rows.append(("noise of the instrument", f"{found.noise_nt:.4g} nT in band"))
    if found.uncertainty_nt is not None:
        rows.append(("error from the coefficients", f"{found.uncertainty_nt:.2g} nT in band (standard error)"))
    if found.lag is not None:
        rows.append(
            (
                "fluxgate behind the INS",
                f"{round(found.lag.lag_s, 3) + 0.0:.3f} s ({found.lag.left_nt:.3g} nT unexplained)",
            )
        )
    return ReportBlock("", ("", ""), tuple(rows))


def signature_block(found: Explanation) -> ReportBlock:
    """Return the signatures: a row for each heading, before / after of each maneuver, and their sums."""
    table = found.signatures
    title = "Signatures, peak to peak in 0.1 to 0.6 Hz, before / after [nT]"
    header = ("heading deg", *table.maneuvers, "sum", "ratio")
    if not table.signatures:
        return ReportBlock(title, header, ())

    def pair(before: float, after: float) -> str:
        return f"{before:.2f} / {after:.3f}"

    rows = []
    for heading in table.headings_deg:
        cells = [table.at(heading, maneuver) for maneuver in table.maneuvers]
        shown = ["-" if one is None else pair(one.before_nt, one.after_nt) for one in cells]
        sums = [table.total_nt(after=late, heading_deg=heading) for late in (False, True)]
        rows.append((f"{heading:.0f}", *shown, pair(*sums), _ratio(*sums)))
    by_maneuver = [[table.total_nt(after=late, maneuver=word) for late in (False, True)] for word in table.maneuvers]
    sums = [table.total_nt(after=late) for late in (False, True)]
    rows.append(("all", *(pair(*both) for both in by_maneuver), pair(*sums), _ratio(*sums)))
    return ReportBlock(title, header, tuple(rows))


def _ratio(before: float, after: float) -> str:
    return f"{before / after:.1f}" if after > 0.0 else "-"


def blocks(found: Explanation) -> list[ReportBlock]:
    """Return every table of the report, but the head."""
    makers = (signature_block, _coefficient_block, _share_block, _band_block, _coherence_block)
    return [block for block in (make(found) for make in makers) if block.rows]


def _coefficient_block(found: Explanation) -> ReportBlock:
    rows = [(t.name, t.group, _number(t.value, 5), _number(t.error, 2), t.unit) for t in found.coefficients]
    return ReportBlock("Coefficients", ("term", "group", "value", "standard error", "unit"), tuple(rows))


def _share_block(found: Explanation) -> ReportBlock:
    rows = [(s.group, f"{s.std_nt:.4g}", f"{100.0 * s.part:.1f}") for s in found.shares]
    return ReportBlock("Interference by source, in band", ("source", "STD nT", "part %"), tuple(rows))


def _band_block(found: Explanation) -> ReportBlock:
    rows = [
        (f"{b.low_hz:g} to {b.high_hz:g}", f"{b.before_nt:.4g}", f"{b.after_nt:.4g}", _number(b.noise_nt))
        for b in found.bands
    ]
    return ReportBlock("What is left, by band [nT]", ("Hz", "before", "after", "noise"), tuple(rows))


def _coherence_block(found: Explanation) -> ReportBlock:
    level = found.coherences[0].level if found.coherences else 1.0
    rows = []
    for one in found.coherences[:CHANNELS]:
        numbers = (f"{one.peak:.2f}", f"{one.peak_hz:.2f}", f"{one.mean:.2f}", f"{one.coherent_nt:.2g}")
        rows.append((one.channel, *numbers, "yes" if one.is_significant else ""))
    title = f"Coherence of what is left, 0.1 to 0.6 Hz (squared; {level:.2f} is chance at 95 % for all channels)"
    header = ("channel", "largest", "at Hz", "mean", "coherent nT", "beyond chance")
    return ReportBlock(title, header, tuple(rows))


def to_text(found: Explanation) -> str:
    """Return the report as aligned text."""
    head = head_block(found)
    width = max(len(row[0]) for row in head.rows)
    lines = [headline(found), "", *(f"{name:<{width}}  {value}" for name, value in head.rows)]
    for block in blocks(found):
        lines += ["", block.title, *_aligned((block.header, *block.rows))]
    lines += ["", *(f"note: {note}" for note in found.notes)] if found.notes else []
    return "\n".join(lines) + "\n"


def _aligned(rows: Sequence[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  "
        + "  ".join(
            cell.ljust(w) if i == 0 else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]


def to_markdown(found: Explanation) -> str:
    """Return the report as Markdown."""

    def table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> list[str]:
        escaped = [[cell.replace("|", "\\|") for cell in row] for row in (header, *rows)]
        first, *rest = ["| " + " | ".join(row) + " |" for row in escaped]
        return [first, "|" + "---|" * len(header), *rest]

    head = head_block(found)
    lines = [f"# {headline(found)}", "", *table(head.header, head.rows)]
    for block in blocks(found):
        lines += ["", f"## {block.title}", "", *table(block.header, block.rows)]
    lines += ["", "## Notes", "", *(f"- {note}" for note in found.notes)] if found.notes else []
    return "\n".join(lines) + "\n"


def to_html(found: Explanation, picture_png_base64: str) -> str:
    """Return the report as one page that needs nothing else.

    Parameters
    ----------
    found : Explanation
    picture_png_base64 : str
        The figure of the report.
    """

    def table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
        top = "".join(f"<th>{html.escape(cell)}</th>" for cell in header)
        body = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>\n" for row in rows)
        return (
            "<table>" + (f"<thead><tr>{top}</tr></thead>" if any(header) else "") + f"<tbody>\n{body}</tbody></table>\n"
        )

    title, head = html.escape(headline(found)), head_block(found)
    notes = "".join(f"<li>{html.escape(note)}</li>\n" for note in found.notes)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{title}</title><style>"
        "body{font:15px/1.5 system-ui,sans-serif;color:#22262b;max-width:1000px;margin:2em auto;padding:0 1em}"
        "img{max-width:100%}table{border-collapse:collapse;margin:0 0 1.5em}"
        "td,th{padding:.2em .8em;border-bottom:1px solid #e4e7ea;text-align:right}"
        "td:first-child,th:first-child{text-align:left}h2{font-size:1.1em}</style></head>\n<body>\n"
        f"<h1>{title}</h1>\n"
        + table(head.header, head.rows)
        + f'<img alt="spectra, shares and coherences" src="data:image/png;base64,{picture_png_base64}">\n'
        + "".join(f"<h2>{html.escape(b.title)}</h2>\n" + table(b.header, b.rows) for b in blocks(found))
        + (f"<h2>Notes</h2>\n<ul>\n{notes}</ul>\n" if notes else "")
        + "</body></html>\n"
    )


def to_json(found: Explanation) -> str:
    """Return the report as JSON: the same bytes for the same method and flight."""
    table = found.signatures
    whole = {
        "recording": found.recording,
        "aircraft": found.aircraft,
        "date": found.date,
        "sensor": found.sensor,
        "method": found.method,
        "basis": found.basis,
        "rows": found.rows,
        "before_nt": found.before_nt,
        "after_nt": found.after_nt,
        "ratio": found.ratio if found.after_nt > 0.0 else None,
        "noise_nt": found.noise_nt,
        "uncertainty_nt": found.uncertainty_nt,
        "lag_s": None if found.lag is None else found.lag.lag_s,
        "fom_before_nt": table.total_nt(after=False) if table.signatures else None,
        "fom_after_nt": table.total_nt(after=True) if table.signatures else None,
        "signatures": [one._asdict() for one in table.signatures],
        "coefficients": [term._asdict() for term in found.coefficients],
        "shares": [vars(share) for share in found.shares],
        "bands": [vars(band) for band in found.bands],
        "coherences": [{**one._asdict(), "significant": one.is_significant} for one in found.coherences],
        "dead": list(found.dead),
        "notes": list(found.notes),
    }
    return json.dumps(whole, indent=1, allow_nan=False) + "\n"
