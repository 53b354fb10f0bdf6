"""Query batches: blocks of rays, balls, boxes and lookups in columns, answered together at one revision."""
from __future__ import annotations

import contextlib
import dataclasses
from typing import Any, Iterator, Optional, Sequence

from . import columns, schema
from .columns import FLOAT32, UINT32, UINT64, ColumnLike
from .enums import Column, Cull, Inside, Precision, RayMode, Source, StaticDetail
from .values import Revision

_Request = schema.message("QueryRequest")


@dataclasses.dataclass(frozen=True)
class Block:
    """Settings that every kind of block has, N queries to a block. All optional.

    - `frame`: three floats, added to every position of the block; positions in its result are relative to it.
    - `source`: where to look; `precision`: what decides.
    - `columns`: what to return of each row, by default T, ID and TRIANGLE for rays, ID for balls and boxes (TRIANGLE
      too where their detail is triangles), ID and POSE for lookups.
    - `masks`: N uint32 or one; found is only what has (layers & mask) != 0.
    - `ignore_groups`: N uint64 or one; objects and instances of that group are passed over.
    - `ignore_ids`: at most 64 uint64 to pass over, for the whole block.
    - `max_results`: most rows a query, 0 = 1,024.
    - `after_id`: only rows with a higher id, to go on after a cut.
    """

    frame: Optional[ColumnLike] = None
    source: Source = Source.UNSPECIFIED
    precision: Precision = Precision.UNSPECIFIED
    columns: Sequence[Column] = ()
    masks: ColumnLike = None
    ignore_groups: ColumnLike = None
    ignore_ids: ColumnLike = None
    max_results: int = 0
    after_id: int = 0

    def write(self, message: Any, path: str, count: int) -> None:
        """Into the protocol's QueryBlock of `count` queries, called `path` in errors."""
        message.source = self.source
        message.precision = self.precision
        message.columns.extend(self.columns)
        message.masks = columns.encode_for(path + "masks", self.masks, UINT32, count)
        message.ignore_groups = columns.encode_for(path + "ignore_groups", self.ignore_groups, UINT64, count)
        message.ignore_ids = columns.encode(path + "ignore_ids", self.ignore_ids, UINT64)
        message.max_results = self.max_results
        message.after_id = self.after_id
        origin = columns.vector(path + "frame", self.frame)
        if origin is not None:
            message.frame.x, message.frame.y, message.frame.z = origin


