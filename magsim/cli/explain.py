"""``magsim explain``: what a fitted method does to a flight, and a compensation report of one page."""

import base64
import io
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from magsim.diagnosis.explain import Explanation

ENDINGS = (".pdf", ".png", ".svg", ".html", ".md", ".txt", ".json")


@click.command(short_help="Explain what a trained compensator does to a flight.")
@click.argument("model", type=click.Path(path_type=Path))
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--flight", metavar="NAME", help="One of several flights of FILE.")
@click.option(
    "--rows", type=click.Choice(["train", "valid", "test", "all"]), help="Rows that count; default test, else all."
)
@click.option(
    "-o",
    "--output",
    metavar="REPORT",
    type=click.Path(path_type=Path),
    help=f"Report of one page: {', '.join(ENDINGS)}.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of tables.")
@click.option("--force", is_flag=True, help="Replace an existing report.")
def explain(  # noqa: PLR0917 - the options
    model: Path,
    file: Path,
    flight: str | None,
    rows: str | None,
    output: Path | None,
    as_json: bool,
    force: bool,
) -> None:
    """Explain what MODEL, the folder of a trained run, does to FILE, a recording of one flight.

    Coefficients with their errors, interference by source, the twelve signatures and the figure of merit, what is left
    by band, which channels it follows, the lag of the fluxgate, dead channels. With truth in the recording before and
    after are errors against it, else readings.
    """
    from magsim import storage
    from magsim.compensation import load
    from magsim.diagnosis.explain import explain as explained
    from magsim.diagnosis.explain_text import to_json, to_text
    from magsim.errors import RequestError
    from magsim.recording import Recording

    if output is not None:
        if output.suffix.lower() not in ENDINGS:
            msg = f"{output}: a report ends in {', '.join(ENDINGS)}, not {output.suffix!r}"
            raise RequestError(msg)
        storage.check_target(output, force=force)
    found = explained(load(model), Recording.read(file, flight), rows=rows)
    if output is not None:
        _write(found, output, force=force)
    click.echo(to_json(found) if as_json else to_text(found), nl=False)
    if output is not None and not as_json:
        click.echo(f"\n{output}")


def _write(found: "Explanation", output: Path, *, force: bool) -> None:
    from magsim import plots
    from magsim.diagnosis import explain_text
    from magsim.storage import atomic_text

    texts = {".md": explain_text.to_markdown, ".txt": explain_text.to_text, ".json": explain_text.to_json}
    ending = output.suffix.lower()
    if ending in texts:
        atomic_text(output, texts[ending](found), force=force)
    elif ending == ".html":
        buffer = io.BytesIO()
        plots.plot_explanation(found, tables=False).savefig(buffer, format="png", metadata={"Software": None})
        atomic_text(output, explain_text.to_html(found, base64.b64encode(buffer.getvalue()).decode()), force=force)
    else:
        plots.save(plots.plot_explanation(found), output, force=force)
