"""How Clearway compiles its hot path: one decorator, so that every kernel is compiled alike.

Kernels are compiled at their first call and cached beside the source. Numba's cache does not notice an edit
in a kernel that another file calls: `make clean` after such an edit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

_F = TypeVar("_F", bound=Callable[..., Any])


def kernel(function: _F) -> _F:
    """Compile `function` with Numba: cached, without the GIL, IEEE arithmetic (no fastmath: same bits everywhere)."""
    return cast(_F, numba.njit(cache=True, nogil=True, error_model="numpy")(function))
