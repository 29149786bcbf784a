"""A binary min-heap in two arrays of the caller's, keys and what they belong to, for searches in compiled code."""

from __future__ import annotations

from typing import Any

from clearway.geometry.compiled import light


@light
def push(keys: Any, items: Any, size: int, key: Any, item: Any) -> int:
    """Add (key, item) to a heap of `size`; the arrays (n,) must have room. Returns its new size."""
    i = size
    while i > 0:
        parent = (i - 1) // 2
        if keys[parent] <= key:
            break
        keys[i], items[i] = keys[parent], items[parent]
        i = parent
    keys[i], items[i] = key, item
    return size + 1


@light
def pop(keys: Any, items: Any, size: int) -> int:
    """Drop the least of a heap of `size` > 0, which stands at 0: read it before. Returns its new size."""
    size -= 1
    key, item = keys[size], items[size]
    i = 0
    while True:
        child = 2 * i + 1
        if child >= size:
            break
        if child + 1 < size and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[i], items[i] = keys[child], items[child]
        i = child
    keys[i], items[i] = key, item
    return size
