"""Python client of locusd, a server for exact spatial queries: scenes, updates and queries in columns.

Start at locus.connect(), or at locus.embedded() for a server of one's own. Columns are given as numpy arrays,
array.array, other buffers or lists, and returned as numpy arrays, or array.array if numpy is not installed.
"""
import pkgutil

# Extend the path of this package: the modules that protoc generates from the protocol are in `locus/v1` of another
# folder that is also called `locus`. With the extended path, one process can import both.
__path__ = pkgutil.extend_path(__path__, __name__)

from .client import DEFAULT_ADDRESS, Client, connect
from .columns import ColumnLike, Values
from .compounds import Compound
from .connection import Retry
from .embedded import EmbeddedClient, embedded
from .enums import (AtStart, ClipDepth, Column, Cull, Durability, Inside, OutsideHistory, OverloadPolicy, Precision, RayMode,
                    Reason, SceneRole, SceneState, Source, StaticDetail, Winding)
from .environment import connect_from_environment
from .errors import LocusError
from .meshes import InstanceChange, MeshColumns, PlacedInstances
from .queries import After, Block, QueryBatch
from .query_stream import QueryStream
from .results import NO_TRIANGLE, BlockResult, QueryResult, StepResult
from .routes import ReadFrom
from .update_stream import UpdateStream
from .updates import UpdateBatch
from .values import (Ack, Cluster, Follower, ItemError, Leadership, Limit, Member, Mesh, MeshPart, Placement, Quota, Revision,
                     Scene, Server, Work)

__all__ = [
    "Ack", "After", "AtStart", "Block", "BlockResult", "Client", "ClipDepth", "Cluster", "Column", "ColumnLike",
    "Compound", "Cull", "DEFAULT_ADDRESS", "Durability", "EmbeddedClient", "Follower", "Inside", "InstanceChange",
    "ItemError", "Leadership", "Limit", "LocusError", "Member", "Mesh", "MeshColumns", "MeshPart", "NO_TRIANGLE",
    "OutsideHistory", "OverloadPolicy", "PlacedInstances", "Placement", "Precision", "QueryBatch", "QueryResult",
    "QueryStream", "Quota", "RayMode", "ReadFrom", "Reason", "Retry", "Revision", "Scene", "SceneRole", "SceneState",
    "Server", "Source", "StaticDetail", "StepResult", "UpdateBatch", "UpdateStream", "Values", "Winding", "Work",
    "connect", "connect_from_environment", "embedded",
]
