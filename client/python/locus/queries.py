"""Query batches: blocks of rays, balls, boxes, lookups and what is nearest in columns, answered together at one revision."""
from __future__ import annotations

from typing import NamedTuple, Optional, Sequence

from . import columns, schema, wire
from .columns import FLOAT32, UINT32, UINT64, ColumnLike
from .enums import Column, Cull, Inside, OutsideHistory, Precision, RayMode, Source, StaticDetail
from .values import Revision

_REQUEST, _BATCH, _VIEW = schema.numbers("QueryRequest"), schema.numbers("QueryBatch"), schema.numbers("View")
_BLOCK = schema.numbers("QueryBlock")
_KINDS = {name: schema.numbers(name.capitalize()) for name in ("rays", "balls", "boxes", "lookup", "nearest")}


class Block(NamedTuple):
    """Settings that every kind of block has, N queries to a block. All optional.

    - `frame`: three floats, added to every position of the block; positions in its result are relative to it.
    - `source`: where to look; `precision`: what decides.
    - `columns`: what to return of each row, by default T, ID and TRIANGLE for rays and what is nearest, ID for balls
      and boxes (TRIANGLE too where their detail is triangles), ID and POSE for lookups.
    - `masks`: N uint32 or one; found is only what has (layers & mask) != 0.
    - `ignore_groups`: N uint64 or one; objects and instances of that group are passed over.
    - `ignore_ids`: at most 64 uint64 to pass over, for the whole block.
    - `max_results`: most rows a query, 0 = 1,024.
    - `after_id`: only rows with a higher id, to go on after a cut.
    - `as_of_ticks`: N uint64 or one; asks about objects as they were when that tick ended. `as_of_fractions`: N float32
      or one, 0 <= f < 1, with them: how far from there to the next tick. `outside_history`: what to do about times that
      are not kept; they are refused by default.
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
    as_of_ticks: ColumnLike = None
    as_of_fractions: ColumnLike = None
    outside_history: OutsideHistory = OutsideHistory.UNSPECIFIED

    def write(self, block: wire.Parts, path: str, count: int) -> None:
        """Into the protocol's QueryBlock of `count` queries, called `path` in errors. Defaults cost nothing."""
        if self.frame is not None:
            block.add(_BLOCK["frame"], wire.vector(columns.vector(path + "frame", self.frame)))
        if self.source:
            block.add_varint(_BLOCK["source"], self.source)
        if self.precision:
            block.add_varint(_BLOCK["precision"], self.precision)
        for column in self.columns:
            block.add_varint(_BLOCK["columns"], column)
        if self.masks is not None:
            block.add(_BLOCK["masks"], columns.borrow_for(path + "masks", self.masks, UINT32, count))
        if self.ignore_groups is not None:
            groups = columns.borrow_for(path + "ignore_groups", self.ignore_groups, UINT64, count)
            block.add(_BLOCK["ignore_groups"], groups)
        if self.ignore_ids is not None:
            block.add(_BLOCK["ignore_ids"], columns.borrow(path + "ignore_ids", self.ignore_ids, UINT64))
        if self.max_results:
            block.add_varint(_BLOCK["max_results"], self.max_results)
        if self.after_id:
            block.add_fixed64(_BLOCK["after_id"], self.after_id)
        if self.as_of_ticks is not None:
            block.add(_BLOCK["as_of_ticks"], columns.borrow_for(path + "as_of_ticks", self.as_of_ticks, UINT64, count))
        if self.as_of_fractions is not None:
            fractions = columns.borrow_for(path + "as_of_fractions", self.as_of_fractions, FLOAT32, count)
            block.add(_BLOCK["as_of_fractions"], fractions)
        if self.outside_history:
            block.add_varint(_BLOCK["outside_history"], self.outside_history)


