"""Update batches: changes of objects and instances in columns, applied as one revision of a scene."""
from __future__ import annotations

import contextlib
import itertools
from typing import Any, Iterator, Optional

from . import columns, schema
from .columns import FLOAT32, FLOAT64, UINT32, UINT64, ColumnLike
from .compounds import Compound

_Request = schema.message("ApplyUpdatesRequest")
_MAX_PARTS = 64


class UpdateBatch:
    """Changes that are applied as one revision, in this order: clear, removes, inserts, moves, relabels, moves
    and relabels of instances.

    N is the number of ids of a call. Every other column has N entries, one entry for all ids, or no entry, which means
    its default. `positions` are 3N float32 relative to `frame` (three floats, the origin by default); `positions_f64`
    are 3N float64, absolute; give exactly one of these two columns. `rotations` are 4N float32, unit quaternions x, y,
    z, w; without them, inserted objects have the identity, and moved objects keep their rotations. `layers` are N
    uint32 (none = bit 0; the value 0 hides the object), `groups` and `tags` N uint64 (none = 0). `expire_ticks` are N
    uint64, the number of ticks that an inserted object exists, at most 2^48 (none or 0 = until it is removed). Ids are
    uint64, chosen by the caller, never 0. Lengths are in the caller's unit.

    Columns are checked for type and length here (TypeError and ValueError name the column). Values are checked by the
    server, which refuses wrong items individually and lists them in Ack.errors, or, with `all_or_nothing`, refuses the
    whole batch.

    Settings: `tick` is the caller's time step; `clear` removes every object first; with `upsert`, an insert replaces
    an existing object with the same id; `restart_ticks` drops the scene's history and accepts a `tick` lower than the
    scene's; `writer` (random, not 0) and `number` (1, 2, 3 ...) let the server recognize a repeated batch and apply it
    only once. Streams set `writer` and `number` automatically. `lease_ms`, at most one day, only with `writer`: when no batch
    of the writer has arrived for that long, the objects that it inserted are removed; streams with `lease_ms` set it.

    Methods return the batch, so that calls can be chained. Not thread-safe.
    """

    def __init__(self, *, frame: Optional[ColumnLike] = None, tick: Optional[int] = None, clear: bool = False,
                 upsert: bool = False, all_or_nothing: bool = False, restart_ticks: bool = False, writer: int = 0,
                 number: int = 0, lease_ms: int = 0) -> None:
        # Create the batch as a part of its request; if it were added to a request later, it would be copied.
        self._request = _Request()
        self.message = self._request.batch
        self.message.clear, self.message.upsert, self.message.all_or_nothing = clear, upsert, all_or_nothing
        self.message.restart_ticks, self.message.writer, self.message.batch = restart_ticks, writer, number
        self.message.lease_ms = lease_ms
        if tick is not None:
            self.message.tick = tick
        if frame is not None:
            origin = self.message.frame
            origin.x, origin.y, origin.z = columns.vector("frame", frame)

    def remove(self, ids: ColumnLike) -> "UpdateBatch":
        """Removes objects: N uint64 ids, appended to the ids of earlier calls."""
        self.message.remove_ids += columns.encode("remove_ids", ids, UINT64)
        return self

    def remove_groups(self, groups: ColumnLike) -> "UpdateBatch":
        """Removes every object of each group: uint64 groups, not 0."""
        self.message.remove_groups += columns.encode("remove_groups", groups, UINT64)
        return self

    def insert_points(self, ids: ColumnLike, positions: ColumnLike = None, *, positions_f64: ColumnLike = None,
                      rotations: ColumnLike = None, layers: ColumnLike = None, groups: ColumnLike = None,
                      tags: ColumnLike = None, expire_ticks: ColumnLike = None) -> "UpdateBatch":
        """Inserts N points. Overlap queries, nearest queries and lookups find points; rays never hit them."""
        with _new_entry(self.message.inserts, "inserts", ids) as insert:
            insert.message.point.SetInParent()
            insert.pose(positions, positions_f64, rotations)
            insert.labels(layers, groups, tags)
            insert.lifetimes(expire_ticks)
        return self

    def insert_balls(self, ids: ColumnLike, positions: ColumnLike = None, radii: ColumnLike = None, *,
                     positions_f64: ColumnLike = None, rotations: ColumnLike = None, layers: ColumnLike = None,
                     groups: ColumnLike = None, tags: ColumnLike = None,
                     expire_ticks: ColumnLike = None) -> "UpdateBatch":
        """Inserts N solid balls. `radii`: N float32 or one, 0 .. 1e9."""
        with _new_entry(self.message.inserts, "inserts", ids) as insert:
            insert.message.ball.SetInParent()
            insert.pose(positions, positions_f64, rotations)
            insert.message.ball.radii = insert.column("ball.radii", radii, FLOAT32)
            insert.labels(layers, groups, tags)
            insert.lifetimes(expire_ticks)
        return self

    def insert_boxes(self, ids: ColumnLike, positions: ColumnLike = None, half_extents: ColumnLike = None, *,
                     positions_f64: ColumnLike = None, rotations: ColumnLike = None, layers: ColumnLike = None,
                     groups: ColumnLike = None, tags: ColumnLike = None,
                     expire_ticks: ColumnLike = None) -> "UpdateBatch":
        """Inserts N solid boxes. `half_extents`: 3N float32 or three, half the lengths of the edges along the box's own
        axes.
        """
        with _new_entry(self.message.inserts, "inserts", ids) as insert:
            insert.message.box.SetInParent()
            insert.pose(positions, positions_f64, rotations)
            insert.message.box.half_extents = insert.column("box.half_extents", half_extents, FLOAT32, 3)
            insert.labels(layers, groups, tags)
            insert.lifetimes(expire_ticks)
        return self

    def insert_capsules(self, ids: ColumnLike, positions: ColumnLike = None, half_axes: ColumnLike = None,
                        radii: ColumnLike = None, *, positions_f64: ColumnLike = None, rotations: ColumnLike = None,
                        layers: ColumnLike = None, groups: ColumnLike = None, tags: ColumnLike = None,
                        expire_ticks: ColumnLike = None) -> "UpdateBatch":
        """Inserts N solid capsules. `half_axes`: 3N float32 or three, vectors from the centre to one end of the inner
        segment, in the object's own axes; `radii`: N float32 or one, 0 .. 1e9.
        """
        with _new_entry(self.message.inserts, "inserts", ids) as insert:
            insert.message.capsule.SetInParent()
            insert.pose(positions, positions_f64, rotations)
            insert.message.capsule.half_axes = insert.column("capsule.half_axes", half_axes, FLOAT32, 3)
            insert.message.capsule.radii = insert.column("capsule.radii", radii, FLOAT32)
            insert.labels(layers, groups, tags)
            insert.lifetimes(expire_ticks)
        return self

    def insert_compounds(self, ids: ColumnLike, positions: ColumnLike = None, compound: Optional[Compound] = None, *,
                         positions_f64: ColumnLike = None, rotations: ColumnLike = None, layers: ColumnLike = None,
                         groups: ColumnLike = None, tags: ColumnLike = None,
                         expire_ticks: ColumnLike = None) -> "UpdateBatch":
        """Inserts N compounds, which all have the parts of `compound`. Without `layers`, they are in bit 0 or, if parts
        have layers, in all layers of the parts.
        """
        if not isinstance(compound, Compound):
            raise TypeError("insert_compounds: compound: give a Compound")
        with _new_entry(self.message.inserts, "inserts", ids) as insert:
            insert.message.compound.CopyFrom(compound.message)
            insert.pose(positions, positions_f64, rotations)
            insert.labels(layers, groups, tags)
            insert.lifetimes(expire_ticks)
        return self

    def move(self, ids: ColumnLike, positions: ColumnLike = None, *, positions_f64: ColumnLike = None,
             rotations: ColumnLike = None, teleport: bool = False, parts_each: int = 0,
             part_positions: ColumnLike = None, part_rotations: ColumnLike = None) -> "UpdateBatch":
        """Moves N objects: sets their centres and, if `rotations` is given, their rotations. With `teleport`, queries
        at a time between the previous tick and the batch's tick do not interpolate between the old and new positions.

        To set the poses of the parts of compounds, such as bones, give `parts_each`, the number P of parts of each
        object, and `part_positions` (3NP float32, as in an array (N, P, 3), or 3P for all objects: the parts' centres
        in the object's own axes), `part_rotations` (4NP float32 or 4P for all: unit quaternions) or both. A column that
        is not given does not change.
        """
        with _new_entry(self.message.moves, "moves", ids) as entry:
            entry.pose(positions, positions_f64, rotations)
            entry.message.teleport = teleport
            entry.part_poses(parts_each, part_positions, part_rotations)
        return self

    def relabel(self, ids: ColumnLike, *, layers: ColumnLike = None, groups: ColumnLike = None,
                tags: ColumnLike = None) -> "UpdateBatch":
        """Sets labels (layers, groups, tags) of N objects. A label whose column is not given does not change."""
        with _new_entry(self.message.relabels, "relabels", ids) as entry:
            entry.labels(layers, groups, tags)
        return self

    def move_instances(self, ids: ColumnLike, positions: ColumnLike = None, *, positions_f64: ColumnLike = None,
                       rotations: ColumnLike = None, scales: ColumnLike = None,
                       teleport: bool = False) -> "UpdateBatch":
        """Moves N placed instances: sets the positions of the origins of their meshes, and their rotations and scales
        (N float32 or one) if given. `teleport` means the same as in move().
        """
        with _new_entry(self.message.instance_moves, "instance_moves", ids) as entry:
            entry.pose(positions, positions_f64, rotations)
            entry.message.scales = entry.column("scales", scales, FLOAT32)
            entry.message.teleport = teleport
        return self

    def relabel_instances(self, ids: ColumnLike, *, layers: ColumnLike = None, groups: ColumnLike = None,
                          tags: ColumnLike = None) -> "UpdateBatch":
        """Sets labels of N placed instances, as relabel() does for objects. Layers 0 hide an instance from queries."""
        with _new_entry(self.message.instance_relabels, "instance_relabels", ids) as entry:
            entry.labels(layers, groups, tags)
        return self

    def request_bytes(self, scene: str) -> bytes:
        """Returns the encoded request for ApplyUpdates."""
        self._request.scene = scene
        return bytes(self._request.SerializeToString())


