"""Checks of bodies and motions, rays, nearest voxels, frontiers."""

import numpy as np
import pytest

import mrol

BALL = [[0.0, 0.0, 0.0, 0.3]]
IN_WALL = [3.9, -1.0, 0.0]
CLEAR = [0.0, -1.0, 0.0]


def at(*position: float) -> mrol.Pose:
    """A pose that is not turned."""
    return mrol.Pose.of(([*position], [0, 0, 0, 1]))


def test_poses_are_taken_in_every_form(hall: mrol.Map) -> None:
    expected = [True, False]
    matrices = np.stack([at(*IN_WALL).matrix, at(*CLEAR).matrix])
    sevens = np.array([at(*IN_WALL).seven(), at(*CLEAR).seven()])
    for given in ([IN_WALL, CLEAR], matrices, matrices.astype("f4"), sevens, [at(*IN_WALL), at(*CLEAR)]):
        found = hall.check_poses(BALL, given)
        assert found.colliding.tolist() == expected
        assert found.fits.tolist() == [False, True]
        assert found.count == 1
    assert hall.check_poses(BALL, matrices.reshape(2, 1, 4, 4)).colliding.shape == (2, 1)
    assert hall.check_poses(BALL, at(*CLEAR)).colliding.shape == ()


def test_a_body_of_links_has_a_pose_for_each(hall: mrol.Map) -> None:
    body = mrol.Body([mrol.Link(spheres=BALL), mrol.Link(points=[[0, 0, 0]], padding_m=0.1)])
    configurations = np.array([[CLEAR, IN_WALL], [CLEAR, CLEAR], [IN_WALL, CLEAR]])
    found = hall.check_poses(body, configurations, answer="first_hit")
    assert found.colliding.tolist() == [True, False, True]
    assert found.first_hits is not None
    assert found.first_hits.links.tolist() == [1, -1, 0]
    assert found.first_hits.parts.tolist() == [0, -1, 0]
    assert hall.query((found.first_hits.voxels[0] + 0.5) * 0.1).occupied
    with pytest.raises(mrol.ArgumentError, match="the body has 2 links"):
        hall.check_poses(body, [CLEAR, CLEAR, CLEAR])


def test_clearance_is_the_distance_to_the_wall(hall: mrol.Map) -> None:
    found = hall.check_poses(BALL, [[3.0, -1.0, 0.0], CLEAR, IN_WALL], answer="clearance", clearance_max_m=0.9)
    assert found.clearances is not None
    assert found.clearances.clearances_m[0] == pytest.approx(0.6, abs=0.11)
    assert found.clearances.clearances_m[1] == pytest.approx(0.9)
    assert found.clearances.clearances_m[2] <= 0
    assert found.clearances.nearest_links.tolist() == [0, -1, 0]
    assert found.first_hits is None


def test_what_is_ignored_or_unknown_is_told(hall: mrol.Map) -> None:
    around = mrol.Sphere(IN_WALL, 1.0)
    assert hall.check_poses(BALL, [IN_WALL], ignored=[around]).count == 0
    assert hall.check_poses(BALL, [IN_WALL], ignored=[mrol.Box([3, -2, -1], [5, 0, 1])]).count == 0
    turned = mrol.OrientedBox(at(*IN_WALL), [2, 2, 2])
    assert hall.check_poses(BALL, [IN_WALL], ignored=[turned]).count == 0
    outside = [20.0, 0.0, 0.0]
    assert hall.check_poses(BALL, [outside]).count == 0
    assert hall.check_poses(BALL, [outside], unknown="occupied").count == 1


def test_spheres_are_checked_alone_or_in_groups(hall: mrol.Map) -> None:
    spheres = np.array([[*IN_WALL, 0.3], [*CLEAR, 0.3], [*CLEAR, 0.1]])
    assert hall.check_spheres(spheres).colliding.tolist() == [True, False, False]
    groups = hall.check_spheres(spheres, sizes=[2, 1], answer="first_hit")
    assert groups.colliding.tolist() == [True, False]
    with pytest.raises(mrol.ArgumentError, match=r"sizes must be counts of all 3 spheres, got a sum of 2"):
        hall.check_spheres(spheres, sizes=[1, 1])
    assert hall.check_spheres([[3.0, -1.0, 0.0, 0.3]], padding_m=0.8).count == 1