class QueryBatch:
    """Blocks of queries for one scene, answered at one revision, in order.

    N, the number of queries of a block, comes from its first column; other columns hold N entries, one for all, or none
    for their default. Positions and lengths are float32 in the caller's unit, relative to the block's frame.

    `at_least`: the oldest revision that will do, an Ack for example ("read your own writes"); `exactly`: this very
    revision, while the server keeps it; the default is the latest. Both check the epoch: LocusError with
    Reason.SCENE_RESTARTED if the scene started over. `max_work`: a budget in nodes, cells and tests; `explain`: report
    the work done; `max_reply_bytes`: the answer's largest size, 0 = 4,000,000.

    Columns are checked for type and length here (TypeError and ValueError name the column), values by the server.
    Methods return the batch, so that calls chain. Not for several threads at once.
    """

    def __init__(self, *, at_least: Optional[Revision] = None, exactly: Optional[Revision] = None, max_work: int = 0,
                 explain: bool = False, max_reply_bytes: int = 0) -> None:
        if at_least is not None and exactly is not None:
            raise ValueError("give at_least or exactly, not both")
        # Within a request from the start: putting a batch into one later would copy it.
        self._request = _Request()
        self.message = self._request.batch
        self.message.max_work, self.message.explain = max_work, explain
        self.message.max_reply_bytes = max_reply_bytes
        if at_least is not None:
            self.message.view.at_least, self.message.view.epoch = at_least.revision, at_least.epoch
        elif exactly is not None:
            self.message.view.exactly, self.message.view.epoch = exactly.revision, exactly.epoch

    def rays(self, origins: ColumnLike, directions: ColumnLike, *, t_max: ColumnLike = None,
             mode: RayMode = RayMode.FIRST, cull: Cull = Cull.NONE, inside: Inside = Inside.SOLID,
             block: Block = Block()) -> "QueryBatch":
        """What do N rays hit? `origins`: 3N float32; `directions`: 3N float32 or three, of any length but zero, never
        made unit: t counts in this length; `t_max`: N float32 or one, included, +infinity by default.
        """
        with self._new_block("rays", block, origins, 3) as new:
            new.kind.origins = new.first
            new.kind.directions = new.column("directions", directions, FLOAT32, 3)
            new.kind.t_max = new.column("t_max", t_max, FLOAT32)
            new.kind.mode, new.kind.cull, new.kind.inside = mode, cull, inside
        return self

    def balls(self, centers: ColumnLike, radii: ColumnLike, *, detail: StaticDetail = StaticDetail.INSTANCES,
              block: Block = Block()) -> "QueryBatch":
        """What touches N balls? `centers`: 3N float32; `radii`: N float32 or one, 0 .. 1e9."""
        with self._new_block("balls", block, centers, 3) as new:
            new.kind.centers = new.first
            new.kind.radii = new.column("radii", radii, FLOAT32)
            new.kind.detail = detail
        return self

    def boxes(self, centers: ColumnLike, half_extents: ColumnLike, *, rotations: ColumnLike = None,
              detail: StaticDetail = StaticDetail.INSTANCES, block: Block = Block()) -> "QueryBatch":
        """What touches N boxes? `centers`: 3N float32; `half_extents`: 3N float32 or three, along the box's own axes;
        `rotations`: 4N float32 or four, unit quaternions x, y, z, w, none = axis-aligned.
        """
        with self._new_block("boxes", block, centers, 3) as new:
            new.kind.centers = new.first
            new.kind.half_extents = new.column("half_extents", half_extents, FLOAT32, 3)
            new.kind.rotations = new.column("rotations", rotations, FLOAT32, 4)
            new.kind.detail = detail
        return self

    def lookup(self, ids: ColumnLike, *, block: Block = Block()) -> "QueryBatch":
        """Where are these objects and instances? N uint64 ids: one row each, in this order; id 0 for an unknown one."""
        with self._new_block("lookup", block, ids, 1, UINT64, "ids") as new:
            new.kind.ids = new.first
        return self

    def lookup_groups(self, groups: ColumnLike, *, block: Block = Block()) -> "QueryBatch":
        """What belongs to these groups? N uint64 groups, not 0: all their objects and instances, ascending by id."""
        with self._new_block("lookup", block, groups, 1, UINT64, "groups") as new:
            new.kind.groups = new.first
        return self

    def request_bytes(self, scene: str) -> bytes:
        """The whole request for Query, as it goes over the wire."""
        self._request.scene = scene
        return bytes(self._request.SerializeToString())

    @contextlib.contextmanager
    def _new_block(self, kind: str, block: Block, first: ColumnLike, width: int, number: columns.Kind = FLOAT32,
                   name: str = "") -> Iterator["_NewBlock"]:
        """Adds a block to fill; one with a column that is refused is taken out again."""
        path = f"blocks[{len(self.message.blocks)}]."
        message = self.message.blocks.add()
        try:
            getattr(message, kind).SetInParent()
            name = name or ("origins" if kind == "rays" else "centers")
            raw = columns.encode(f"{path}{kind}.{name}", first, number, width)
            count = columns.entries(raw, number, width)
            block.write(message, path, count)
            yield _NewBlock(getattr(message, kind), f"{path}{kind}.", raw, count)
        except Exception:
            del self.message.blocks[-1]
            raise


@dataclasses.dataclass(frozen=True)
class _NewBlock:
    """The kind of a block that is being filled, and its first column."""

    kind: Any
    path: str
    first: bytes
    count: int

    def column(self, name: str, value: ColumnLike, number: columns.Kind, width: int = 1) -> bytes:
        return columns.encode_for(self.path + name, value, number, self.count, width)
