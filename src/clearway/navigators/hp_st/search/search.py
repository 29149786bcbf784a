"""Ways through space and time: a beam search over the robot's own motions, layer by layer.

All nodes of a layer lie at the same instant, so obstacles are where their forecasts say for that instant and no belt
covers what is past. A node's children are arcs that the base can drive in one step. A child is worth the time that has
gone, the time that it still takes to the goal past what stands (`field`), and what it risks: the probability of contact
with each forecast obstacle on the way, in seconds that we'd give to avoid it. Of the children of a layer the best of
each cell of (x, y, heading, direction of travel) stays, of these the best `beam`, and the best of each sector around the
start: ways to all sides, and those that wait, thus stay in play while another looks better. At a tenth of the nodes that
finds as cheap ways among obstacles as the best alone would.
"""

from __future__ import annotations

import math

import numpy as np

from clearway.geometry.compiled import kernel, light
from clearway.navigators.hp_st.environment.contact import STEPS, room_around
from clearway.navigators.hp_st.environment.field import look_at
from clearway.navigators.hp_st.search.layer import SECTORS, Front, Problem, expand, keep_best, room_for
from clearway.navigators.hp_st.search.tree import COST, TOTAL, Tree, X, Y

_SHARE = 20
"""Of each sector a node is kept for each so many of the beam, and at least one."""


@light
def nodes_of(beam: int) -> int:
    """How many nodes a layer has at most: the best `beam`, and a share for each sector."""
    return beam + SECTORS * max(1, beam // _SHARE)


@kernel
def search(problem: Problem, layers: int, beam: int, dear: float) -> Tree:
    """Search `layers` layers ahead, with the best `beam` nodes of each and some of each sector; no farther once all ways risk more
    than `dear` [s].

    Raises:
        ValueError: it is to try more than there is room for.
    """
    if len(problem.controls) + 3 > STEPS:  # what a node tries beside them, see `expand`
        raise ValueError("more controls are to be tried than contact.STEPS has room for: at most STEPS - 3")
    start, field = problem.start, problem.field
    quota, size = max(1, beam // _SHARE), nodes_of(beam)
    if not problem.costs.sectors:
        beam, quota = size, 0
    tree = Tree(
        np.empty((layers + 1, size, 7)), np.zeros((layers + 1, size), np.int64), np.zeros((layers + 1, size, 2)),
        np.zeros(layers + 1, np.int64), np.array((-1.0, -1.0, math.inf)),
    )  # fmt: skip
    tree.nodes[0, 0, :5] = start
    tree.nodes[0, 0, COST], tree.nodes[0, 0, TOTAL] = 0.0, 0.0
    tree.count[0] = 1
    children = room_for(size * (len(problem.controls) + 3))
    nearby = room_around(problem.obstacles)
    first, _, _ = look_at(field.distance, field.hidden, field.origin, field.resolution, field.goal, start[X], start[Y])
    front = Front(0, math.inf)
    for k in range(layers):
        found, front = expand(problem, tree, k, first, front, children, nearby)
        hinted = keep_best(tree, k, children, found, beam, quota, front.hinted)
        front = Front(hinted, front.best)
        m = tree.count[k + 1]
        if m == 0 or (tree.goal[0] < 0.0 and tree.nodes[k + 1, :m, COST].min() > dear):
            break
    return tree
