"""What all tests share."""

from __future__ import annotations

from hypothesis import settings

# A kernel compiles at its first call, which no deadline should count; the same examples every time.
settings.register_profile("clearway", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("clearway")
