"""Arrays that somebody else may read and nobody may write."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

_A = TypeVar("_A", bound=npt.NDArray[Any])


def read_only(array: _A) -> _A:
    """A copy that can't be made writable again, for what lasts: a goal, a map."""
    copy: Any = np.array(array, order="C")
    if copy.size:
        copy = np.frombuffer(copy.tobytes(), copy.dtype).reshape(copy.shape)  # bytes are immutable
    return copy  # type: ignore[no-any-return]


def read_only_view(array: _A) -> _A:
    """A view that refuses to be written, for what is made anew each time: who gets round it fools only themselves."""
    view = array.view()
    view.setflags(write=False)
    return view