class QueryBatch:
    """Blocks of queries for one scene, answered at one revision, in order.

    N, the number of queries of a block, comes from its first column; other columns hold N entries, one for all, or none
    for their default. Positions and lengths are float32 in the caller's unit, relative to the block's frame.

    `at_least`: the oldest revision that will do, an Ack for example ("read your own writes"); `exactly`: this very
    revision, while the server keeps it; the default is the latest. Both check the epoch: LocusError with
    Reason.SCENE_RESTARTED if the scene started over. `max_work`: a budget in nodes, cells and tests; `explain`: report
    the work done; `max_reply_bytes`: the answer's largest size, 0 = 4,000,000.

    Columns are checked for type and length here (TypeError and ValueError name the column), values by the server. Buffers
    are borrowed: leave them unchanged until the batch was sent. It may be sent again. Methods return the batch, so that
    calls chain. Not for several threads at once.
    """

    def __init__(self, *, at_least: Optional[Revision] = None, exactly: Optional[Revision] = None, max_work: int = 0,
                 explain: bool = False, max_reply_bytes: int = 0) -> None:
        if at_least is not None and exactly is not None:
            raise ValueError("give at_least or exactly, not both")
        self._parts = wire.Parts()
        moment = at_least or exactly
        if moment is not None:
            view = wire.Parts()
            view.add_fixed64(_VIEW["exactly" if at_least is None else "at_least"], moment.revision)
            view.add_fixed64(_VIEW["epoch"], moment.epoch)
            self._parts.add_parts(_BATCH["view"], view)
        if max_work:
            self._parts.add_fixed64(_BATCH["max_work"], max_work)
        if explain:
            self._parts.add_varint(_BATCH["explain"], 1)
        if max_reply_bytes:
            self._parts.add_fixed32(_BATCH["max_reply_bytes"], max_reply_bytes)
        self._blocks = 0

    def rays(self, origins: ColumnLike, directions: ColumnLike, *, t_max: ColumnLike = None,
             mode: RayMode = RayMode.FIRST, cull: Cull = Cull.NONE, inside: Inside = Inside.SOLID,
             block: Block = Block()) -> "QueryBatch":
        """What do N rays hit? `origins`: 3N float32; `directions`: 3N float32 or three, of any length but zero, never
        made unit: t counts in this length; `t_max`: N float32 or one, included, +infinity by default.
        """
        new = _NewBlock(self._blocks, "rays")
        new.first("origins", origins, FLOAT32, 3)
        new.column("directions", directions, FLOAT32, 3)
        new.column("t_max", t_max, FLOAT32)
        if mode is not RayMode.FIRST or cull is not Cull.NONE or inside is not Inside.SOLID:
            new.options(mode=mode, cull=cull, inside=inside)
        return self._add(new, block)

    def balls(self, centers: ColumnLike, radii: ColumnLike, *, detail: StaticDetail = StaticDetail.INSTANCES,
              block: Block = Block()) -> "QueryBatch":
        """What touches N balls? `centers`: 3N float32; `radii`: N float32 or one, 0 .. 1e9."""
        new = _NewBlock(self._blocks, "balls")
        new.first("centers", centers, FLOAT32, 3)
        new.column("radii", radii, FLOAT32)
        new.options(detail=detail)
        return self._add(new, block)

    def boxes(self, centers: ColumnLike, half_extents: ColumnLike, *, rotations: ColumnLike = None,
              detail: StaticDetail = StaticDetail.INSTANCES, block: Block = Block()) -> "QueryBatch":
        """What touches N boxes? `centers`: 3N float32; `half_extents`: 3N float32 or three, along the box's own axes;
        `rotations`: 4N float32 or four, unit quaternions x, y, z, w, none = axis-aligned.
        """
        new = _NewBlock(self._blocks, "boxes")
        new.first("centers", centers, FLOAT32, 3)
        new.column("half_extents", half_extents, FLOAT32, 3)
        new.column("rotations", rotations, FLOAT32, 4)
        new.options(detail=detail)
        return self._add(new, block)

    def nearest(self, points: ColumnLike, *, k: int = 1, max_distances: ColumnLike = None,
                detail: StaticDetail = StaticDetail.INSTANCES, block: Block = Block()) -> "QueryBatch":
        """What is nearest to N points? `points`: 3N float32; `k`: how many rows a point at most, by ascending distance,
        which is in column T: 0 in an object, to the surface for meshes; `max_distances`: N float32 or one, included,
        +infinity by default; `detail`: INSTANCES counts an instance once, by its nearest triangle.
        """
        new = _NewBlock(self._blocks, "nearest")
        new.first("points", points, FLOAT32, 3)
        new.column("max_distances", max_distances, FLOAT32)
        new.options(k=k, detail=detail)
        return self._add(new, block)

    def lookup(self, ids: ColumnLike, *, block: Block = Block()) -> "QueryBatch":
        """Where are these objects and instances? N uint64 ids: one row each, in this order; id 0 for an unknown one."""
        new = _NewBlock(self._blocks, "lookup")
        new.first("ids", ids, UINT64)
        return self._add(new, block)

    def lookup_groups(self, groups: ColumnLike, *, block: Block = Block()) -> "QueryBatch":
        """What belongs to these groups? N uint64 groups, not 0: all their objects and instances, ascending by id."""
        new = _NewBlock(self._blocks, "lookup")
        new.first("groups", groups, UINT64)
        return self._add(new, block)

    def request_bytes(self, scene: str) -> bytes:
        """The whole request for Query, as it goes over the wire. Columns are read now."""
        request = wire.Parts()
        request.add(_REQUEST["scene"], scene.encode())
        request.add_parts(_REQUEST["batch"], self._parts)
        return b"".join(request.pieces)

    def batch_bytes(self) -> bytes:
        """The protocol's QueryBatch, as it goes over the wire. Columns are read now."""
        return b"".join(self._parts.pieces)

    def _add(self, new: _NewBlock, settings: Block) -> QueryBatch:
        """Only a block without faults becomes part of the batch."""
        block = wire.Parts()
        settings.write(block, new.path, new.count)
        block.add_parts(_BLOCK[new.name], new.kind)
        self._parts.add_parts(_BATCH["blocks"], block)
        self._blocks += 1
        return self


class _NewBlock:
    """The kind of a block that is being filled."""

    def __init__(self, blocks_before: int, name: str) -> None:
        self.path = f"blocks[{blocks_before}]."
        self.name = name
        self.kind = wire.Parts()
        self.count = 0

    def first(self, name: str, value: ColumnLike, number: columns.Kind, width: int = 1) -> None:
        """The column that tells how many queries there are."""
        raw = columns.borrow(f"{self.path}{self.name}.{name}", value, number, width)
        self.count = columns.entries(raw, number, width)
        self.kind.add(_KINDS[self.name][name], raw)

    def column(self, name: str, value: ColumnLike, number: columns.Kind, width: int = 1) -> None:
        if value is not None:
            path = f"{self.path}{self.name}.{name}"
            self.kind.add(_KINDS[self.name][name], columns.borrow_for(path, value, number, self.count, width))

    def options(self, **fields: int) -> None:
        """Fields of the kind that are no columns."""
        for name, value in fields.items():
            if value:
                self.kind.add_varint(_KINDS[self.name][name], value)
