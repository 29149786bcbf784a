"""For the site: links of the documents into the repository (code, examples, notices) become names, since the site holds the documents alone."""

import re
from pathlib import Path

_DOCS = Path(__file__).parent
_LINK = re.compile(r"\[([^\]]*)\]\(([^)\s#:]+)(#[^)\s]*)?\)")


def on_page_markdown(markdown: str, page, config, files) -> str:
    """The page with links to what lies outside of docs/ as code."""
    here = (_DOCS / page.file.src_path).parent

    def plain(found: re.Match[str]) -> str:
        target = (here / found[2]).resolve()
        if target.is_relative_to(_DOCS):
            return found[0]
        inside = target.relative_to(_DOCS.parent) if target.is_relative_to(_DOCS.parent) else found[2]
        return f"{found[1]} (`{inside}`)"

    return _LINK.sub(plain, markdown)
