"""What the documents say exists: files that they link to, commands, names in code."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import runpy
import shlex
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import typer

import clearway
from clearway.cli import app
from clearway.navigators.registry import drives_of, navigator_class, navigator_names, needs_of

ROOT = Path(__file__).parents[2]
FOLDERS = [ROOT / name for name in ("docs", "src", "tests", "benchmarks", "examples")]
PAGES = [*sorted(ROOT.glob("*.md")), *(page for folder in FOLDERS for page in sorted(folder.rglob("*.md")))]
PACKAGE = ROOT / "src" / "clearway"
EXAMPLES = sorted((ROOT / "examples").iterdir())
COMMAND: Any = typer.main.get_command(app)


class Found(NamedTuple):
    """A piece of a document; its file and line name the test."""

    file: Path
    line: int
    text: str


def _name(found: Any) -> str:
    return f"{found.file.relative_to(ROOT)}:{found.line}" if isinstance(found, Found) else str(found)


def _blocks(page: Path, language: str) -> list[Found]:
    text = page.read_text(encoding="utf-8")
    fence = re.compile(rf"^```{language}\n(.*?)^```", re.MULTILINE | re.DOTALL)
    return [Found(page, text.count("\n", 0, m.start()) + 2, m[1]) for m in fence.finditer(text)]


def _prose(page: Path) -> str:
    """The page without its fenced blocks, the same number of lines."""
    text = page.read_text(encoding="utf-8")
    return re.sub(r"^```.*?^```", lambda m: "\n" * m[0].count("\n"), text, flags=re.MULTILINE | re.DOTALL)


def _links() -> list[Found]:
    found = []
    for page in PAGES:
        for number, line in enumerate(_prose(page).splitlines(), 1):
            targets = re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`]*`", "", line))
            found += [Found(page, number, t) for t in targets if not re.match(r"[a-z]+:", t)]
    return found


def _commands() -> list[Found]:
    """Whole command lines: in shell blocks, and in the comments at the top of the examples."""
    found = []
    for page in PAGES:
        for block in _blocks(page, "sh"):
            lines = block.text.replace("\\\n", "  ").splitlines()
            found += [Found(page, block.line + i, line) for i, line in enumerate(lines)]
    for file in EXAMPLES:
        if file.suffix in (".py", ".toml"):
            found += [Found(file, i, s) for i, s in enumerate(file.read_text(encoding="utf-8").splitlines(), 1)]
    says = re.compile(r"^(?:#?\s*(?:Try:)?\s*)(clearway [a-z].*)$")
    return [Found(f.file, f.line, m[1]) for f in found if (m := says.match(f.text))]


def _mentions() -> list[Found]:
    """Commands in running text, which may leave arguments out."""
    found = []
    for page in PAGES:
        for number, line in enumerate(_prose(page).splitlines(), 1):
            found += [Found(page, number, said) for said in re.findall(r"`(clearway [^`]*)`", line)]
    return found


def _slugs(page: Path) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    heads = re.findall(r"^#+ (.+)$", _prose(page), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in heads}


@pytest.mark.parametrize("link", _links(), ids=_name)
def test_link_leads_somewhere(link: Found):
    path, _, anchor = link.text.partition("#")
    target = (link.file.parent / path).resolve() if path else link.file
    assert target.exists(), link.text
    if anchor:
        assert anchor in _slugs(target), link.text


def _mentioned_pages() -> list[Found]:
    """Pages that code, its comments and its tables name: from the root, the package's root, or beside the file."""
    found = []
    kinds = (".py", ".toml")
    files = [f for d in FOLDERS for f in sorted(d.rglob("*")) if f.suffix in kinds and f != Path(__file__)]
    for file in files:
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
            names = re.findall(r"(?<![\w*./-])(?:[\w.-]+/)*[\w-]+\.md\b", line)
            found += [Found(file, number, n) for n in names if n.startswith("docs/") or n.endswith("DECISIONS.md")]
    return found


@pytest.mark.parametrize("mention", _mentioned_pages(), ids=_name)
def test_page_that_code_names_exists(mention: Found):
    assert any((start / mention.text).is_file() for start in (ROOT, PACKAGE, mention.file.parent)), mention.text


def test_the_index_of_decisions_names_every_page_of_them():
    index = ROOT / "docs" / "decisions.md"
    named = {(index.parent / found.text).resolve() for found in _links() if found.file == index}
    pages = {page.resolve() for page in PACKAGE.rglob("DECISIONS.md")}
    assert len(pages) > 10
    assert pages <= named


def _measured() -> list[Found]:
    """What each heading of the measurements is followed by, where that has figures: a command or a table."""
    found = []
    for page in sorted((ROOT / "docs" / "measurements").glob("*.md")):
        text = page.read_text(encoding="utf-8")
        sections = re.finditer(r"^##+ .+\n((?:(?!##+ ).*\n)*)", text, re.MULTILINE)
        found += [Found(page, text.count("\n", 0, m.start()) + 1, m[1]) for m in sections]
    return [f for f in found if re.search(r"^(?:```sh|\|)", f.text, re.MULTILINE)]


@pytest.mark.parametrize("section", _measured(), ids=_name)
def test_figures_say_when_and_on_which_version_they_were_measured(section: Found):
    assert re.search(r"^Measured \d{4}-\d\d-\d\d (?:at|before) `[0-9a-f]{7,}`", section.text, re.MULTILINE)


