"""Help answers at once: nothing heavy is imported for it, and no verb imports what it doesn't need."""

from __future__ import annotations

import subprocess
import sys

import pytest
from command_line import Shell

HEAVY = ("numba", "numpy", "scipy", "pyarrow", "matplotlib", "pydantic")


def test_help_imports_nothing_heavy():
    code = (
        "import sys; sys.argv = ['clearway', '--help']\n"
        "from clearway.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        f"print([m for m in {HEAVY!r} if m in sys.modules])"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip().endswith("[]")


def test_what_computes_no_statistics_imports_none():
    """They take as long to import as all else that a verb needs."""
    code = (
        "import sys; sys.argv = ['clearway', 'schema', 'suite']\n"
        "from clearway.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print([m for m in ('scipy.stats', 'scipy.signal', 'pandas', 'matplotlib') if m in sys.modules])"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip().endswith("[]")


@pytest.mark.parametrize(
    "verb",
    [
        "run",
        "rerun",
        "protocol",
        "import",
        "map",
        "accept",
        "report",
        "replay",
        "compare",
        "list",
        "check",
        "schema",
        "samples",
    ],
)
def test_every_verb_explains_itself(clearway: Shell, verb: str):
    said = clearway(verb, "--help")
    assert said.code == 0
    assert "Usage: clearway" in said.out


def test_samples_of_the_textbook(clearway: Shell):
    assert clearway("samples", "--reliability", "0.9", "--confidence", "0.95").out.startswith("29 trials")
    assert clearway("samples", "--failures", "1").out.startswith("46 trials")
    assert "--json" in clearway("samples", "--help").out
