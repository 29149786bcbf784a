from __future__ import annotations

import numpy as np
import pytest
from marker_scenes import EIGHT, FOUR, capture, circle, eight, path_length, straight, swap

from clearway.errors import ClearwayError
from clearway.geometry.shapes import FloatArray
from clearway.recordings.motion import base, rigid
from clearway.recordings.motion.markers import MarkerSet, learnt, motion_of_markers, resolve
from clearway.recordings.motion.motion import MotionSpec
from clearway.recordings.recording import Points

SPEC = MotionSpec()
NAMES = tuple(f"robot:{i + 1}" for i in range(8))


def off(pose: np.ndarray, truth: np.ndarray) -> np.ndarray:
    error = pose - truth
    error[:, 2] -= 2 * np.pi * np.round(np.nanmedian(error[:, 2]) / (2 * np.pi))
    return error


@pytest.mark.parametrize("path", [circle, eight])
def test_noise_gaps_and_a_swap_leave_a_tenth_of_a_millimetre(path) -> None:
    t, pose = path(2500)
    points = swap(capture(t, pose, rng=np.random.default_rng(1), gaps=0.02, extra=3), 1, 3, 500, 700)
    motion = motion_of_markers(points, MarkerSet(NAMES, EIGHT), SPEC, None)
    error = off(motion.pose, pose)
    assert np.sqrt((error[:, :2] ** 2).mean()) < 0.00015
    assert np.abs(error[:, :2]).max() < 0.001
    assert np.sqrt((error[:, 2] ** 2).mean()) < 0.0004
    assert path_length(motion.pose) == pytest.approx(path_length(pose), rel=0.0005)
    quality = motion.quality
    assert quality.noise == pytest.approx(0.0005, rel=0.03)
    assert quality.residual == pytest.approx(0.0005 * np.sqrt(18 / 8), rel=0.05)
    assert 180 <= quality.swapped <= 200  # where one of the two is hidden, it is left out
    assert quality.refused == 0
    assert quality.seen == 1
    assert quality.rate == pytest.approx(100)
    assert np.all(motion.velocity[500:-500, 0] > 0)


def test_learnt_markers_and_where_base_link_is_among_them() -> None:
    t, pose = eight(2500)
    rng = np.random.default_rng(2)
    points = capture(t, pose, rng=rng, gaps=0.02)
    own = learnt(points, MarkerSet(NAMES), SPEC)
    assert own.model is not None
    link = base_link(own.model)
    error = off(motion_of_markers(points, own, SPEC, link).pose, pose)
    assert np.abs(error[:, :2]).max() < 0.002
    assert np.abs(error[:, 2]).max() < 0.003


def test_a_learnt_frame_is_the_same_in_another_capture() -> None:
    sets = [
        learnt(capture(*path(2000), rng=np.random.default_rng(s), gaps=0.03), MarkerSet(NAMES), SPEC)
        for s, path in enumerate((circle, eight))
    ]
    np.testing.assert_allclose(sets[0].model, sets[1].model, atol=0.0002)


def test_coordinates_by_tape_don_t_make_the_pose_leap_when_markers_hide() -> None:
    t, pose = straight(3.0)
    rng = np.random.default_rng(3)
    points = capture(t, pose, rng=rng, gaps=0.1)
    taped = EIGHT + 0.002 * rng.standard_normal(EIGHT.shape)
    motion = motion_of_markers(points, MarkerSet(NAMES, taped), MotionSpec(cutoff=6), None)
    assert motion.quality.noise == pytest.approx(0.0005, rel=0.1)
    moved = off(motion.pose, pose)
    assert moved[:, :2].std(axis=0).max() < 0.0004  # one constant error, the tape's
    assert motion.sigma[:, 0].min() > 0.0005  # which the uncertainty holds
    assert any("mm off what was seen" in note for note in motion.notes)


def test_the_uncertainty_holds_what_it_says() -> None:
    """Over layouts, noises, headings, lever arms, hidden markers and coordinates by tape: 68 and 95 %."""
    scaled = []
    for draw in range(100):
        rng = np.random.default_rng(1000 + draw)
        noise = rng.uniform(0.0002, 0.001)
        markers = rng.normal(size=(int(rng.integers(4, 9)), 3)) * (0.25, 0.2, 0.2) + (*rng.uniform(-0.3, 0.3, 2), 0.6)
        if rigid.spread(markers, np.ones((1, len(markers)), dtype=bool))[0] < 0.05:
            continue
        t, pose = circle(160, radius=rng.uniform(0.7, 3), speed=rng.uniform(0.2, 1))
        points = capture(t, pose, markers, rng=rng, noise=noise, gaps=0.02)
        taped = markers + rng.uniform(0, 0.002) * rng.standard_normal(markers.shape)
        motion = motion_of_markers(points, MarkerSet(points.names, taped), MotionSpec(cutoff=6), None)
        i = int(rng.integers(160))
        scaled.append(off(motion.pose, pose)[i] / motion.sigma[i, [0, 0, 1]])
    inside = [(np.abs(scaled) < k).mean() for k in (1.0, 1.96)]
    assert 0.60 < inside[0] < 0.78
    assert 0.89 < inside[1] < 0.99