class _Entry:
    """New entry of one of the batch's lists (inserts, moves and so on). Errors name its columns, for example
    `moves[1].positions`.
    """

    def __init__(self, message: Any, path: str, ids: ColumnLike) -> None:
        self.message = message
        self._path = path
        message.ids = columns.encode(path + "ids", ids, UINT64)
        self._count = columns.entries(message.ids, UINT64)

    def column(self, name: str, value: ColumnLike, kind: columns.Kind, width: int = 1) -> bytes:
        return columns.encode_for(self._path + name, value, kind, self._count, width)

    def pose(self, positions: ColumnLike, positions_f64: ColumnLike, rotations: ColumnLike) -> None:
        self.message.positions = self.column("positions", positions, FLOAT32, 3)
        self.message.positions_f64 = self.column("positions_f64", positions_f64, FLOAT64, 3)
        self.message.rotations = self.column("rotations", rotations, FLOAT32, 4)

    def lifetimes(self, expire_ticks: ColumnLike) -> None:
        self.message.expire_ticks = self.column("expire_ticks", expire_ticks, UINT64)

    def part_poses(self, parts_each: int, positions: ColumnLike, rotations: ColumnLike) -> None:
        if positions is None and rotations is None:
            if parts_each:
                raise ValueError(f"{self._path}parts_each: give part_positions or part_rotations with it")
            return
        if not 1 <= parts_each <= _MAX_PARTS:
            raise ValueError(f"{self._path}parts_each: is {parts_each}: give the number of parts of each object, 1 to "
                             f"{_MAX_PARTS}")
        self.message.parts_each = parts_each
        self.message.part_positions = self._part_column("part_positions", positions, parts_each, 3)
        self.message.part_rotations = self._part_column("part_rotations", rotations, parts_each, 4)

    def _part_column(self, name: str, value: ColumnLike, parts_each: int, width: int) -> bytes:
        """Returns the encoded column, which has an entry for each part: of each object, or of one for all objects."""
        if isinstance(value, (list, tuple)) and value and _is_nested(value[0]):
            value = list(itertools.chain.from_iterable(value))
        raw = columns.encode(self._path + name, value, FLOAT32, width)
        found, wanted = columns.entries(raw, FLOAT32, width), self._count * parts_each
        if found not in (0, parts_each, wanted):
            raise ValueError(f"{self._path}{name}: has {found} entries: give {wanted} ({parts_each} for each object), "
                             f"{parts_each} for all, or none")
        return raw

    def labels(self, layers: ColumnLike, groups: ColumnLike, tags: ColumnLike) -> None:
        self.message.layers = self.column("layers", layers, UINT32)
        self.message.groups = self.column("groups", groups, UINT64)
        self.message.tags = self.column("tags", tags, UINT64)


def _is_nested(item: Any) -> bool:
    """Returns whether `item` is a list of lists."""
    return isinstance(item, (list, tuple)) and bool(item) and isinstance(item[0], (list, tuple))


@contextlib.contextmanager
def _new_entry(entries: Any, name: str, ids: ColumnLike) -> Iterator[_Entry]:
    """Adds an entry to `entries` and yields it to the caller, who fills it. If the caller raises an exception, the
    entry is removed.
    """
    path = f"{name}[{len(entries)}]."
    message = entries.add()
    try:
        yield _Entry(message, path, ids)
    except Exception:
        del entries[-1]
        raise
