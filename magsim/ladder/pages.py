"""The board as pages: Markdown, one HTML file without scripts, and plain text for a terminal."""

import math
from collections.abc import Iterable, Sequence
from html import escape
from string import Template
from typing import NamedTuple

from magsim.benchmark.statistics import FEWEST, Interval, Standing
from magsim.ladder.board import Board, LevelTable
from magsim.ladder.tracks import TRACKS

WORDS = (
    """The score of a method on a set of flights is its improvement ratio IR: the standard deviation of the aircraft's
interference in 0.1 to 0.6 Hz over that of what the method leaves of it, against the truth. Excess is what it leaves
beyond the instrument's own error. Values are geometric means over sets, excess a median, with 95 % intervals; every set
has another site, individual, day, course, air and draw of maneuvers.""",
    """Two methods tie where a paired t test over sets does not tell them apart (5 %, Holm over all pairs of the table),
or where their errors differ by no more than 10 % or 1 pT. A rank is given with all ranks that are possible. Fewer than
4 sets rank nobody for sure.""",
    """A method that fails a gate has no rank, whatever its IR: anomalies of 0.1, 1 and 20 nT must be left within 2 %
(5 % of methods that declare that they adapt) and undistorted, and its error below 0.1 Hz must be at most 1 nT, or
1.5 times that of the method that all are compared with.""",
    """Labels without noise exist nowhere but in a simulation: only the tracks no-labels and frozen are what a survey
can do.""",
    """These worlds and the methods exact_norm share their authors; level LX is their attempt at a world that does not
know its own method. Sets of the public seed can be flown by anybody: a ranking counts when its seed was hidden.""",
)


class BoardLine(NamedTuple):
    """One method of a table, in words."""

    rank: str
    method: str
    ir: str
    excess: str
    over_baseline: str
    over_leader: str
    flights: tuple[str, ...]
    cost: str
    note: str


def heads(table: LevelTable) -> tuple[str, ...]:
    """Return the first columns of a table."""
    return ("rank", "method", "IR (95 %)", "excess, pT", f"over {TRACKS[table.track].baseline}, p", "over the first, p")


NO_LABEL = "has no label"
"""In the message of a method that learns from labels alone."""


def number(value: float, digits: int = 3) -> str:
    """Return a number with so many significant digits; a dash for NaN."""
    if math.isnan(value):
        return "-"
    if abs(value) >= 1e5:
        return f"{value:.{digits - 1}g}"
    if math.isinf(value) or value == 0.0:
        return "inf" if value else "0"
    places = max(digits - 1 - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{places}f}"


def interval(value: Interval) -> str:
    """Return a value with its interval."""
    if math.isnan(value.low):
        return number(value.value)
    return f"{number(value.value)} ({number(value.low)} to {number(value.high)})"


def chance(p: float) -> str:
    """Return a p value."""
    return "" if math.isnan(p) else ", p < 0.001" if p < 0.001 else f", p = {p:.2g}"


def lines(table: LevelTable) -> list[BoardLine]:
    """Return the methods of a table in words, best first."""
    flights = flights_of(table)
    out = []
    for one in table.standings:
        marks = [*table.marks.get(one.method, ())]
        if one.ties_leader:
            marks.append("ties with the first")
        if one.sets < table.sets:
            marks.append(f"{one.sets} of {table.sets} sets")
        if one.failed:
            marks.append("fails: " + ", ".join(one.failed))
        cost = table.costs.get(one.method, {})
        out.append(
            BoardLine(
                rank(one),
                one.method,
                interval(one.ir),
                interval(one.excess_pt),
                interval(one.over_baseline) + chance(one.p_baseline),
                interval(one.over_leader) + chance(one.p_leader) if one.rank != 1 else "",
                tuple(number(table.flights.get(one.method, {}).get(flight, math.nan)) for flight in flights),
                f"{number(cost['fit_cpu_s'], 2)} s, {number(cost['estimate_us'], 2)} us" if cost else "",
                "; ".join(marks),
            )
        )
    return out


def rank(one: Standing) -> str:
    """Return a rank with those that are possible."""
    if not one.rank:
        return "-"
    return str(one.rank) if one.rank_low == one.rank_high else f"{one.rank} ({one.rank_low} to {one.rank_high})"


def flights_of(table: LevelTable) -> list[str]:
    """Return the names of the flights of a table."""
    return list(next(iter(table.flights.values()), {}))


def title(board: Board, table: LevelTable) -> str:
    """Return the title of a table."""
    level = board.ladder.levels[table.level]
    return f"{table.level}, {level.title}: {table.sensor}, track {table.track}"


def about(board: Board, table: LevelTable) -> str:
    """Return what a table is of, in a sentence or two."""
    level = board.ladder.levels[table.level]
    note = f" {level.note[0].upper()}{level.note[1:]}." if level.note else ""
    few = " So few sets rank nobody for sure." if table.sets < FEWEST else ""
    ceiling = f" A perfect estimate has IR {number(table.floor_ir)}: the instrument's noise."
    return (
        f"{TRACKS[table.track].title[0].upper()}{TRACKS[table.track].title[1:]}.{note} {table.sets} sets.{few}{ceiling}"
    )


def lost(table: LevelTable) -> list[str]:
    """Return a line for each method that lost rows, and why."""
    label = [name for name, reason in table.lost.items() if NO_LABEL in reason]
    out = [f"{name}: {reason}" for name, reason in sorted(table.lost.items()) if name not in label]
    return [f"learn from labels, which this track has not: {', '.join(sorted(label))}", *out] if label else out


