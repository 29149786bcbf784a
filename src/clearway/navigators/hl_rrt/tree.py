"""The tree of HL-RRT*: points in preallocated arrays, each with the length of its way from the root.

Nodes 0..n-1 are in use; node 0 is the root. A node whose way is known to be blocked is detached: it has no parent, and
it and its subtree cost infinity until something re-parents them. Invariants, after every operation:

- the cost of a node is its parent's cost plus the length of their edge, 0.0 for the root, infinity below a detached one;
- following parents ends at the root or at a detached node, never in a cycle;
- children lists and parents say the same.

All kernels work in place. `x`, `y`, `half` are metres in the map frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray

IntArray: TypeAlias = npt.NDArray[np.int64]

NONE = -1
_COUNT, _NAMES = 0, 1


class Tree(NamedTuple):
    """Arrays of N slots.

    Attributes:
        position: (N, 2) m.
        cost: (N,) m from the root.
        parent: (N,) -1: none.
        child: (N,) the first child; -1: none.
        after: (N,) the next sibling; -1: none.
        before: (N,) the previous sibling; -1: none.
        name: (N,) a number that no other node ever had, so that what is remembered of a node is not taken for another's
            in the same slot.
        blocked: (N,) the last tick at which the node was found inside an obstacle.
        meta: (2,) nodes in use, names given.
        head: (cells, cells) the first node in a cell; -1: none.
        following: (N,) the next node in the same cell; -1: none.
        frame: (3,) lower-left corner, cell, m.
        stack: (N,) scratch.
    """

    position: FloatArray
    cost: FloatArray
    parent: IntArray
    child: IntArray
    after: IntArray
    before: IntArray
    name: IntArray
    blocked: IntArray
    meta: IntArray
    head: IntArray
    following: IntArray
    frame: FloatArray
    stack: IntArray


def make_tree(capacity: int, half: float, cell: float) -> Tree:
    """An empty tree for at most `capacity` nodes within `half` [m] of its root on both axes, found by cells of `cell` [m]."""
    cells = math.ceil(2.0 * half / cell) + 2

    def links() -> IntArray:
        return np.full(capacity, NONE, np.int64)

    return Tree(
        position=np.zeros((capacity, 2)), cost=np.full(capacity, np.inf), parent=links(), child=links(), after=links(),
        before=links(), name=links(), blocked=links(), meta=np.zeros(2, np.int64),
        head=np.full((cells, cells), NONE, np.int64), following=links(), frame=np.array((0.0, 0.0, cell)), stack=links(),
    )  # fmt: skip


@kernel
def plant(tree: Tree, x: float, y: float) -> None:
    """Forget all nodes but a root at (x, y)."""
    tree.meta[_COUNT] = 0
    _centre(tree, x, y)
    _occupy(tree, 0, x, y)
    tree.meta[_COUNT] = 1
    tree.cost[0] = 0.0


@kernel
def insert(tree: Tree, x: float, y: float, parent: int) -> int:
    """Add a node; returns its index, or -1 where the tree is full."""
    node = tree.meta[_COUNT]
    if node == tree.cost.shape[0]:
        return NONE
    _occupy(tree, node, x, y)
    tree.meta[_COUNT] = node + 1
    _link(tree, node, parent)
    tree.cost[node] = tree.cost[parent] + length(tree, parent, node)
    return int(node)


@kernel
def replace_leaf(tree: Tree, leaf: int, x: float, y: float, parent: int) -> None:
    """Forget a childless node other than `parent` and use its slot for a new one."""
    _unlink(tree, leaf)
    row, column = _cell(tree, tree.position[leaf, 0], tree.position[leaf, 1])
    if tree.head[row, column] == leaf:
        tree.head[row, column] = tree.following[leaf]
    else:
        node = tree.head[row, column]
        while tree.following[node] != leaf:
            node = tree.following[node]
        tree.following[node] = tree.following[leaf]
    _occupy(tree, leaf, x, y)
    _link(tree, leaf, parent)
    tree.cost[leaf] = tree.cost[parent] + length(tree, parent, leaf)


@kernel
def reparent(tree: Tree, node: int, parent: int) -> None:
    """Make `node` a child of `parent`, which must not lie below it, and update the costs below."""
    _unlink(tree, node)
    _link(tree, node, parent)
    _settle(tree, node)


@kernel
def detach(tree: Tree, node: int) -> None:
    """Cut `node` off its parent: it and all below it cost infinity."""
    _unlink(tree, node)
    _settle(tree, node)


@kernel
def advance(tree: Tree, executed: int, x: float, y: float, half: float) -> IntArray:
    """Forward pruning: the root becomes the node `executed` (0: stays) and moves to (x, y), where the robot is.

    What remains are exactly the descendants of `executed` that a chain of nodes within `half` [m] of (x, y) joins to
    it. Their costs are shifted to the new root. Detached nodes are forgotten.

    Returns:
        (n,) for each node that remains the index that it had before.
    """
    order = np.empty(tree.meta[_COUNT], np.int64)
    order[0] = executed
    kept, k = 1, 0
    while k < kept:
        node = tree.child[order[k]]
        while node != NONE:
            if math.hypot(tree.position[node, 0] - x, tree.position[node, 1] - y) <= half:
                order[kept] = node
                kept += 1
            node = tree.after[node]
        k += 1
    order = order[:kept]
    place = np.full(tree.meta[_COUNT], NONE, np.int64)
    position, parent, name = tree.position[order], tree.parent[order], tree.name[order]
    for k in range(kept):
        place[order[k]] = k
    _centre(tree, x, y)
    tree.meta[_COUNT] = 1
    _occupy(tree, 0, x, y)
    tree.cost[0] = 0.0
    for k in range(1, kept):  # parents come before their children
        insert(tree, position[k, 0], position[k, 1], place[parent[k]])
        tree.name[k] = name[k]
    return order


@kernel
def nearest(tree: Tree, x: float, y: float) -> int:
    """The connected node nearest to (x, y): rings of cells around it, until none can hold a nearer one."""
    cells, size = tree.head.shape[0], tree.frame[2]
    row, column = _cell(tree, x, y)
    best, square = 0, np.inf
    for ring in range(cells):
        if max(0, ring - 1) * size > math.sqrt(square):
            break
        for r in range(max(0, row - ring), min(cells, row + ring + 1)):
            rim = r == row - ring or r == row + ring
            stride = 1 if rim else max(1, 2 * ring)
            for c in range(column - ring, column + ring + 1, stride):
                if 0 <= c < cells:
                    node = tree.head[r, c]
                    while node != NONE:
                        d = (tree.position[node, 0] - x) ** 2 + (tree.position[node, 1] - y) ** 2
                        if d <= square and tree.cost[node] < np.inf and (d < square or node < best):
                            best, square = node, d
                        node = tree.following[node]
    return int(best)


@kernel
def neighbours(tree: Tree, x: float, y: float, radius: float, found: IntArray) -> int:
    """Write the nodes within `radius` [m] of (x, y) to `found` (N,), detached ones too; returns how many."""
    count = 0
    low_row, low_column = _cell(tree, x - radius, y - radius)
    high_row, high_column = _cell(tree, x + radius, y + radius)
    for r in range(low_row, high_row + 1):
        for c in range(low_column, high_column + 1):
            node = tree.head[r, c]
            while node != NONE:
                if (tree.position[node, 0] - x) ** 2 + (tree.position[node, 1] - y) ** 2 <= radius * radius:
                    found[count] = node
                    count += 1
                node = tree.following[node]
    return count


@kernel
def length(tree: Tree, a: int, b: int) -> float:
    """Of the edge between two nodes, m."""
    return math.hypot(tree.position[a, 0] - tree.position[b, 0], tree.position[a, 1] - tree.position[b, 1])


@kernel
def path(tree: Tree, leaf: int) -> IntArray:
    """The nodes from the root to a connected `leaf`, both included (k,)."""
    count, node = 1, leaf
    while tree.parent[node] != NONE:
        node = tree.parent[node]
        count += 1
    nodes = np.empty(count, np.int64)
    node = leaf
    for k in range(count - 1, -1, -1):
        nodes[k] = node
        node = tree.parent[node]
    return nodes


@kernel
def restore(tree: Tree, nodes: IntArray, names: IntArray) -> bool:
    """Make `nodes` (k,), which begin with the root, a path of the tree again; False: one of them, all of which had
    `names` (k,), is gone.
    """
    for k in range(nodes.shape[0]):
        if tree.name[nodes[k]] != names[k]:
            return False
    for k in range(1, nodes.shape[0]):  # from the root on: what is a parent now can't lie below its child
        if tree.parent[nodes[k]] != nodes[k - 1]:
            reparent(tree, nodes[k], nodes[k - 1])
    return True


@kernel
def edges(tree: Tree) -> FloatArray:
    """(n, 4) x0, y0, x1, y1 [m] of every edge between connected nodes."""
    n = tree.meta[_COUNT]
    out = np.empty((n, 4))
    count = 0
    for node in range(1, n):
        if tree.cost[node] < np.inf:
            out[count, :2] = tree.position[tree.parent[node]]
            out[count, 2:] = tree.position[node]
            count += 1
    return out[:count].copy()


@kernel
def _centre(tree: Tree, x: float, y: float) -> None:
    reach = 0.5 * tree.head.shape[0] * tree.frame[2]
    tree.frame[0], tree.frame[1] = x - reach, y - reach
    tree.head[:] = NONE


@kernel
def _cell(tree: Tree, x: float, y: float) -> tuple[int, int]:
    """Row and column of the cell that holds (x, y); of the nearest one beyond the grid."""
    last = tree.head.shape[0] - 1.0
    row = min(max(math.floor((y - tree.frame[1]) / tree.frame[2]), 0.0), last)
    column = min(max(math.floor((x - tree.frame[0]) / tree.frame[2]), 0.0), last)
    return int(row), int(column)


@kernel
def _occupy(tree: Tree, node: int, x: float, y: float) -> None:
    """A new node without relatives in slot `node`."""
    tree.position[node, 0], tree.position[node, 1] = x, y
    tree.parent[node] = tree.child[node] = tree.after[node] = tree.before[node] = NONE
    tree.blocked[node] = NONE
    tree.name[node] = tree.meta[_NAMES]
    tree.meta[_NAMES] += 1
    row, column = _cell(tree, x, y)
    tree.following[node] = tree.head[row, column]
    tree.head[row, column] = node


@kernel
def _link(tree: Tree, node: int, parent: int) -> None:
    first = tree.child[parent]
    tree.parent[node], tree.before[node], tree.after[node] = parent, NONE, first
    if first != NONE:
        tree.before[first] = node
    tree.child[parent] = node


@kernel
def _unlink(tree: Tree, node: int) -> None:
    parent, before, after = tree.parent[node], tree.before[node], tree.after[node]
    if parent == NONE:
        return
    if before == NONE:
        tree.child[parent] = after
    else:
        tree.after[before] = after
    if after != NONE:
        tree.before[after] = before
    tree.parent[node] = tree.before[node] = tree.after[node] = NONE


@kernel
def _settle(tree: Tree, top: int) -> None:
    """Costs of `top` and of all below it from its parent's."""
    tree.stack[0] = top
    count = 1
    while count > 0:
        count -= 1
        node = tree.stack[count]
        parent = tree.parent[node]
        tree.cost[node] = np.inf if parent == NONE else tree.cost[parent] + length(tree, parent, node)
        below = tree.child[node]
        while below != NONE:
            tree.stack[count] = below
            count += 1
            below = tree.after[below]
