"""Replicas that are given the addresses of several servers."""

import time
from pathlib import Path

import pytest

import mrol
import mrol.replica

from ..support.server import serving


def test_a_replica_goes_on_at_the_next_address_when_a_server_is_gone(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    with serving(tmp_path / "one") as one, serving(tmp_path / "two") as two:
        maps = [mrol.connect(server.address).map("m", resolution=0.1) for server in (one, two)]
        for m in maps:
            m.insert([[1, 0, 0]], align=False)
        with mrol.replica.Replica([one.grpc, two.grpc], "m") as replica:
            assert replica.status.version.map_uuid == maps[0].describe().map_uuid
            one.kill()
            # The map of that name is another one there, and is copied anew.
            end = time.monotonic() + 20
            while replica.status.version.map_uuid != maps[1].describe().map_uuid:
                assert time.monotonic() < end, replica.status
                time.sleep(0.05)
            second = maps[1].insert([[2, 0, 0]], align=False, guess=mrol.Pose.identity(), force=True)
            replica.wait_for_revision(second.revision)
            assert replica.query([[2, 0, 0]]).occupied.all()
        with mrol.replica.Replica(f"{one.grpc}, {two.grpc}", "m") as replica:
            assert replica.revision == second.revision
    with pytest.raises(mrol.ArgumentError) as refused:
        mrol.replica.Replica(f"{one.grpc},http://u:SECRET@h", "m")
    assert "SECRET" not in str(refused.value)
