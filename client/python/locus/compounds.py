"""Shapes of compounds: balls, boxes and capsules that move as one object, in columns."""
from __future__ import annotations

from typing import Any

from . import columns, schema
from .columns import FLOAT32, UINT32, ColumnLike

_Insert = schema.message("Insert")


class Compound:
    """Shape of compounds, such as the hit boxes of a player: up to 64 parts in the object's own axes.

    Parts are numbered from 0 in the order of the calls, and within a call in the order of its columns. Answers name the
    part in the column of triangles. N is the number of positions of a call: 3N float32, the centres of the parts
    relative to the object's position. Every other column has N entries, one entry for all, or none, which means its
    default. `rotations` are 4N float32, unit quaternions x, y, z, w from a part's own axes to the object's axes (none =
    identity). `layers` are N uint32: a part is in those layers that both the part and its object have (none = all).

    Columns are checked for type and length here, values and the number of parts by the server. Methods return the
    compound, so that calls can be chained. A compound can be used in any number of batches. Not thread-safe.
    """

    def __init__(self) -> None:
        self.message = _Insert().compound
        self._size = 0

    def __len__(self) -> int:
        """Returns the number of parts."""
        return self._size

    def balls(self, positions: ColumnLike, radii: ColumnLike, *, rotations: ColumnLike = None,
              layers: ColumnLike = None) -> "Compound":
        """Adds N solid balls. `radii`: N float32 or one, 0 .. 1e9."""
        parts = _Parts(self.message, positions)
        parts.message.ball.radii = parts.column("ball.radii", radii, FLOAT32)
        return self._add(parts, rotations, layers)

    def boxes(self, positions: ColumnLike, half_extents: ColumnLike, *, rotations: ColumnLike = None,
              layers: ColumnLike = None) -> "Compound":
        """Adds N solid boxes. `half_extents`: 3N float32 or three, half the lengths of the edges along the part's own
        axes.
        """
        parts = _Parts(self.message, positions)
        parts.message.box.half_extents = parts.column("box.half_extents", half_extents, FLOAT32, 3)
        return self._add(parts, rotations, layers)

    def capsules(self, positions: ColumnLike, half_axes: ColumnLike, radii: ColumnLike, *, rotations: ColumnLike = None,
                 layers: ColumnLike = None) -> "Compound":
        """Adds N solid capsules. `half_axes`: 3N float32 or three, vectors from the centre to one end of the inner
        segment, in the part's own axes; `radii`: N float32 or one, 0 .. 1e9.
        """
        parts = _Parts(self.message, positions)
        parts.message.capsule.half_axes = parts.column("capsule.half_axes", half_axes, FLOAT32, 3)
        parts.message.capsule.radii = parts.column("capsule.radii", radii, FLOAT32)
        return self._add(parts, rotations, layers)

    def _add(self, parts: "_Parts", rotations: ColumnLike, layers: ColumnLike) -> "Compound":
        parts.message.rotations = parts.column("rotations", rotations, FLOAT32, 4)
        parts.message.layers = parts.column("layers", layers, UINT32)
        self.message.parts.append(parts.message)
        self._size += parts.count
        return self


class _Parts:
    """New entry of a compound's parts, which is added when all its columns are read. Errors name its columns, for
    example `parts[1].positions`.
    """

    def __init__(self, compound: Any, positions: ColumnLike) -> None:
        self._path = f"parts[{len(compound.parts)}]."
        self.message = _Insert().compound.parts.add()
        self.message.positions = columns.encode(self._path + "positions", positions, FLOAT32, 3)
        self.count = columns.entries(self.message.positions, FLOAT32, 3)

    def column(self, name: str, value: ColumnLike, kind: columns.Kind, width: int = 1) -> bytes:
        return columns.encode_for(self._path + name, value, kind, self.count, width)