def test_the_uncertainty_of_noise_alone() -> None:
    """The same with coordinates that are right: 68 and 95 %."""
    scaled = []
    link = base_link(learnt_model())
    for draw in range(100):
        rng = np.random.default_rng(draw)
        t, pose = circle(160, radius=rng.uniform(0.7, 3), speed=rng.uniform(0.2, 1))
        points = capture(t, pose, rng=rng, noise=rng.uniform(0.0002, 0.001), gaps=0.02)
        motion = motion_of_markers(points, MarkerSet(points.names), MotionSpec(cutoff=6), link)
        i = int(rng.integers(160))
        scaled.append(off(motion.pose, pose)[i] / motion.sigma[i, [0, 0, 1]])
    inside = [(np.abs(scaled) < k).mean() for k in (1.0, 1.96)]
    assert 0.60 < inside[0] < 0.78
    assert 0.89 < inside[1] < 0.99


def base_link(model: np.ndarray) -> base.Base:
    """Where base_link is in the frame of `model`, EIGHT as a capture has them."""
    fitted = rigid.fit(model[None], EIGHT)
    return base.Base(fitted.rotation[0], fitted.translation[0], (0.0, 0.0), None, "by a fit")


def learnt_model() -> np.ndarray:
    """EIGHT in the frame that `learnt` gives it."""
    t, pose = circle(20)
    model = learnt(capture(t, pose), MarkerSet(NAMES), SPEC).model
    assert model is not None
    return model


def test_noise_that_lasts_is_not_averaged_away() -> None:
    """A capture's error changes from place to place, not from frame to frame."""
    rng = np.random.default_rng(4)
    t, pose = circle(3000)
    points = capture(t, pose)
    slow = np.empty((3000, 8, 3))
    slow[0] = rng.standard_normal((8, 3))
    for i in range(1, 3000):
        slow[i] = 0.95 * slow[i - 1] + np.sqrt(1 - 0.95**2) * rng.standard_normal((8, 3))
    sticky = motion_of_markers(
        Points(points.names, t, points.xyz + 0.0005 * slow), MarkerSet(NAMES, EIGHT), MotionSpec(cutoff=6), None
    )
    error = off(sticky.pose, pose)
    inside = (np.abs(error) < sticky.sigma[:, [0, 0, 1]]).mean()
    assert 0.55 < inside < 0.85
    assert sticky.sigma[1500, 0] > 0.0002


def test_a_body_seen_in_two_markers_is_unknown_there() -> None:
    t, pose = straight(3.0)
    points = capture(t, pose, rng=np.random.default_rng(5))
    points.xyz[300:400, 2:] = np.nan
    motion = motion_of_markers(points, MarkerSet(NAMES, EIGHT), SPEC, None)
    assert np.isnan(motion.pose[300:400]).all()
    assert np.isfinite(motion.pose[:300]).all()
    assert [(g.start, g.end, g.filled) for g in motion.quality.gaps] == [(2.99, 4.0, "")]
    points.xyz[:, 2:] = np.nan
    with pytest.raises(ClearwayError, match="never more than 2 of the markers"):
        motion_of_markers(points, MarkerSet(NAMES, EIGHT), SPEC, None)


def test_what_no_rigid_body_explains_is_counted_and_open() -> None:
    t, pose = straight(3.0)
    rng = np.random.default_rng(6)
    points = capture(t, pose, rng=rng)
    points.xyz[300:340] += 0.1 * rng.standard_normal((40, 8, 3))
    motion = motion_of_markers(points, MarkerSet(NAMES, EIGHT), SPEC, None)
    assert motion.quality.refused == 40
    assert np.isnan(motion.pose[300:340]).all()
    assert any("40 frames show no rigid body" in note for note in motion.notes)


def test_markers_that_are_no_body() -> None:
    rng = np.random.default_rng(7)
    points = Points(NAMES, np.arange(300) / 100, rng.uniform(-1, 1, (300, 8, 3)))
    with pytest.raises(ClearwayError, match=r"no rigid body of at least three markers.*more than 10 mm"):
        motion_of_markers(points, MarkerSet(NAMES), SPEC, None)
    with pytest.raises(ClearwayError, match="don't fit what was seen"):
        motion_of_markers(points, MarkerSet(NAMES, EIGHT), SPEC, None)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (1000.0 * EIGHT, "divided by 1000 they fit: are the coordinates or the recording in another unit"),
        (0.1 * EIGHT, "divided by 0.1 they fit"),
        (EIGHT * np.array([1.0, -1.0, 1.0]), "mirrored they fit: is the sign"),
        (np.roll(EIGHT, 1, axis=0), "would be right$"),
    ],
)
def test_the_usual_mistakes_in_coordinates_are_told(wrong: FloatArray, said: str) -> None:
    points = capture(*circle(300), rng=np.random.default_rng(8))
    with pytest.raises(ClearwayError, match=said):
        motion_of_markers(points, MarkerSet(NAMES, wrong), SPEC, None)


