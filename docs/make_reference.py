"""Writes docs/reference.md from the code (verbs, columns, the fields of the files that a user writes), and docs/python.md (the
Python interface) from its docstrings.

python docs/make_reference.py          # write it
python docs/make_reference.py --check  # exit 1 if it is out of date (CI does this)
"""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import Any

import typer

import clearway
from clearway.cli import app
from clearway.indicators import row_schema
from clearway.recordings.formats.table_spec import TableSpec
from clearway.recordings.lab.test_plan import TestPlan
from clearway.scenarios.files import floor_plan_schema, robot_schema, scenario_schema, schema_of, suite_schema
from clearway.statistics import Criteria
from clearway.trials.store import results_schema

PAGE, PYTHON = (Path(__file__).with_name(name) for name in ("reference.md", "python.md"))
VERBS = (
    "run", "live", "merge", "rerun", "break", "tune", "protocol", "import", "score", "localise", "identify", "map", "accept", "report", "replay", "export", "compare", "requirement", "list", "check", "schema", "samples", "examples",
)  # fmt: skip


def page() -> str:
    """The whole page as Markdown."""
    parts = ["# Reference", "Made by `python docs/make_reference.py`; do not edit.", "## Command line"]
    parts += [
        "Exit codes: 0 done; 1 done, but a check found something, a search found a break, a navigator failed, a recording cannot be used or a rerun has other bits; 2 wrong input; 130 interrupted. Of `accept`: 0 accepted; 1 rejected; 2 go on; 64 wrong input; 70 an error of Clearway."
    ]
    parts += [f"### `clearway {verb}`\n\n```text\n{_help(verb)}\n```" for verb in VERBS]
    parts += ["## Columns of trials.parquet and trials.csv", _columns()]
    schemas = {
        "scenario": scenario_schema(), "suite": suite_schema(), "robot": robot_schema(), "floor-plan": floor_plan_schema(),
        "test-plan": schema_of(TestPlan), "table": schema_of(TableSpec), "criteria": schema_of(Criteria),
    }  # fmt: skip
    for title, schema in schemas.items():
        parts += [f"## Fields of a {title} file", f"As JSON Schema: `clearway schema {title}`.", _fields(schema)]
    return "\n\n".join(parts) + "\n"


def python_page() -> str:
    """The page of the Python interface as Markdown."""
    parts = ["# The Python interface", "Made by `python docs/make_reference.py` from the docstrings; do not edit."]
    for name in (n for n in clearway.__all__ if not n.startswith("__")):
        thing = getattr(clearway, name)
        parts.append(f"## `clearway.{name}`\n\n{_documented(thing, name)}")
        if isinstance(thing, type) and name == "Results":
            methods = [n for n in dir(thing) if not n.startswith("_") and inspect.isfunction(getattr(thing, n))]
            parts += [f"### `Results.{n}`\n\n{_documented(getattr(thing, n), n)}" for n in methods]
    return "\n\n".join(parts) + "\n"


def _documented(thing: Any, name: str) -> str:
    function = inspect.isfunction(thing)
    names = (
        [str(p).partition(":")[0].partition("=")[0] for p in inspect.signature(thing).parameters.values()]
        if function
        else []
    )
    head = f"{name}({', '.join(n for n in names if n != 'self')})\n\n" if function else ""
    return f"```text\n{head}{inspect.getdoc(thing)}\n```"


def _help(verb: str) -> str:
    command: Any = typer.main.get_command(app)
    about = command.context_settings
    with command.make_context("clearway", [verb], terminal_width=78) as top:
        one = command.commands[verb]
        with one.context_class(one, info_name=verb, parent=top, terminal_width=78, **about) as context:
            return str(one.get_help(context)).strip()


def _columns() -> str:
    rows = ["| column | unit | what | source | better |", "|---|---|---|---|---|"]
    for field in results_schema(row_schema()):
        about = {k.decode(): v.decode().replace("|", "\\|") for k, v in field.metadata.items()}
        cells = [f"`{field.name}`", *(about.get(k, "") for k in ("unit", "title", "source", "better"))]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def _fields(schema: dict[str, Any]) -> str:
    rows = ["| table | field | type | default | what |", "|---|---|---|---|---|"]
    for name, table in [("(top)", schema), *schema.get("$defs", {}).items()]:
        for field, about in table.get("properties", {}).items():
            default = about.get("default")
            need = (
                "required"
                if field in table.get("required", ())
                else "its own"
                if isinstance(default, dict)
                else f"`{default}`"
            )
            what = about.get("description", "").replace("|", "\\|").replace("\n", " ")
            rows.append(f"| {name} | `{field}` | {_type(about)} | {need} | {what} |")
    return "\n".join(rows)


def _type(about: dict[str, Any]) -> str:
    if "$ref" in about:
        return about["$ref"].rsplit("/", 1)[-1]
    for several in ("anyOf", "oneOf"):
        if several in about:
            return " or ".join(dict.fromkeys(_type(one) for one in about[several]))
    if "enum" in about or "const" in about:
        return ", ".join(f"`{v}`" for v in about.get("enum", [about.get("const")]))
    if about.get("type") == "array":
        return f"list of {_type(about['items'])}" if about.get("items") else "list"
    return str(about.get("type", "any"))


if __name__ == "__main__":
    for file, made in ((PAGE, page()), (PYTHON, python_page())):
        if "--check" not in sys.argv[1:]:
            file.write_text(made, encoding="utf-8")
        elif not file.exists() or file.read_text(encoding="utf-8") != made:
            sys.exit(f"{file} is out of date; run {__file__}")
