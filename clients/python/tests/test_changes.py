"""Deletions, keep-outs, map files, making and deleting maps."""

import time
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest

import mrol

GRID = np.stack(np.meshgrid(*[np.arange(5) + 0.05] * 3), axis=-1).reshape(-1, 3)


@pytest.fixture
def cube(empty: mrol.Map) -> mrol.Map:
    """A map of 125 voxels, a meter apart."""
    assert empty.insert(GRID, align=False).new_voxels == 125
    return empty


def test_voxels_go_by_points_indices_and_regions(cube: mrol.Map) -> None:
    assert cube.delete(GRID[:2]).removed == 2
    assert cube.delete(voxels=cube.voxels().indices[:3]).removed == 3
    assert cube.delete(box=[[3.5, -np.inf, -np.inf], [np.inf, np.inf, np.inf]]).removed > 20
    assert cube.delete(sphere=([2.05, 2.05, 2.05], 0.3)).removed == 1
    assert cube.delete(sphere=mrol.Sphere([1.05, 2.05, 2.05], 0.3)).removed == 1
    turned = mrol.OrientedBox(([0.05, 2.05, 2.05], [0, 0, 0.6, 0.8]), [0.4, 0.4, 0.4])
    assert cube.delete(oriented_box=turned).removed == 1
    assert cube.delete(box=mrol.Box([-9, -9, -9], [9, 9, 9])).revision == cube.describe().revision
    assert cube.count_voxels() == 0


def test_a_deletion_is_done_once_and_undone(cube: mrol.Map) -> None:
    deleted = cube.delete(box=[[0, 0, 0], [1.5, 9, 9]], request_id="d1")
    again = cube.delete(box=[[0, 0, 0], [1.5, 9, 9]], request_id="d1")
    assert (again.replayed, again.removed, again.revision) == (True, deleted.removed, deleted.revision)
    assert cube.undo(deleted).restored == deleted.removed
    with pytest.raises(mrol.Conflict) as taken:
        cube.delete(box=[[0, 0, 0], [2.5, 9, 9]], request_id="d1")
    assert taken.value.reason == "request_id_taken"


def test_what_was_seen_since_stays(cube: mrol.Map) -> None:
    kept = cube.delete(box=[[0, 0, 0], [9, 9, 9]], not_seen_since=0)
    assert kept.removed == 0
    with pytest.raises(mrol.InvalidArgument) as refused:
        cube.delete(box=[[0, 0, 0], [9, 9, 9]], not_seen_since=99)
    assert refused.value.reason == "bad_revision"


def test_a_deletion_has_one_target(cube: mrol.Map) -> None:
    with pytest.raises(mrol.ArgumentError, match="exactly one of points, voxels, box"):
        cube.delete()
    with pytest.raises(mrol.ArgumentError, match="got points and box"):
        cube.delete(GRID, box=[[0, 0, 0], [1, 1, 1]])
    with pytest.raises(mrol.ArgumentError, match="whole numbers"):
        cube.delete(voxels=[[0.5, 0, 0]])


def test_keep_outs_of_every_shape_come_back_as_they_were_put(empty: mrol.Map) -> None:
    empty.keep_out("a", box=[[0, 0, 0], [1, 2, 3]])
    empty.keep_out("b", sphere=([1, 2, 3], 0.5))
    empty.keep_out("c", oriented_box=mrol.OrientedBox([1, 2, 3, 0, 0, 0, 1], [1, 1, 2]))
    change = empty.keep_out("d", prism=mrol.Prism([[0, 0], [1, 0], [0, 1]], -1, 2), request_id="k1")
    assert empty.keep_out("d", prism=mrol.Prism([[0, 0], [1, 0], [0, 1]], -1, 2), request_id="k1").replayed
    listed = {of.name: of for of in empty.keep_outs().keep_outs}
    box, sphere, turned, prism = (listed[name].shape for name in "abcd")
    assert isinstance(box, mrol.Box)
    assert box.corners() == ([0, 0, 0], [1, 2, 3])
    assert isinstance(sphere, mrol.Sphere)
    assert sphere.radius_m == 0.5
    assert isinstance(turned, mrol.OrientedBox)
    np.testing.assert_allclose(mrol.Pose.of(turned.map_from_box).translation_m, [1, 2, 3])
    assert isinstance(prism, mrol.Prism)
    np.testing.assert_allclose(prism.corners_m, [[0, 0], [1, 0], [0, 1]])
    assert listed["d"].made_revision == change.revision
    assert empty.remove_keep_out("d").revision == change.revision + 1
    with pytest.raises(mrol.NotFound) as gone:
        empty.remove_keep_out("d")
    assert gone.value.reason == "keep_out_not_found"


