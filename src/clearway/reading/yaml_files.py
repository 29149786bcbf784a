"""YAML within bounds: plain values only, nothing by reference."""

from __future__ import annotations

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
    path = Path(path)
    raw = read_bytes(path, most)
    try:
        found = yaml.load(raw.decode("utf-8-sig"), Loader=_PlainLoader)
    except UnicodeDecodeError as error:
        raise ClearwayError(f"not a YAML file: it is not UTF-8 at byte {error.start}", file=path) from error
    except RecursionError as error:
        raise too_deep(path) from error
    except ClearwayError as error:
        raise ClearwayError(error.problem, file=path) from error
    except (yaml.YAMLError, ValueError, OverflowError, AttributeError, IndexError, KeyError, TypeError) as error:
        # beside its own errors: a date that is none, a number without digits, a tag's text that its reader can't take
        raise ClearwayError(f"not a YAML file: {' '.join(str(error).split())[:300]}", file=path) from error
    refuse_monsters(found, path, texts=texts)
    return found


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
        keys = [key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        if len(set(keys)) < len(keys):
            twice = next(k for n, k in enumerate(keys) if k in keys[:n])
            raise ClearwayError(f"line {node.start_mark.line + 1}: the key {twice[:100]!r} stands twice")
        return super().construct_mapping(node, deep)
