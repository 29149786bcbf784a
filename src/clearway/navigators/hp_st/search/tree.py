"""What the search finds: a tree of nodes, layer by layer, and the ways in it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel, light
from clearway.geometry.shapes import FloatArray

IntArray = npt.NDArray[np.int64]

X, Y, THETA, V, OMEGA, COST, TOTAL = range(7)
"""Columns of a node: pose, speeds, what it cost so far beyond time, and that with time and time to go, s."""


class Tree(NamedTuple):
    """What was found.

    Attributes:
        nodes: (L + 1, B, 7), see the columns.
        parent: (L + 1, B) int64, of which node of the layer before each is a child.
        control: (L + 1, B, 2) the v [m/s] and omega [rad/s] told that led there.
        count: (L + 1,) nodes in each layer.
        goal: (3,) layer and node of the best arrival within the layers, and what it counts, s; layer -1: none.
    """

    nodes: FloatArray
    parent: IntArray
    control: FloatArray
    count: IntArray  # type: ignore[assignment]  # a tuple's method of that name isn't missed
    goal: FloatArray


@light
def leaf(tree: Tree) -> tuple[int, int]:
    """Layer and index of the best end: an arrival, or the best node of the last layer."""
    last = len(tree.count) - 1
    while last > 0 and tree.count[last] == 0:
        last -= 1
    best, at = math.inf, -1
    for b in range(tree.count[last]):
        if tree.nodes[last, b, TOTAL] < best:
            best, at = tree.nodes[last, b, TOTAL], b
    if tree.goal[0] >= 0.0 and tree.goal[2] <= best:
        return int(tree.goal[0]), int(tree.goal[1])
    return last, at


@kernel
def trace(tree: Tree, layer: int, index: int) -> tuple[FloatArray, FloatArray]:
    """States (k + 1, 5) and commands (k, 2), layer by layer, of the way that ends in a node."""
    states, inputs = np.empty((layer + 1, 5)), np.empty((layer, 2))
    for k in range(layer, -1, -1):
        states[k] = tree.nodes[k, index, :5]
        if k > 0:
            inputs[k - 1] = tree.control[k, index]
            index = tree.parent[k, index]
    return states, inputs


@kernel
def follow(tree: Tree, layer: int, index: int, stride: int, commands: FloatArray) -> None:
    """Fill `commands` (N, 2), which is zero, with those of the way to a node, `stride` periods a layer."""
    _, told = trace(tree, layer, index)
    for k in range(min(len(told) * stride, len(commands))):
        commands[k, 0], commands[k, 1] = told[k // stride, 0], told[k // stride, 1]
