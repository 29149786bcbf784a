"""What code of others says, made safe to keep: text that any file can hold, of a length that any table can."""

from __future__ import annotations

import traceback

LONGEST = 2_000
"""Characters of what may be said at once; of an error's text more is cut off."""
LONGEST_TRACE = 20_000
"""Characters of an error with where it was raised; more is cut out of its middle."""


def said(error: BaseException) -> str:
    """An error's kind and words. It never raises, whatever the error's own methods do."""
    try:
        text = str.__str__(str(error))
    except BaseException as worse:
        text = f"<its text raises {type(worse).__name__}>"
    if len(text) > LONGEST:
        text = f"{text[:LONGEST]} ... ({len(text)} characters)"
    return printable(f"{type(error).__name__}: {text}")


def traced(error: BaseException) -> str:
    """An error with where it was raised. It never raises either."""
    try:
        text = "".join(traceback.format_exception(error)).rstrip()
    except BaseException:
        text = said(error)
    if len(text) > LONGEST_TRACE:
        text = f"{text[: LONGEST_TRACE // 2]}\n...\n{text[-LONGEST_TRACE // 2 :]}"
    return printable(text)


def printable(text: str) -> str:
    """`text` with escapes for what UTF-8 can't hold and for what would steer a terminal; new lines and tabs stay."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\t" else ascii(c)[1:-1] for c in text)


def plain_text(value: object, what: str) -> str:
    """A copy of a text that code of others gave: what it may have put around `str` stays behind.

    Args:
        value: What it gave.
        what: What it is, for the error.

    Raises:
        TypeError: it is no text.
        ValueError: it is longer than `LONGEST`, or holds what UTF-8 can't.
    """
    if not isinstance(value, str):
        raise TypeError(f"{what} is a {type(value).__name__}, not text")
    text = str.__str__(value)
    if len(text) > LONGEST:
        raise ValueError(f"{what} has {len(text)} characters; at most {LONGEST} are kept")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{what} is {text!a}, which is no text that UTF-8 can hold") from None
    return printable(text)
