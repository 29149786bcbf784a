"""Writes docs/reference.md from the code: verbs, columns, and the fields of the files that a user writes.

python docs/make_reference.py          # write it
python docs/make_reference.py --check  # exit 1 if it is out of date (CI does this)
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow as pa

from clearway.indicators import row_schema
from clearway.recordings.formats.table_spec import TableSpec
from clearway.recordings.lab.test_plan import TestPlan
from clearway.scenarios.files import floor_plan_schema, robot_schema, scenario_schema, schema_of, suite_schema

LABELS = {
    "trial": "number, from 0; the key of every other file",
    "id": "suite/scenario/robot/navigator, and the set-up if there are any",
    "scenario": "unique in its suite",
    "batch": "NO, SO, MO, CE in the hospital protocol; what the report groups by",
    "configuration": "the same test at other speeds has the same configuration",
    "robot": "name, with :PRESET if one was used",
    "localisation": "truth, odometry or amcl",
    "privileged": "whether the navigator was told the obstacles' future",
    "floor_plan": "name of the floor plan",
    "speed": "set speed",
    "obstacle_speed": "of the moving obstacle",
    "size": "edge of the static obstacles",
    "gap": "between double obstacles",
    "seed": "of the scenario; the same for every robot and navigator",
    "outcome": "reached, collision, timeout, livelock, navigator_failed or aborted",
    "reason": "of an outcome other than reached, in words",
    "failure": "why success is false; empty if it is true",
    "cause": "why success is false in paper B's words, each decided by a stated test",
    "moved_at_contact": "who moved at contact: robot, obstacle, both or neither; empty without one",
    "avoidable": "of a contact: seen too late, escape existed when first seen, or planner's fault, each decided by a stated test",
    "violations": "how often an assumption of the navigator's guarantee was seen to be untrue (events `assumption`)",
    "setup": "how much thinking was allowed a decision; empty: no bound",
    "tracking": "how obstacles were followed; empty if the navigator asked for none",
    "not_computable": "JSON: indicator -> why its cell is empty",
    "source": "simulated or recorded",
    "legs_by_motion": "whether a recording's legs were found by the robot's motion, not by goals or given spans; see CT",
    "to_confirm": "what a person has to look at: possible contacts, starts and ends of legs that did not show",
    "near_tolerance": "DE or OE closer to its tolerance than its uncertainty; success keeps to the values",
    "note": "the tester's, of a recorded trial",
    "duration": "of the whole trial, simulated or recorded",
}
PAGE = Path(__file__).with_name("reference.md")
VERBS = (
    "run", "protocol", "import", "score", "map", "report", "replay", "export", "compare", "list", "check", "schema", "samples",
)  # fmt: skip


def page() -> str:
    """The whole page as Markdown."""
    parts = ["# Reference", "Made by `python docs/make_reference.py`; do not edit.", "## Command line"]
    parts += [
        "Exit codes: 0 done; 1 done, but a check found something or a navigator failed; 2 wrong input; 130 interrupted."
    ]
    parts += [f"### `clearway {verb}`\n\n```text\n{_help(verb)}\n```" for verb in VERBS]
    parts += ["## Columns of trials.parquet and trials.csv", _columns()]
    schemas = {
        "scenario": scenario_schema(), "suite": suite_schema(), "robot": robot_schema(), "floor-plan": floor_plan_schema(),
        "test-plan": schema_of(TestPlan), "table": schema_of(TableSpec),
    }  # fmt: skip
    for title, schema in schemas.items():
        parts += [f"## Fields of a {title} file", f"As JSON Schema: `clearway schema {title}`.", _fields(schema)]
    return "\n\n".join(parts) + "\n"


def _help(verb: str) -> str:
    clearway = str(Path(sys.executable).with_name("clearway"))
    said = subprocess.run(
        [clearway, verb, "--help"], capture_output=True, text=True, check=True, env={"COLUMNS": "100"}
    )
    return said.stdout.strip()


def _columns() -> str:
    rows = ["| column | unit | what | source | better |", "|---|---|---|---|---|"]
    own = pa.field("duration", pa.float64(), metadata={"unit": "s"})  # the store's own: first two and last
    for field in [pa.field("trial", pa.int32()), pa.field("id", pa.string()), *row_schema(), own]:
        about = {"title": LABELS.get(field.name, "")} | {
            k.decode(): v.decode().replace("|", "\\|") for k, v in (field.metadata or {}).items()
        }
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
    made = page()
    if "--check" in sys.argv[1:]:
        sys.exit(
            0
            if PAGE.exists() and PAGE.read_text(encoding="utf-8") == made
            else f"{PAGE} is out of date; run {__file__}"
        )
    PAGE.write_text(made, encoding="utf-8")
