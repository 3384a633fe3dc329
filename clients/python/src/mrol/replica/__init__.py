"""mrol.replica: a map inside this process.

    from mrol.replica import LocalMap, Replica

    replica = Replica("http://127.0.0.1:7334", "floor1")   # a copy of a server's map, which follows it
    replica.query(points).occupied                         # answered without a call

    m = LocalMap(resolution=0.05)                          # a map without any server
    m.insert(points)

Both are asked what `mrol.Map` is asked, as `mrol.Questions`. It needs the extension `mrol-replica`, of the same version as `mrol`.
"""

from .body import PreparedBody
from .failures import Closed, Forked, Refused, TooLarge
from .local_map import LocalMap
from .replica import Replica, ReplicaStatus

__all__ = ["Closed", "Forked", "LocalMap", "PreparedBody", "Refused", "Replica", "ReplicaStatus", "TooLarge"]
