"""Static geometry: upload of meshes, and placement and removal of their instances as one change."""
from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import struct
from typing import Any, Callable, Iterator, Optional, Sequence, Tuple

from . import columns, schema
from .columns import FLOAT32, FLOAT64, UINT32, UINT64, ColumnLike, Values
from .errors import unreadable
from .values import Mesh, MeshPart

_Change = schema.message("ChangeInstancesRequest")
_Upload = schema.message("UploadMeshRequest")
_BYTES_A_MESSAGE = 12 * 87_040  # a little under 1 MiB; a multiple of 12, the size of a vertex and of a triangle

# Callback for the progress of an upload: receives the number of bytes sent so far, and the total number of bytes.
Progress = Callable[[int, int], None]


class InstanceChange:
    """Instances to remove and to place, as one atomic revision; removes are applied before placements. Methods return
    the change, so that calls can be chained.
    """

    def __init__(self) -> None:
        self.message = _Change()

    def remove(self, ids: ColumnLike) -> "InstanceChange":
        """Removes instances: uint64 ids. With an unknown id, the server refuses the whole change."""
        self.message.remove_ids += columns.encode("remove_ids", ids, UINT64)
        return self

    def remove_groups(self, groups: ColumnLike) -> "InstanceChange":
        """Removes every instance of each group: uint64 groups, not 0."""
        self.message.remove_groups += columns.encode("remove_groups", groups, UINT64)
        return self

    def place(self, mesh: str, translations: ColumnLike = (0.0, 0.0, 0.0), *, ids: ColumnLike = None,
              rotations: ColumnLike = None, scales: ColumnLike = None, layers: ColumnLike = None,
              groups: ColumnLike = None, tags: ColumnLike = None) -> "InstanceChange":
        """Places an uploaded mesh N times: world = translation + scale * (rotation * mesh).

        N is the number of `ids` (uint64, not 0), or, without `ids`, the number of `translations`; the server then
        chooses the ids. Every other column has N entries or one entry for all instances. `translations`: 3N float64;
        `rotations`: 4N float32, unit quaternions x, y, z, w, none = identity; `scales`: N float32, none = 1; `layers`:
        N uint32, none = bit 0; `groups`, `tags`: N uint64, none = 0.
        """
        path = f"place[{len(self.message.place)}]."
        with self._new_placement() as message:
            message.mesh = mesh
            message.ids = columns.encode(path + "ids", ids, UINT64)
            message.translations = columns.encode(path + "translations", translations, FLOAT64, 3)
            count = columns.entries(message.ids, UINT64) or columns.entries(message.translations, FLOAT64, 3)
            for name, value, kind, width in (
                    ("translations", message.translations, FLOAT64, 3), ("rotations", rotations, FLOAT32, 4),
                    ("scales", scales, FLOAT32, 1), ("layers", layers, UINT32, 1), ("groups", groups, UINT64, 1),
                    ("tags", tags, UINT64, 1)):
                setattr(message, name, columns.encode_for(path + name, value, kind, count, width))
        return self

    @contextlib.contextmanager
    def _new_placement(self) -> Iterator[Any]:
        message = self.message.place.add()
        try:
            yield message
        except Exception:
            del self.message.place[-1]
            raise


@dataclasses.dataclass(frozen=True)
class PlacedInstances:
    """Result of a change of instances. `revision` is the first revision that contains the change. With `no_wait` the
    server has accepted the change but not applied it yet, so `revision` is None.

    `ids`: uint64, one for each placed instance in the order of the request. `change` is the sequence number of the
    change within the epoch, from 1.
    """

    ids: Values
    change: int
    epoch: int
    revision: Optional[int]

    @classmethod
    def of(cls, message: Any) -> "PlacedInstances":
        """Converts the protocol's ChangeInstancesResponse."""
        revision = message.revision if message.HasField("revision") else None
        return cls(columns.decode(message.ids, UINT64), message.change, message.epoch, revision)


@dataclasses.dataclass(frozen=True)
class MeshColumns:
    """Mesh of V vertices and T triangles with its columns, as they were uploaded: `vertices` are 3V float32 in mesh
    axes, `indices` are 3T uint32.
    """

    mesh: Mesh
    vertices: Values
    indices: Values

    @classmethod
    def of(cls, pieces: Sequence[Any]) -> "MeshColumns":
        """Joins all messages of a download. Raises LocusError DATA_LOSS if the SHA-256 of the received columns differs
        from the SHA-256 of the mesh.
        """
        vertices = b"".join(piece.vertices for piece in pieces)
        indices = b"".join(piece.indices for piece in pieces)
        mesh = Mesh.of(pieces[0].mesh) if pieces else None
        if mesh is None or mesh_sha256(vertices, indices) != mesh.sha256:
            raise unreadable("the mesh is not whole")
        return cls(mesh, columns.decode(vertices, FLOAT32, 3), columns.decode(indices, UINT32, 3))


def mesh_sha256(vertices: bytes, indices: bytes) -> bytes:
    """Returns a mesh's content hash: the SHA-256 of the numbers of vertices and of triangles as uint32, the float32
    vertices and the uint32 indices, in this order.
    """
    digest = hashlib.sha256(struct.pack("<II", len(vertices) // 12, len(indices) // 12))
    digest.update(vertices)
    digest.update(indices)
    return digest.digest()


def upload_messages(name: str, vertices: ColumnLike, indices: ColumnLike, parts: Sequence[MeshPart],
                    progress: Optional[Progress]) -> Iterator[Any]:
    """Yields the messages of UploadMesh: first a message with counts and hash, then the columns in pieces below 1 MiB.
    """
    columns_: Tuple[Tuple[str, bytes], ...] = (("vertices", columns.encode("vertices", vertices, FLOAT32, 3)),
                                               ("indices", columns.encode("indices", indices, UINT32, 3)))
    raw = dict(columns_)
    opening = _Upload(mesh=name, sha256=mesh_sha256(raw["vertices"], raw["indices"]),
                      vertex_count=len(raw["vertices"]) // 12, triangle_count=len(raw["indices"]) // 12)
    for part in parts:
        opening.parts.add(name=part.name, first_triangle=part.first_triangle)
    return _pieces(opening, columns_, progress)


def _pieces(opening: Any, raw: Sequence[Tuple[str, bytes]], progress: Optional[Progress]) -> Iterator[Any]:
    yield opening
    sent, total = 0, sum(len(column) for _, column in raw)
    for name, column in raw:
        for begin in range(0, len(column), _BYTES_A_MESSAGE):
            piece = column[begin:begin + _BYTES_A_MESSAGE]
            yield _Upload(**{name: piece})
            sent += len(piece)
            if progress is not None:
                progress(sent, total)
