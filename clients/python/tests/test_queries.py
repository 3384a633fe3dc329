"""Occupancy, classification, listings and blocks."""

from typing import Any

import numpy as np
import pytest

import mrol

from .support.scenes import HALF_M, room
from .support.server import Server


def test_a_query_tells_each_point_in_the_shape_of_the_points(hall: mrol.Map) -> None:
    points = np.array([[[3.98, 0, 0], [0, 0, 0]], [[-3.98, 1, 0], [0.5, 0.5, 0.5]]])
    found = hall.query(points)
    assert found.occupied.tolist() == [[True, False], [True, False]]
    assert found.count == 2
    assert found.revision == hall.describe().revision
    assert found.map_uuid == hall.describe().map_uuid
    assert found.version.content_hash == hall.describe().version.content_hash
    one = hall.query([3.98, 0, 0])
    assert one.occupied.shape == ()
    assert bool(one.occupied)


def test_a_pose_places_the_points_in_the_map(hall: mrol.Map) -> None:
    placed = hall.query([[0, 0, 0], [1, 0, 0]], map_from_points=([3.98, 0, 0], [0, 0, 0, 1]))
    assert placed.occupied.tolist() == [True, False]
    turned = mrol.Pose.of(([0, 0, 0], [0, 0, np.sqrt(0.5), np.sqrt(0.5)]))
    assert hall.query([[0, -3.98, 0]], map_from_points=turned.matrix).occupied.all()


def test_levels_and_filters_answer_as_the_voxels_say(hall: mrol.Map) -> None:
    points = room(seed=9)[:2000]
    for level in (0, 2):
        listed = {tuple(index) for index in hall.voxels(level).indices.tolist()}
        width = hall.voxels(level).resolution_m
        expected = [tuple(index) in listed for index in np.floor(points * np.float32(1 / width)).astype(int).tolist()]
        assert hall.query(points, level=level).occupied.tolist() == expected
        by_filter = hall.query(points, level=level, lookup="bloom").occupied
        assert by_filter[np.array(expected)].all()


def test_a_query_waits_for_a_revision_of_the_map_that_it_means(hall: mrol.Map) -> None:
    here = hall.describe().version
    assert hall.query([[0, 0, 0]], min_revision=here.revision, map_uuid=here.map_uuid).revision == here.revision
    with pytest.raises(mrol.FailedPrecondition) as replaced:
        hall.query([[0, 0, 0]], map_uuid="00000000-0000-0000-0000-000000000000", min_revision=1)
    assert replaced.value.reason == "map_replaced"


def test_points_are_occupied_free_or_unknown(hall: mrol.Map) -> None:
    told = hall.classify([[3.98, 0, 0], [0.5, -1, 0], [30, 0, 0]])
    assert told.occupied.tolist() == [True, False, False]
    assert told.unknown[2]
    assert not (told.occupied & told.free).any()


def test_voxels_are_those_that_the_scan_hit(hall: mrol.Map) -> None:
    voxels = hall.voxels()
    assert len(voxels) == hall.count_voxels() == hall.describe().levels[0].voxels
    assert voxels.resolution_m == pytest.approx(0.1)
    assert hall.query(voxels.centers_m).occupied.all()
    assert (np.abs(voxels.centers_m) <= HALF_M + 0.1).all()
    boxed = hall.voxels(box=mrol.Box([3.5, -1, -1], [5, 1, 1]))
    expected = ((voxels.centers_m >= [3.5, -1, -1]) & (voxels.centers_m <= [5, 1, 1])).all(axis=1)
    assert {tuple(i) for i in boxed.indices.tolist()} == {tuple(i) for i in voxels.indices[expected].tolist()}
    turned = mrol.OrientedBox([4, 0, 0, 0, 0, 0, 1], [1, 2, 2])
    assert 0 < hall.count_voxels(box=turned) == len(hall.voxels(box=turned)) < len(voxels)
    assert len(hall.voxels(box=[[1, -1, -1], [1.1, -0.9, -0.9]])) == 0


def test_a_camera_sees_the_wall_in_front_of_it(hall: mrol.Map) -> None:
    # z forward along the map's x, x right along -y, y down along -z.
    map_from_camera = np.eye(4)
    map_from_camera[:3, :3] = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    seen = hall.voxels(view=mrol.View(map_from_camera, [1.0, 0.8], [0.1, 6]))
    assert len(seen) > 100
    assert (seen.centers_m[:, 0] > 1).all()


def test_blocks_hold_the_same_voxels_as_listings(hall: mrol.Map) -> None:
    for level in (0, 1):
        listed = {tuple(index) for index in hall.voxels(level).indices.tolist()}
        block = hall.block(level=level)
        assert {tuple(index) for index in block.indices().tolist()} == listed
        assert (block.level, block.resolution_m) == (level, pytest.approx(0.1 * 2**level))
    part = hall.block([[3, -1, -1], [5, 1, 1]])
    assert len(part.indices()) == hall.count_voxels(box=[[3, -1, -1], [5, 1, 1]])