@pytest.mark.parametrize("command", _commands(), ids=_name)
def test_command_line_is_understood(command: Found):
    words = shlex.split(re.split(r" [>|] ", command.text)[0], comments=True)[1:]
    assert words[0] in COMMAND.commands, command.text
    verb = COMMAND.commands[words[0]]
    verb.make_context(words[0], words[1:])  # parses, runs nothing; a usage error is raised
    for word in words:
        if word.startswith("examples/"):
            assert (ROOT / word.partition(":")[0]).exists(), word


@pytest.mark.parametrize("mention", _mentions(), ids=_name)
def test_mentioned_command_exists(mention: Found):
    words = shlex.split(mention.text)[1:]
    if words[0].startswith("-"):
        assert words[0] in ("--help", "--version", "--install-completion")
        return
    assert words[0] in COMMAND.commands, mention.text
    options = {o for p in COMMAND.commands[words[0]].params for o in p.opts} | {"--help", "-h"}
    assert {w for w in words if w.startswith("-")} <= options, mention.text


def _python() -> list[Found]:
    blocks = [b for page in PAGES for b in _blocks(page, "python")]
    return blocks + [Found(f, 1, f.read_text(encoding="utf-8")) for f in EXAMPLES if f.suffix == ".py"]


@pytest.mark.parametrize("code", _python(), ids=_name)
def test_python_compiles_and_names_what_exists(code: Found):
    tree = ast.parse(code.text)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("clearway"):
            module = importlib.import_module(str(node.module))
            assert all(hasattr(module, alias.name) for alias in node.names), ast.unparse(node)
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "clearway.run":
            known = set(inspect.signature(clearway.run).parameters)
            assert {k.arg for k in node.keywords if k.arg} <= known, ast.unparse(node)


@pytest.mark.slow
def test_what_the_page_on_learning_shows_runs(capsys: pytest.CaptureFixture[str]):
    pytest.importorskip("gymnasium")
    pytest.importorskip("pettingzoo")
    names: dict[str, Any] = {}
    blocks = _blocks(ROOT / "docs" / "how-to" / "learning.md", "python")
    assert len(blocks) == 3
    for block in blocks:  # each goes on where the one before it ended
        exec(compile("\n" * (block.line - 1) + block.text, str(block.file), "exec"), names)
    assert re.fullmatch(r"(reached|collision|timeout|livelock) (None|[\d.]+)\n", capsys.readouterr().out)


@pytest.mark.parametrize("block", [b for page in PAGES for b in _blocks(page, "toml")], ids=_name)
def test_toml_is_toml(block: Found):
    assert tomllib.loads(block.text)


def test_reference_is_current():
    made = runpy.run_path(str(ROOT / "docs" / "make_reference.py"))
    assert made["PAGE"].read_text(encoding="utf-8") == made["page"](), "run docs/make_reference.py"


def test_every_page_is_linked_from_another():
    linked = {(f.file.parent / f.text.partition("#")[0]).resolve() for f in _links()}
    assert [p.name for p in PAGES if p.resolve() not in linked and p.name != "README.md"] == []


def test_the_table_of_navigators_has_a_row_for_each_with_its_needs_and_bases():
    text = (ROOT / "README.md").read_text(encoding="utf-8").partition("\n## Navigators\n")[2].partition("\n## ")[0]
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("| `")]
    told = {row[0].strip("`"): (row[3], row[4]) for row in cells}
    letters = {"differential": "d", "omnidirectional": "o", "ackermann": "c"}
    bases, known = {}, {}
    for name in navigator_names():
        made: Any = navigator_class(name)
        bases[name] = ", ".join(letter for kind, letter in letters.items() if kind in drives_of(name, made))
        known[name] = (", ".join(sorted(needs_of(name, made))) or "nothing", bases[name])
    assert told == known
    assert len(cells) == len(known)
    assert all(len(row) == 7 and all(row) for row in cells)


def _values() -> dict[str, ast.ClassDef]:
    """The public dataclasses and named tuples, by where each is defined."""
    found = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                made = " ".join(ast.unparse(part) for part in (*node.bases, *node.decorator_list))
                if re.search(r"\b(NamedTuple|dataclass)\b", made):
                    found[f"{file.relative_to(ROOT)}:{node.lineno} {node.name}"] = node
    return found


def _fields(node: ast.ClassDef) -> list[str]:
    stated = [part for part in node.body if isinstance(part, ast.AnnAssign) and "ClassVar" not in ast.unparse(part)]
    names = [ast.unparse(part.target) for part in stated]
    return [name for name in names if not name.startswith("_")]


def test_every_field_of_a_public_value_is_told_on_a_line_of_its_own():
    values, missing = _values(), []
    for name, node in values.items():
        text = (ast.get_docstring(node) or "").partition("Attributes:\n")[2]
        told = re.findall(r"^    (\w+): \S", text, re.MULTILINE)
        missing += [f"{name}.{field}" for field in _fields(node) if told.count(field) != 1]
    assert missing == []
    assert len(values) > 150


def test_the_site_has_every_page_and_the_citation_both_papers():
    yaml = pytest.importorskip("yaml")
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert [r["doi"] for r in cited["references"]] == ["10.1038/s41598-024-69040-z", "10.1038/s41598-025-18573-y"]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert cited["version"] == project["version"]
    index = ROOT / "docs" / "index.md"
    linked = {(f.file.parent / f.text).resolve() for f in _links() if f.file == index}
    assert {p.resolve() for p in (ROOT / "docs").rglob("*.md")} - linked == {index.resolve()}
