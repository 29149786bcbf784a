"""YAML within bounds: plain values only, nothing by reference."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import yaml

from clearway.errors import ClearwayError
from clearway.reading import limits
from clearway.reading.bounded import read_bytes
from clearway.reading.values import refuse_monsters, too_deep


def read_yaml(path: str | Path, most: int = limits.YAML, *, texts: bool = True) -> Any:
    """What a YAML file holds.

    Args:
        path: Of the file.
        most: Bytes that it may have.
        texts: Whether its texts are to be short.

    Raises:
        ClearwayError: It can't be read, isn't YAML, has anchors or aliases, or is beyond what is read.
    """
    return _read(Path(path), most, _PlainLoader, texts)


def read_ros_yaml(path: str | Path) -> Any:
    """What a file of ROS parameters holds, its words as rcl reads them (rcl_yaml_param_parser, src/parse.c: get_value).

    Keys are texts. Words without quotes are truths (`yes`, `off`, ...), whole numbers (`0x1F`, `010` is eight), numbers (`1e-3`,
    `.inf`), or else texts; what stands in quotes is a text.

    Raises:
        ClearwayError: as for `read_yaml`.
    """
    return _read(Path(path), limits.ROS_PARAMETERS, _RosLoader, True)


def ros_word(word: str) -> Any:
    """What a word without quotes is in a file of ROS parameters, as `read_ros_yaml` has it."""
    return yaml.load(word, Loader=_RosLoader)


def _read(path: Path, most: int, loader: type[_PlainLoader], texts: bool) -> Any:
    raw = read_bytes(path, most)
    try:
        found = yaml.load(raw.decode("utf-8-sig"), Loader=loader)
    except UnicodeDecodeError as error:
        raise ClearwayError(f"not a YAML file: it is not UTF-8 at byte {error.start}", file=path) from error
    except RecursionError as error:
        raise too_deep(path) from error
    except ClearwayError as error:
        raise ClearwayError(error.problem, file=path) from error
    except (yaml.YAMLError, ValueError, OverflowError, AttributeError, IndexError, KeyError, TypeError) as error:
        # beside its own errors: a date that is none, a number without digits, a tag's text that its reader can't take
        raise ClearwayError(f"not a YAML file: {_said(error)}", file=path) from error
    refuse_monsters(found, path, texts=texts)
    return found


def _said(error: Exception) -> str:
    mark = getattr(error, "problem_mark", None)
    if mark is not None and "'\\t'" in (getattr(error, "problem", None) or ""):
        return f"line {mark.line + 1} has a tab where it is indented; YAML is indented with blanks"
    return " ".join(str(error).split())[:300]


class _PlainLoader(yaml.SafeLoader):
    """Composes a tree: no anchor, so that a small file can't stand for a large value; no key twice."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._depth = self._nodes = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        if isinstance(event, yaml.AliasEvent) or event.anchor is not None:
            raise ClearwayError(
                f"line {event.start_mark.line + 1}: anchors (&) and aliases (*) are not read; write the value in place"
            )
        self._nodes += 1
        if self._nodes > limits.ENTRIES:
            raise ClearwayError(f"has more than {limits.ENTRIES:,} entries, the most that are read")
        self._depth += 1
        if self._depth > limits.NESTING:
            raise too_deep(None)
        try:
            return super().compose_node(parent, index)
        finally:
            self._depth -= 1

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        first: dict[str, Any] = {}
        for key, value in node.value:
            if isinstance(key, yaml.ScalarNode):
                before = first.setdefault(key.value, value)
                if before is not value and not self.says_the_same(before, value):
                    raise ClearwayError(f"line {node.start_mark.line + 1}: the key {key.value[:100]!r} stands twice")
        return super().construct_mapping(node, deep)

    def says_the_same(self, one: yaml.Node, other: yaml.Node) -> bool:
        """Whether a key may stand twice, with these two values."""
        return False


_WORD = "!ros"
_TRUE, _FALSE = (
    {form for word in words for form in (word, word.capitalize(), word.upper())}
    for words in (("y", "yes", "true", "on"), ("n", "no", "false", "off"))
)
_INTEGER = re.compile(r"([+-]?)(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_ODD = re.compile(r"[+-]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)|[+-]?(?i:inf|infinity|nan)")


class _RosLoader(_PlainLoader):
    """The same tree, its words by rcl's rules instead of YAML 1.1's; a key may stand twice with the same word."""

    def resolve(self, kind: Any, value: Any, implicit: Any) -> Any:
        if kind is yaml.ScalarNode and implicit[0]:
            return _WORD
        return super().resolve(kind, value, implicit)  # type: ignore[no-untyped-call]

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                key.tag = "tag:yaml.org,2002:str"
        return super().construct_mapping(node, deep)

    def says_the_same(self, one: yaml.Node, other: yaml.Node) -> bool:
        scalars = isinstance(one, yaml.ScalarNode) and isinstance(other, yaml.ScalarNode)
        return scalars and (one.tag, one.value) == (other.tag, other.value)


def _word(loader: yaml.Loader, node: yaml.ScalarNode) -> bool | int | float | str | None:
    text = str(node.value)
    if text == "":
        return None
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if len(text) > limits.WORD:
        return text
    if whole := _INTEGER.fullmatch(text):
        base = 16 if whole[2][:2] in ("0x", "0X") else 8 if whole[2][0] == "0" else 10
        number = int(whole[2], base) * (-1 if whole[1] == "-" else 1)
        if -limits.WHOLE <= number < limits.WHOLE:
            return number
    if _ODD.fullmatch(text):
        return float(text.replace(".", ""))
    if _NUMBER.fullmatch(text) and math.isfinite(value := float(text)):
        return value  # beyond a double's range rcl takes it for a text
    return text


_RosLoader.add_constructor(_WORD, _word)