def test_a_keep_out_ends_when_its_time_has_come(empty: mrol.Map) -> None:
    soon = datetime.now(timezone.utc) + timedelta(seconds=1)
    empty.keep_out("short", sphere=([0, 0, 0], 1), expires_at=soon)
    (listed,) = empty.keep_outs().keep_outs
    assert listed.expires_at_ns == pytest.approx(soon.timestamp() * 1e9, abs=1e6)
    end = time.monotonic() + 20
    while empty.keep_outs().keep_outs and time.monotonic() < end:
        time.sleep(0.05)
    assert empty.keep_outs().keep_outs == ()
    with pytest.raises(mrol.ArgumentError, match="a time with a zone"):
        empty.keep_out("bad", sphere=([0, 0, 0], 1), expires_at=datetime(2099, 1, 1))  # noqa: DTZ001
    with pytest.raises(mrol.InvalidArgument) as past:
        empty.keep_out("bad", sphere=([0, 0, 0], 1), expires_at=1)
    assert past.value.reason == "bad_expiry"


def test_a_map_is_written_to_a_file_and_made_from_one(client: mrol.Client, cube: mrol.Map, tmp_path: Path) -> None:
    told: list[tuple[int, int | None]] = []
    file = tmp_path / "cube.mrol"
    file.write_bytes(b"what was there")
    version = cube.snapshot(file, progress=lambda done, total: told.append((done, total)))
    assert version == cube.describe().version
    assert told[-1] == (file.stat().st_size, file.stat().st_size)
    assert [entry.name for entry in tmp_path.iterdir()] == ["cube.mrol"]
    cube.delete(box=[[-9, -9, -9], [9, 9, 9]])
    before = cube.describe().revision
    told.clear()
    restored = cube.restore(file, progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (file.stat().st_size, file.stat().st_size)
    assert restored.version.content_hash == version.content_hash
    aside = f"{cube.name}-replaced-{before}"
    assert aside in [of.name for of in client.maps().maps]
    client.delete_map(aside)
    with pytest.raises(mrol.Conflict) as there:
        cube.restore(file.read_bytes(), replace=False)
    assert there.value.reason == "map_exists"
    other = client.restore(f"{cube.name}-2", file.read_bytes(), progress=True)
    assert other.count_voxels() == 125
    client.delete_map(other.name)


def test_a_map_is_renamed(client: mrol.Client, cube: mrol.Map) -> None:
    before = cube.describe().version
    renamed = client.rename_map(cube.name, "renamed")
    assert renamed.name == "renamed"
    assert renamed.describe().version == before
    with pytest.raises(mrol.NotFound):
        cube.describe()
    with pytest.raises(mrol.Conflict) as taken:
        client.rename_map("renamed", "renamed")
    assert taken.value.reason == "map_exists"
    with pytest.raises(mrol.InvalidArgument, match="to"):
        client.rename_map("renamed", "Not a name")
    client.rename_map("renamed", cube.name)
    assert cube.describe().version == before


def test_files_that_are_none_are_refused(client: mrol.Client, cube: mrol.Map, tmp_path: Path) -> None:
    for bad in (b"", b"no map file at all" * 1000):
        (tmp_path / "bad").write_bytes(bad)
        with pytest.raises(mrol.InvalidArgument) as refused:
            client.restore("never", tmp_path / "bad")
        assert refused.value.reason == "bad_map_file"
    with pytest.raises(mrol.ArgumentError, match="source must be the path of a map file"):
        client.restore("never", tmp_path / "nowhere")
    with pytest.raises(FileNotFoundError):
        cube.snapshot(tmp_path / "no-folder" / "x.mrol")
    assert cube.count_voxels() == 125


def test_maps_are_made_described_listed_and_deleted(client: mrol.Client) -> None:
    settings = mrol.FilterSettings(hashes=3, bits_per_key=10.0)
    made = client.map("made", resolution=0.2, levels=3, filter=settings, moments=False, robot="r9")
    info = made.describe()
    assert (info.name, info.resolution_m, len(info.levels), info.moments) == ("made", 0.2, 3, False)
    assert info.filter == settings
    assert info.voxels.tolist() == [0, 0, 0]
    assert info.storage is not None
    assert made.robot == "r9"
    assert made.with_robot("r8").insert([[1, 1, 1]], align=False).robot == "r8"
    assert made.describe().robots == ("r8",)
    assert made.describe().sightings[0].robot == "r8"
    assert client.map("made").describe().scans == 1
    assert client.map("made", resolution=0.2, levels=3, filter=settings, moments=False).describe().scans == 1
    with pytest.raises(mrol.Conflict) as other:
        client.map("made", resolution=0.3)
    assert other.value.reason == "map_exists"
    assert client.map("bare", resolution=0.2, filter="none").describe().filter is None
    surveyed = client.map("surveyed", resolution=0.2, origin=[388096.5, 3948996, 12]).describe()
    assert surveyed.origin_m is not None
    assert surveyed.origin_m.tolist() == [388096.5, 3948996.0, 12.0]
    with pytest.raises(mrol.ArgumentError, match="origin must be 3 finite numbers"):
        client.map("surveyed", resolution=0.2, origin=[0, np.inf, 0])
    client.delete_map("surveyed")
    assert {"made", "bare"} <= {of.name for of in client.maps().maps}
    for name in ("made", "bare"):
        client.delete_map(name)
    with pytest.raises(mrol.NotFound) as gone:
        client.map("made")
    assert gone.value.reason == "map_not_found"


def test_a_server_tells_its_health_and_metrics(client: mrol.Client) -> None:
    assert client.health().ready
    assert "mrol_" in client.metrics()
    assert client.with_timeout(5).health().reason is None
