"""mrol_replica: a map inside this process.

    import mrol_replica

    replica = mrol_replica.Replica("http://127.0.0.1:7334", "floor1")   # a copy of a server's map, which follows it
    replica.query(points).occupied                                      # answered without a call

    m = mrol_replica.LocalMap(resolution=0.05)                          # a map without any server
    m.insert(points)

Both take and give what the methods of `mrol.Map` do. `pip install mrol[replica]` installs it beside `mrol`.
"""

from ._questions import PreparedBody
from .local_map import LocalMap
from .replica import Replica, ReplicaStatus

__version__ = "0.2.0"

__all__ = ["LocalMap", "PreparedBody", "Replica", "ReplicaStatus"]