def test_motions_are_free_or_meet_something_on_the_way(hall: mrol.Map) -> None:
    edges = np.array([[CLEAR, [3.9, -1, 0]], [CLEAR, [1, -1, 0]]])
    found = hall.check_motions(BALL, edges, clearance_max_m=1.0)
    assert found.free.tolist() == [False, True]
    assert found.count == 1
    assert found.first_hits[0] == pytest.approx(3.65 / 3.9, abs=0.05)
    assert np.isnan(found.first_hits[1])
    assert found.clearances_m is not None
    assert found.clearances_m[1] > 0.3
    unequal = hall.check_motions(BALL, [CLEAR, [1, -1, 0], [1, -2, 0], CLEAR, IN_WALL], lengths=[3, 2], step_m=0.01)
    assert unequal.free.tolist() == [True, False]
    assert unequal.clearances_m is None
    with pytest.raises(mrol.ArgumentError, match="lengths must be counts of all 5 configurations"):
        hall.check_motions(BALL, [CLEAR] * 5, lengths=[2, 2])


def test_rays_end_at_the_walls(hall: mrol.Map) -> None:
    origin = [0.0, -1.0, 0.0]
    found = hall.cast_rays(origin, [[1, 0, 0], [-1, 0, 0], [0, 0, 1]], range_m=3.99)
    assert found.hit.tolist() == [True, True, True]
    np.testing.assert_allclose(found.distances_m, [3.95, 3.95, 1.45], atol=0.06)
    assert found.voxels.shape == (3, 3)
    short = hall.cast_rays([origin, origin], ends=[[1, -1, 0], [9, -1, 0]])
    assert short.hit.tolist() == [False, True]
    assert np.isinf(short.distances_m[0])
    with pytest.raises(mrol.ArgumentError, match="directions must be the only one of them"):
        hall.cast_rays(origin)
    with pytest.raises(mrol.InvalidArgument) as refused:
        hall.cast_rays(origin, [[2, 0, 0]])
    assert refused.value.reason == "bad_ray"


def test_the_nearest_voxel_and_the_way_from_it(hall: mrol.Map) -> None:
    found = hall.nearest([[3.5, -1, 0], CLEAR], 1.0)
    assert found.found.tolist() == [True, False]
    assert found.distances_m[0] == pytest.approx(0.45, abs=0.11)
    np.testing.assert_allclose(found.away[0], [-1, 0, 0], atol=0.2)
    assert hall.nearest([[3.5, -1, 0]], 1.0, to="centers").distances_m[0] > found.distances_m[0]


def test_keep_outs_count_and_are_named(hall: mrol.Map) -> None:
    hall.keep_out("spill", box=[[-0.5, -1.5, -1], [0.5, -0.5, 1]])
    hits = hall.check_poses(BALL, [CLEAR, IN_WALL], answer="first_hit").first_hits
    assert hits is not None
    assert hits.keep_outs.tolist() == ["spill", None]
    assert hall.check_poses(BALL, [CLEAR], ignore_keep_outs=True).count == 0
    assert hall.cast_rays([-2, -1, 0], [[1, 0, 0]]).keep_outs.tolist() == ["spill"]
    assert hall.nearest([[-1, -1, 0]], 1.0).keep_outs.tolist() == ["spill"]
    assert not hall.query([CLEAR]).occupied[0]
    assert hall.query([CLEAR], keep_out=True).occupied[0]
    assert hall.classify([CLEAR]).occupied[0]


def test_frontiers_have_views(hall: mrol.Map) -> None:
    found = hall.frontiers([[-5, -4, -2], [5, 4, 2]], size_min=1, frontiers_max=3, standoff_m=0.5)
    assert found.frontiers_total >= len(found.frontiers)
    for frontier in found.frontiers:
        assert frontier.voxels >= 1
        assert (frontier.min_m <= frontier.center_m).all()
        if frontier.view is not None:
            assert frontier.view.map_from_view.matrix.shape == (4, 4)
    with pytest.raises(mrol.ArgumentError, match=r"box.max_m must be a finite number, got inf"):
        hall.frontiers([[0, 0, 0], [np.inf, 1, 1]])
