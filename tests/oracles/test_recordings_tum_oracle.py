"""TUM trajectories against evo: path length and values, in both directions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clearway.recordings.formats import tum
from clearway.recordings.recording import Recording, Track, Want

file_interface = pytest.importorskip("evo.tools.file_interface")


def test_length_is_that_of_evo(tmp_path: Path):
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.01, 0.02, 500)) + 1.7e9
    angle = np.cumsum(rng.normal(0, 0.05, 500))
    position = np.cumsum(rng.normal(0, 0.01, (500, 3)), axis=0)
    q = np.column_stack((np.zeros((500, 2)), np.sin(angle / 2), np.cos(angle / 2)))
    made = Recording(tmp_path, "made", tracks={"robot": Track("pose", "map", "base_link", t, position, q)})
    tum.write(tmp_path / "a.tum", made)
    theirs = file_interface.read_tum_trajectory_file(str(tmp_path / "a.tum"))
    ours = tum.read(tmp_path / "a.tum", Want())
    track = ours.tracks["trajectory"]
    np.testing.assert_allclose(theirs.timestamps, track.t + ours.epoch, atol=1e-6)
    np.testing.assert_allclose(theirs.positions_xyz, track.position)
    np.testing.assert_allclose(np.roll(theirs.orientations_quat_wxyz, -1, axis=1), track.orientation, atol=1e-12)
    assert np.linalg.norm(np.diff(track.position, axis=0), axis=1).sum() == pytest.approx(theirs.path_length)
    # And the other way round.
    file_interface.write_tum_trajectory_file(str(tmp_path / "b.tum"), theirs)
    np.testing.assert_allclose(tum.read(tmp_path / "b.tum", Want()).tracks["trajectory"].position, position, atol=1e-8)
