"""``magsim schema``: the JSON schema of scenario files."""

import json

import click


@click.command(short_help="Print the JSON schema of scenario files.")
def schema() -> None:
    """Print the JSON schema of scenario files, for editors and for people.

    Editors with Taplo check a TOML file whose first line is "#:schema ./magsim.schema.json".
    """
    from magsim.scenario import Scenario

    draft = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    click.echo(json.dumps(draft | Scenario.model_json_schema(), indent=2))
