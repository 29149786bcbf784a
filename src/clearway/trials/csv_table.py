"""Tables for CSV files that a spreadsheet may open: no text in them is taken for a formula."""

from __future__ import annotations

import pyarrow as pa
import pyarrow.compute as pc

FORMULA = r"^[=+\-@\t\r]"
"""How a cell begins that a spreadsheet would compute."""


def without_formulas(table: pa.Table) -> pa.Table:
    """The table with an apostrophe before each text that begins like a formula, as spreadsheets write a text."""
    for i, field in enumerate(table.schema):
        if pa.types.is_string(field.type):
            column = table.column(i)
            quoted = pc.binary_join_element_wise("'", column, "")
            table = table.set_column(i, field, pc.if_else(pc.match_substring_regex(column, FORMULA), quoted, column))
    return table