def test_a_distance_field_is_zero_where_voxels_are(hall: mrol.Map) -> None:
    field = hall.distances([[3, -0.5, -0.4], [4.2, 0.5, 0.4]], cap_m=0.6)
    distances = field.distances_m()
    z, y, x = np.nonzero(field.quarters == 0)
    indices = np.stack([x, y, z], axis=1) + field.origin
    assert hall.query((indices + 0.5) * field.resolution_m).occupied.all()
    assert field.quarters.shape == (8, 10, 12)
    assert np.isinf(distances).any()
    assert distances[np.isfinite(distances)].max() < 0.6


def test_the_map_from_above_has_the_walls_and_the_post(hall: mrol.Map) -> None:
    grid = hall.grid(min_z_m=-1, max_z_m=1, band_from="map", cell_m=0.1, tell_unknown=True)
    assert grid.free is not None
    west, east, south, north = grid.extent_m
    row, column = (int((y - south) / grid.cell_m) for y in (0,)), int((3.98 - west) / grid.cell_m)
    assert grid.occupied[next(row), column]
    assert not (grid.occupied & grid.free).any()
    assert np.isfinite(grid.tops_m[grid.occupied]).all()
    assert np.isnan(grid.tops_m[~grid.occupied]).all()
    assert (east - west, north - south) == (pytest.approx(8.1, abs=0.2), pytest.approx(6.1, abs=0.2))
    part = hall.grid([[0, 0], [1, 2]])
    assert part.occupied.shape == (20, 10)
    assert part.free is None


def test_heights_of_a_grid_count_from_the_floor(hall: mrol.Map) -> None:
    told = hall.grid(min_z_m=0.1, max_z_m=1)
    assert told.floor_m is not None
    low, high = told.floor_m
    # Noise makes the floor of a room two or three voxels of a tenth of a meter thick.
    assert low <= high < low + 0.35
    of_map = hall.grid(min_z_m=0.1, max_z_m=1, band_from="map")
    assert of_map.floor_m is None
    assert (of_map.occupied.shape, of_map.occupied.sum()) != (told.occupied.shape, told.occupied.sum())
    assert hall.whole_grid(min_z_m=0.1, max_z_m=1).floor_m == told.floor_m


@pytest.mark.parametrize("tell_unknown", [False, True])
def test_a_whole_grid_of_tiles_is_the_grid_at_once(hall: mrol.Map, tell_unknown: bool) -> None:
    # Of 800 cells of a tenth of a meter along x: four tiles.
    band = {"min_z_m": -1, "max_z_m": 1, "band_from": "map"}
    options: dict[str, Any] = {"area": [[-40, -3], [40, 3]], **band, "tell_unknown": tell_unknown}
    tiles: list[tuple[int, int | None]] = []
    at_once, whole = hall.grid(**options), hall.whole_grid(**options, progress=lambda done, of: tiles.append((done, of)))
    assert len(tiles) > 1
    assert tiles[-1] == (len(tiles), len(tiles))
    assert (whole.version, whole.first_version) == (at_once.version, at_once.version)
    assert (whole.cell_m, whole.extent_m) == (at_once.cell_m, pytest.approx(at_once.extent_m))
    for name in ("occupied", "tops_m", "free"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(at_once, name))


def test_a_whole_grid_of_nothing_has_no_cells(hall: mrol.Map) -> None:
    assert hall.whole_grid(min_z_m=50, max_z_m=60, band_from="map").occupied.size == 0


def test_a_whole_grid_that_takes_more_memory_than_answers_may_says_so(hall: mrol.Map, server: Server) -> None:
    with mrol.connect(server.address, answer_bytes_max=10_000) as client, pytest.raises(mrol.BadAnswer, match="larger cells"):
        client.map(hall.name).whole_grid()


def test_observers_are_the_scans_that_touched_a_voxel(empty: mrol.Map) -> None:
    first = empty.insert([[1, 0, 0]], align=False, robot="r1")
    second = empty.insert([[1, 0, 0], [2, 0, 0]], align=False, guess=np.eye(4), robot="r2", timestamp_ns=5, force=True)
    seen = empty.observers([1, 0, 0])
    assert [(scan.robot, scan.revision, scan.scan_id) for scan in seen.scans] == [
        ("r2", second.revision, second.scan_id),
        ("r1", first.revision, first.scan_id),
    ]
    assert seen.scans[0].timestamp_ns == 5
    assert empty.observers(voxel=seen.voxel).voxel == seen.voxel
    assert empty.observers([50, 0, 0]).scans == ()
