"""Tables as TOML text, which the standard library reads and doesn't write."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any


def toml(table: Mapping[str, Any]) -> str:
    """A table as TOML: plain values, tables and lists of tables; entries that are None are left out."""
    return "\n".join(_lines(table, ())) + "\n"


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    known = {k: v for k, v in table.items() if v is not None}
    nested = {k for k, v in known.items() if isinstance(v, dict) and len(path) < 2}
    lists = {k for k, v in known.items() if isinstance(v, list) and not path and v and isinstance(v[0], dict)}
    lines = [f"{toml_key(k)} = {toml_value(v)}" for k, v in known.items() if k not in nested | lists]
    for k in known:
        where = ".".join(toml_key(p) for p in (*path, k))
        if k in nested:
            lines += ["", f"[{where}]", *_lines(known[k], (*path, k))]
        elif k in lists:
            for entry in known[k]:
                lines += ["", f"[[{where}]]", *_lines(entry, (*path, k, ""))]
    return lines


def toml_key(key: str) -> str:
    """A key as it stands before the `=`."""
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else json.dumps(key)


def toml_value(value: Any) -> str:
    """A value as it stands behind the `=`."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{toml_key(k)} = {toml_value(v)}" for k, v in value.items() if v is not None) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(v) for v in value) + "]"
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
