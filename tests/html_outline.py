"""What a page is made of, for tests of reports and sheets."""

from __future__ import annotations

from html.parser import HTMLParser

Tags = list[tuple[str, dict[str, str | None]]]
VOID = frozenset({"meta", "br", "input", "img", "link", "hr"})


class _Outline(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: Tags = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def outline(page: str) -> Tags:
    """The elements of `page` with their attributes; it complains of one that is not closed in order."""
    parser = _Outline()
    parser.feed(page)
    parser.close()
    assert parser.open == []
    return parser.tags
