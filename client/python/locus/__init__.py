"""Python client of locusd, exact spatial queries as a service: scenes, updates and queries in columns.

Start at locus.connect(). Columns go in as numpy arrays, array.array, other buffers or lists, and come out as numpy
arrays, or array.array where numpy is not installed.
"""
import pkgutil

# Modules that protoc makes of the protocol's files lie in a folder `locus/v1`: let both be imported side by side.
__path__ = pkgutil.extend_path(__path__, __name__)

from .client import DEFAULT_ADDRESS, Client, connect
from .columns import ColumnLike, Values
from .connection import Retry
from .enums import (Column, Cull, Inside, OutsideHistory, OverloadPolicy, Precision, RayMode, Reason, SceneState, Source,
                    StaticDetail, Winding)
from .errors import LocusError
from .meshes import InstanceChange, MeshColumns, PlacedInstances
from .queries import Block, QueryBatch
from .query_stream import QueryStream
from .results import NO_TRIANGLE, BlockResult, QueryResult
from .update_stream import UpdateStream
from .updates import UpdateBatch
from .values import Ack, ItemError, Limit, Mesh, MeshPart, Revision, Scene, Server, Work

__all__ = [
    "Ack", "Block", "BlockResult", "Client", "Column", "ColumnLike", "Cull", "DEFAULT_ADDRESS", "Inside",
    "InstanceChange", "ItemError", "Limit", "LocusError", "Mesh", "MeshColumns", "MeshPart", "NO_TRIANGLE",
    "OutsideHistory", "OverloadPolicy", "PlacedInstances", "Precision", "QueryBatch", "QueryResult", "QueryStream",
    "RayMode", "Reason", "Retry", "Revision", "Scene", "SceneState", "Server", "Source", "StaticDetail",
    "UpdateBatch", "UpdateStream", "Values", "Winding", "Work", "connect",
]