def markdown(board: Board) -> str:
    """Return the board as Markdown."""
    out = [f"# {board.ladder.title}", "", *(f"{text}\n" for text in _words()), *_made(board), ""]
    for table in board.tables:
        names = (*heads(table), *(f"IR {name}" for name in flights_of(table)), "fit, row (CPU)", "notes")
        out += [f"## {title(board, table)}", "", about(board, table), "", _row(names), _row(["---"] * len(names))]
        out += [_row([*line[:6], *line.flights, line.cost, line.note]) for line in lines(table)]
        out += ["", *(f"- {_cell(text)}" for text in lost(table)), ""]
    return "\n".join(out).rstrip() + "\n"


def _words() -> list[str]:
    """Return the paragraphs, each on one line."""
    return [" ".join(paragraph.split()) for paragraph in WORDS]


def _made(board: Board) -> list[str]:
    return [
        f"Ladder {board.ladder.name}, SHA-256 `{board.ladder.sha256}`; magsim {board.about.get('magsim')}.",
        "",
        "Made again by:",
        "",
        "```",
        str(board.about.get("command", "")),
        "```",
    ]


def _row(cells: Iterable[str]) -> str:
    return "| " + " | ".join(_cell(cell) for cell in cells) + " |"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ").replace("<", "&lt;")


PAGE = Template(
    """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
:root { color-scheme: light dark; --line: #8886; --weak: #777; --mark: #0a7d5a; --bad: #b3261e; }
@media (prefers-color-scheme: dark) { :root { --weak: #aaa; --mark: #5fd0a8; --bad: #ff8a80; } }
body { font: 15px/1.45 system-ui, sans-serif; max-width: 76rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .6rem; border-bottom: 1px solid var(--line); text-align: left; white-space: nowrap; }
td.note { white-space: normal; min-width: 12rem; }
tr.tie td:nth-child(2), tr.first td:nth-child(2)
  { color: var(--mark); font-weight: 600; }
tr.out td { color: var(--weak); } tr.out td.note { color: var(--bad); } .lost { color: var(--weak); }
code { overflow-wrap: anywhere; }
</style></head><body>
<h1>$title</h1>
$words
<p>$made</p>
<pre><code>$command</code></pre>
<h2>All levels: improvement ratio</h2>
$matrix
$tables
</body></html>
"""
)


def html(board: Board) -> str:
    """Return the board as one page that needs nothing else."""
    version = escape(str(board.about.get("magsim")))
    made = f"Ladder {board.ladder.name}, SHA-256 <code>{board.ladder.sha256}</code>; magsim {version}. Made again by:"
    return PAGE.substitute(
        title=escape(board.ladder.title),
        words="\n".join(f"<p>{escape(text)}</p>" for text in _words()),
        made=made,
        command=escape(str(board.about.get("command", ""))),
        matrix="\n".join(_matrix(board, track) for track in dict.fromkeys(table.track for table in board.tables)),
        tables="\n".join(_section(board, table) for table in board.tables),
    )


def _matrix(board: Board, track: str) -> str:
    """Return a table of all levels of a track: what ties with the first is marked, what fails a gate is grey."""
    tables = [table for table in board.tables if table.track == track]
    methods = dict.fromkeys(one.method for table in tables for one in table.standings)
    heads = [
        "method",
        *(f"{table.level} {table.sensor}" if table.sensor != "cabin" else table.level for table in tables),
    ]
    rows = [f"<tr><td>perfect</td>{''.join(f'<td>{number(table.floor_ir)}</td>' for table in tables)}</tr>"]
    for method in methods:
        cells = []
        for table in tables:
            one = next((one for one in table.standings if one.method == method), None)
            if one is None:
                cells.append("<td>-</td>")
                continue
            text = number(one.ir.value)
            first = one.rank == 1 or one.ties_leader
            cells.append(
                f"<td><s>{text}</s></td>" if one.failed else f"<td><b>{text}</b></td>" if first else f"<td>{text}</td>"
            )
        rows.append(f"<tr><td>{escape(method)}</td>{''.join(cells)}</tr>")
    words = "The first and what ties with it are bold; what fails a gate is struck out."
    return f"<h3>Track {escape(track)}</h3><p>{words}</p>{_html_table(heads, rows)}"


def _section(board: Board, table: LevelTable) -> str:
    names = [*heads(table), *(f"IR {name}" for name in flights_of(table)), "fit, row (CPU)", "notes"]
    rows = []
    for one, line in zip(table.standings, lines(table), strict=True):
        kind = "out" if one.failed else "first" if one.rank == 1 else "tie" if one.ties_leader else ""
        cells = [*line[:6], *line.flights, line.cost]
        text = "".join(f"<td>{escape(cell)}</td>" for cell in cells)
        rows.append(f'<tr class="{kind}">{text}<td class="note">{escape(line.note)}</td></tr>')
    gone = "".join(f"<li>{escape(text)}</li>" for text in lost(table))
    below = f'<ul class="lost">{gone}</ul>' if gone else ""
    return (
        f"<h2>{escape(title(board, table))}</h2><p>{escape(about(board, table))}</p>{_html_table(names, rows)}{below}"
    )


def _html_table(heads: Sequence[str], rows: Sequence[str]) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>'


def text(board: Board) -> str:
    """Return the board for a terminal."""
    out = []
    for table in board.tables:
        cells = [(line.rank, line.method, line.ir, line.excess, line.note) for line in lines(table)]
        heads = ("rank", "method", "IR (95 %)", "excess, pT", "")
        widths = [max(len(row[i]) for row in [heads, *cells]) for i in range(4)]
        out += [title(board, table), f"  {about(board, table)}"]
        for row in [heads, *cells]:
            start = "  ".join(cell.ljust(width) for cell, width in zip(row[:4], widths, strict=True))
            out.append(f"  {start}  {row[4]}".rstrip())
        out += [f"  {line}" for line in lost(table)]
        out.append("")
    return "\n".join(out).rstrip() + "\n"
