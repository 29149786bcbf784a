"""The tube: by how much the constraints are tightened, (4) and (5).

(4) is a scalar tube: s+ = (1 - xi) s + w_bar bounds the distance of the robot from its nominal motion. Whether it does
depends on the ancillary gain: `benchmarks/tube.py` shows that, and which xi covers what the closed loop needs.
"""

from __future__ import annotations

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.geometry.shapes import FloatArray


@kernel
def tightening(bound: float, xi: float, steps: int, start: float) -> FloatArray:
    """(4) or (5): w_k for k = 0 .. `steps` [m].

    Args:
        bound: Growth in a period, w-bar, m.
        xi: Damping, in [0, 1].
        steps: Number of periods, N^P.
        start: The error w_0 that is known to be there already, m; 0 in the paper.
    """
    w = np.empty(steps + 1)
    w[0] = start
    for k in range(steps):
        w[k + 1] = (1.0 - xi) * w[k] + bound
    return w