def test_the_wrong_coordinates_name_the_worst_marker() -> None:
    points = capture(*circle(300), rng=np.random.default_rng(8))
    wrong = EIGHT.copy()
    wrong[4] += (0.0, 0.0, 0.2)
    with pytest.raises(ClearwayError, match=r"plan.toml: robot: the coordinates.*'robot:5'"):
        motion_of_markers(points, MarkerSet(NAMES, wrong), SPEC, None, file="plan.toml", field="robot")


def test_markers_on_a_line_are_refused_with_what_would_be_right() -> None:
    line = np.array([(0.0, 0, 0.4), (0.2, 0.004, 0.4), (0.4, -0.004, 0.4), (0.6, 0, 0.4)])
    points = capture(*circle(300), line, rng=np.random.default_rng(9))
    with pytest.raises(ClearwayError, match=r"on a line to within \d\.\d mm.*at least 10 mm"):
        motion_of_markers(points, MarkerSet(points.names), SPEC, None)


def test_a_leaning_frame_is_said() -> None:
    t, pose = circle(500)
    points = capture(t, pose, rng=np.random.default_rng(10))
    tilted = Points(points.names, t, points.xyz[:, :, [0, 2, 1]] * (1, -1, 1))  # y up
    with pytest.raises(ClearwayError, match="is z up"):
        motion_of_markers(tilted, MarkerSet(NAMES, EIGHT), SPEC, None)
    lean = np.array([(1, 0, 0), (0, np.cos(0.1), -np.sin(0.1)), (0, np.sin(0.1), np.cos(0.1))])
    motion = motion_of_markers(Points(points.names, t, points.xyz @ lean.T), MarkerSet(NAMES, EIGHT), SPEC, None)
    assert any("leans by 5." in note for note in motion.notes), motion.notes


def test_names_and_prefixes() -> None:
    names = ("tiago:a", "tiago:b", "tiago:c", "box:a", "box:b", "Lamp")
    assert resolve(names, "tiago:") == ("tiago:a", "tiago:b", "tiago:c")
    assert resolve(names, ("tiago:c", "Lamp", "box:a")) == ("tiago:c", "Lamp", "box:a")
    for wanted, told in (
        ("tiagp:", "did you mean 'tiago:'"),
        (("tiago:a", "b", "tiago:c"), "did you mean 'tiago:b'"),
        (("tiago:a", "tiago:b", "lamp"), "did you mean 'Lamp'"),
        (("tiago:a", "tiago:a", "Lamp"), "named twice"),
        ("box:", r"2 markers \(box:a, box:b\) can't tell a body's pose; at least three"),
    ):
        with pytest.raises(ClearwayError, match=told) as caught:
            resolve(names, wanted, file="x.csv", field="robot.markers")
        assert (caught.value.file, caught.value.field) == ("x.csv", "robot.markers")
    with pytest.raises(ClearwayError, match="too many for one body"):
        resolve([f"a:{i}" for i in range(90)], "a:")


def test_an_obstacle_that_stands_is_a_point() -> None:
    t = np.arange(1000) / 100
    points = capture(t, np.tile((2.0, 1.0, 0.5), (1000, 1)), FOUR, rng=np.random.default_rng(11), gaps=0.02)
    motion = motion_of_markers(points, MarkerSet(points.names, FOUR), SPEC, None)
    assert path_length(motion.pose) < 0.001
    np.testing.assert_allclose(motion.pose.mean(axis=0), (2.0, 1.0, 0.5), atol=0.0003)
    assert motion.sigma[:, 0].max() < 0.0002


def test_a_single_frame() -> None:
    points = capture(np.zeros(1), np.zeros((1, 3)))
    motion = motion_of_markers(points, MarkerSet(NAMES, EIGHT), SPEC, None)
    np.testing.assert_allclose(motion.pose, 0, atol=1e-9)
    assert np.isnan(motion.velocity).all()


def test_no_frame_at_all() -> None:
    points = Points(NAMES, np.empty(0), np.empty((0, 8, 3)))
    with pytest.raises(ClearwayError, match="never more than 0"):
        motion_of_markers(points, MarkerSet(NAMES, EIGHT), SPEC, None)
    with pytest.raises(ClearwayError, match="no rigid body"):
        motion_of_markers(points, MarkerSet(NAMES), SPEC, None)


def test_the_residual_of_each_frame_is_the_rms_of_what_the_fit_leaves() -> None:
    corners = np.array([[0.2, 0.1, 0.1], [-0.15, 0.2, 0.3], [-0.1, -0.2, 0.2]])
    xyz = np.tile(corners, (400, 1, 1)) + np.random.default_rng(3).normal(0, 1e-4, (400, 3, 3))
    xyz[200, 0, 0] += 0.004  # one marker strays a little, in one frame
    points = Points(("a", "b", "c"), np.arange(400) / 100, xyz)
    motion = motion_of_markers(points, MarkerSet(points.names, corners), MotionSpec(), None)
    assert motion.residual is not None
    assert motion.residual.shape == (400,)
    assert int(np.nanargmax(motion.residual)) == 200
    assert motion.quality.residual_max == pytest.approx(float(np.nanmax(motion.residual)))
