"""The rigid fit against scipy's own solver of Wahba's problem."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.recordings.motion.rigid import fit


def test_the_fit_is_scipys() -> None:
    rng = np.random.default_rng(1)
    for m in (3, 4, 8):
        model = rng.normal(size=(m, 3)) * (0.3, 0.3, 0.1)
        seen = Rotation.random(50, rng=rng).as_matrix() @ model.T
        seen = seen.transpose(0, 2, 1) + rng.normal(size=(50, 1, 3)) + 0.01 * rng.normal(size=(50, m, 3))
        use = np.ones((50, m), dtype=bool)
        if m > 3:
            use[:25, 1] = False
        done = fit(np.where(use[:, :, None], seen, np.nan), model)
        for i in range(50):
            body, there = model[use[i]], seen[i][use[i]]
            right, distance = Rotation.align_vectors(there - there.mean(axis=0), body - body.mean(axis=0))
            np.testing.assert_allclose(done.rotation[i], right.as_matrix(), atol=1e-7)
            assert np.isclose(done.residual[i], distance / np.sqrt(len(body)), atol=1e-9)
