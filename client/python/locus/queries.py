"""Query batches: blocks of rays, sweeps, overlaps, sight, nearest queries and more in columns, answered at one revision."""
from __future__ import annotations

import struct
from typing import NamedTuple, Optional, Sequence

from . import columns, schema, wire
from .columns import FLOAT32, UINT32, UINT64, ColumnLike
from .enums import AtStart, ClipDepth, Column, Cull, Inside, OutsideHistory, Precision, RayMode, Source, StaticDetail
from .values import Revision

_REQUEST, _BATCH, _VIEW = schema.numbers("QueryRequest"), schema.numbers("QueryBatch"), schema.numbers("View")
_BLOCK = schema.numbers("QueryBlock")
_KINDS = {name: schema.numbers(name.capitalize())
          for name in ("rays", "balls", "boxes", "capsules", "cells", "contains", "frustums", "lookup", "nearest", "pairs",
                       "sight", "sweeps")}


def names_revision(request: bytes) -> bool:
    """Returns whether the view of an encoded request for Query names a revision."""
    batch = wire.fields(wire.column(wire.fields(memoryview(request)), _REQUEST["batch"]))
    view = wire.fields(wire.column(batch, _BATCH["view"]))
    return _VIEW["at_least"] in view or _VIEW["exactly"] in view


class Block(NamedTuple):
    """Settings common to all kinds of block, for N queries. All settings are optional. If a setting may have N numbers
    or one, one number applies to all queries.

    - `frame`: three floats, the origin that the server adds to every position of the block. Column POINT of the result
      is relative to the frame, but column POSE is absolute.
    - `source`: search static instances, moving objects or both; `precision`: exact shapes or their bounds.
    - `columns`: columns to return for each row. Defaults: T, ID and TRIANGLE for rays, sweeps and nearest queries; ID
      for balls, boxes, capsules, frustums and contains, with TRIANGLE if their detail is triangles; ID and POSE for
      lookups; ID and OTHER for pairs, with T if `k` is given; T, ID, TRIANGLE and NORMAL for cells.
    - `masks`: N uint32 or one; only objects and instances with (layers & mask) != 0 are found.
    - `ignore_groups`: N uint64 or one; the query ignores objects and instances of this group.
    - `ignore_ids`: at most 64 uint64 ids to ignore, for the whole block.
    - `only_groups`: N uint64 or one; the query finds only objects and instances of this group; 0 = every group. With
      `only_groups_each`, 1 .. 16, a query has that many groups instead of one; 0 fills an entry that has fewer.
    - `tags`: N uint64 or one; only objects and instances with (tag & mask) == (tags & mask) are found. `tag_masks`: N
      uint64 or one, the mask of each query, by default all bits; only with `tags`.
    - `self_ids`: N uint64 or one; the query ignores the object or instance with this id, 0 = none.
    - `max_results`: maximum number of rows per query, 0 = 1,024.
    - `after_id`: return only rows with a higher id, to continue after a truncated result.
    - `as_of_ticks`: N uint64 or one; the query sees objects and instances as they were at the end of
      this tick. `as_of_fractions`: N
      float32 or one, 0 <= f < 1, only with `as_of_ticks`: the query is answered for the time tick + f, f being a
      fraction of the time between that tick and the next. `outside_history`: how times outside the history are handled;
      by default they are refused.
    - `anchor_ids`: N uint64 or one, an object or instance for each query. The positions of the query are relative to the
      position of this anchor, and the query does not find the anchor.
    - `rotation`: four floats, a unit quaternion x, y, z, w, for rays only. It rotates the directions of all rays, but
      not their origins, so a sensor sends the same pattern of directions in each block.
    - `count_only`: return only the number of rows of each query; `max_results` does not limit this number.
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
    anchor_ids: ColumnLike = None
    count_only: bool = False
    only_groups: ColumnLike = None
    only_groups_each: int = 1
    tags: ColumnLike = None
    tag_masks: ColumnLike = None
    self_ids: ColumnLike = None
    rotation: ColumnLike = None

    def write(self, block: wire.Parts, path: str, count: int) -> None:
        """Appends the settings to a QueryBlock of `count` queries. `path` is the prefix of field names in errors.
        Settings with default values add no bytes.
        """
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
        if self.only_groups is not None:
            each = self.only_groups_each
            block.add(_BLOCK["only_groups"], columns.borrow_for(path + "only_groups", self.only_groups, UINT64, count, each))
            if each != 1:
                block.add_varint(_BLOCK["only_groups_each"], each)
        for name, column in (("tags", self.tags), ("tag_masks", self.tag_masks), ("self_ids", self.self_ids)):
            if column is not None:
                block.add(_BLOCK[name], columns.borrow_for(path + name, column, UINT64, count))
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
        if self.anchor_ids is not None:
            block.add(_BLOCK["anchor_ids"], columns.borrow_for(path + "anchor_ids", self.anchor_ids, UINT64, count))
        if self.rotation is not None:
            block.add(_BLOCK["rotation"], columns.borrow_for(path + "rotation", self.rotation, FLOAT32, 1, 4))
        if self.count_only:
            block.add_varint(_BLOCK["count_only"], 1)


class After(NamedTuple):
    """Position in the order of rows (t, id, triangle). Rays and nearest queries return only rows after this position.
    Each column has N numbers, or one number for all queries. Without `ids`, rows whose t equals the given t are left
    out; `triangles` need `ids`.
    """

    ts: ColumnLike
    ids: ColumnLike = None
    triangles: ColumnLike = None


class QueryBatch:
    """Blocks of queries for one scene, answered at one revision, in order.

    N, the number of queries of a block, is the number of entries of the block's first column; every other column has N
    entries, one entry for all queries, or none for its default. Positions are float32, relative to the block's frame.
    Positions and lengths are in the caller's unit of length.

    `at_least`: the minimum revision, for example an Ack ("read your own writes"); `exactly`: exactly this revision, if
    the server still retains it. By default the batch is answered at the latest revision. If the epoch of the given
    revision differs from the scene's epoch, the query raises LocusError with Reason.SCENE_RESTARTED. `max_work`:
    maximum total number of visited nodes and cells and of tests for the batch; `explain`: report the work done;
    `by_list`: test every triangle and object instead of searching the scene's structures, which gives the same result
    blocks, byte for byte, at a far higher cost, to verify the answers of a server;
    `max_reply_bytes`: the maximum size of the answer, 0 = 4,000,000. The attribute `waits_for` is the number of the
    minimum revision; None if the batch waits for none.

    In a cluster, `leader_only` lets only the leader of the scene answer, so that the answer includes every update that
    was acknowledged before the batch was sent; `max_age_ms`: maximum time in milliseconds for which the server that
    answers may have missed later revisions, 0 = unlimited. A server that cannot answer so names the leader by
    Reason.ELSEWHERE, which a client with several addresses follows.

    The batch checks types and lengths of columns (TypeError and ValueError name the column); the server checks values.
    Buffers are borrowed: leave them unchanged until the batch was sent. A batch may be sent several times. Methods
    return the batch, so that calls can be chained. Not thread-safe.
    """

    def __init__(self, *, at_least: Optional[Revision] = None, exactly: Optional[Revision] = None, max_work: int = 0,
                 explain: bool = False, max_reply_bytes: int = 0, by_list: bool = False, max_age_ms: int = 0,
                 leader_only: bool = False) -> None:
        if at_least is not None and exactly is not None:
            raise ValueError("give at_least or exactly, not both")
        self._parts = wire.Parts()
        self.waits_for: Optional[int] = None if at_least is None else at_least.revision
        moment = at_least or exactly
        self.names_revision = moment is not None
        self.leader_only = leader_only
        view = wire.Parts()
        if moment is not None:
            view.add_fixed64(_VIEW["exactly" if at_least is None else "at_least"], moment.revision)
            view.add_fixed64(_VIEW["epoch"], moment.epoch)
        if max_age_ms:
            view.add_varint(_VIEW["max_age_ms"], max_age_ms)
        if leader_only:
            view.add_varint(_VIEW["leader_only"], 1)
        if view.size:
            self._parts.add_parts(_BATCH["view"], view)
        if max_work:
            self._parts.add_fixed64(_BATCH["max_work"], max_work)
        if explain:
            self._parts.add_varint(_BATCH["explain"], 1)
        if max_reply_bytes:
            self._parts.add_fixed32(_BATCH["max_reply_bytes"], max_reply_bytes)
        if by_list:
            self._parts.add_varint(_BATCH["by_list"], 1)
        self._blocks = 0

    def rays(self, origins: ColumnLike, directions: ColumnLike, *, t_max: ColumnLike = None,
             mode: RayMode = RayMode.FIRST, cull: Cull = Cull.NONE, inside: Inside = Inside.SOLID,
             after: Optional[After] = None, block: Block = Block()) -> "QueryBatch":
        """Adds a block of N rays. `origins`: 3N float32 or three; `directions`: 3N float32 or three, vectors of any
        length but zero. Directions are not normalized: the unit of t is the length of the direction. `t_max`: N float32
        or one, the maximum t, inclusive, +infinity by default; `after`: only hits after this position.
        """
        new = _NewBlock(self._blocks, "rays")
        new.first("origins", origins, FLOAT32, 3)
        if new.count == 1:
            new.first("directions", directions, FLOAT32, 3)
        else:
            new.column("directions", directions, FLOAT32, 3)
        new.column("t_max", t_max, FLOAT32)
        new.after(after)
        if mode is not RayMode.FIRST or cull is not Cull.NONE or inside is not Inside.SOLID:
            new.options(mode=mode, cull=cull, inside=inside)
        return self._add(new, block)

    def balls(self, centers: ColumnLike, radii: ColumnLike, *, detail: StaticDetail = StaticDetail.INSTANCES,
              block: Block = Block()) -> "QueryBatch":
        """Adds a block of N balls, to find the objects and instances that overlap them. `centers`: 3N float32; `radii`:
        N float32 or one, 0 .. 1e9. Column T is the distance from the centre, negative inside an object.
        """
        new = _NewBlock(self._blocks, "balls")
        new.first("centers", centers, FLOAT32, 3)
        new.column("radii", radii, FLOAT32)
        new.options(detail=detail)
        return self._add(new, block)

    def boxes(self, centers: ColumnLike, half_extents: ColumnLike, *, rotations: ColumnLike = None,
              detail: StaticDetail = StaticDetail.INSTANCES, block: Block = Block()) -> "QueryBatch":
        """Adds a block of N boxes, to find the objects and instances that overlap them. `centers`: 3N float32;
        `half_extents`: 3N float32 or three, along the box's own axes; `rotations`: 4N float32 or four, unit quaternions
        x, y, z, w, none = axis-aligned. Column T is minus the depth of the overlap: moving the box by -T along column
        NORMAL takes it out of the object or triangle.
        """
        new = _NewBlock(self._blocks, "boxes")
        new.first("centers", centers, FLOAT32, 3)
        new.column("half_extents", half_extents, FLOAT32, 3)
        new.column("rotations", rotations, FLOAT32, 4)
        new.options(detail=detail)
        return self._add(new, block)

    def capsules(self, starts: ColumnLike, ends: ColumnLike, radii: ColumnLike, *,
                 detail: StaticDetail = StaticDetail.INSTANCES, block: Block = Block()) -> "QueryBatch":
        """Adds a block of N capsules, to find the objects and instances that overlap them. A capsule is all points at a
        distance of at most its radius from a segment. `starts`: 3N float32; `ends`: 3N float32 or three; `radii`: N
        float32 or one, 0 .. 1e9.
        """
        new = _NewBlock(self._blocks, "capsules")
        new.first("starts", starts, FLOAT32, 3)
        new.column("ends", ends, FLOAT32, 3)
        new.column("radii", radii, FLOAT32)
        new.options(detail=detail)
        return self._add(new, block)

    def sweeps(self, starts: ColumnLike, ends: ColumnLike, radii: ColumnLike = None, *, half_axes: ColumnLike = None,
               half_extents: ColumnLike = None, rotations: ColumnLike = None, mode: RayMode = RayMode.FIRST,
               at_start: AtStart = AtStart.HIT, block: Block = Block()) -> "QueryBatch":
        """Adds a block of N solids that move in a straight line: balls (`radii`), capsules (`radii` and `half_axes`) or
        boxes (`half_extents`). Column T contains the first moment of contact, 0 .. 1. `starts`, `ends`: positions of
        the centre, 3N float32 each, or three for `ends`; `radii`: N float32 or one, above 0; `half_axes`: 3N float32 or
        three, from the centre to one end of the inner segment; `half_extents`: 3N float32 or three, along the box's own
        axes; `rotations`: 4N float32 or four, unit quaternions x, y, z, w, for boxes; `at_start`: how objects and
        triangles that the solid touches at t = 0 are treated.
        """
        new = _NewBlock(self._blocks, "sweeps")
        new.first("starts", starts, FLOAT32, 3)
        new.column("ends", ends, FLOAT32, 3)
        new.column("radii", radii, FLOAT32)
        new.column("half_axes", half_axes, FLOAT32, 3)
        new.column("half_extents", half_extents, FLOAT32, 3)
        new.column("rotations", rotations, FLOAT32, 4)
        new.options(mode=mode, at_start=at_start)
        return self._add(new, block)

    def nearest(self, points: ColumnLike, *, k: int = 1, max_distances: ColumnLike = None,
                detail: StaticDetail = StaticDetail.INSTANCES, after: Optional[After] = None,
                block: Block = Block()) -> "QueryBatch":
        """Adds a block of N points, to find the nearest objects and instances. `points`: 3N float32; `k`: maximum
        number of rows per point, by ascending distance. Column T contains the distance: 0 inside an object; for a mesh
        always the distance to its surface. `max_distances`: N float32 or one, inclusive, +infinity by default;
        `detail`: INSTANCES returns one row per instance, for its nearest triangle; `after`: only rows after this
        position.
        """
        new = _NewBlock(self._blocks, "nearest")
        new.first("points", points, FLOAT32, 3)
        new.column("max_distances", max_distances, FLOAT32)
        new.after(after)
        new.options(k=k, detail=detail)
        return self._add(new, block)

    def frustums(self, planes: ColumnLike, *, planes_each: int = 6, detail: StaticDetail = StaticDetail.INSTANCES,
                 block: Block = Block()) -> "QueryBatch":
        """Adds a block of N convex regions, to find the objects and instances that overlap them. `planes`: for each
        region, `planes_each` planes (4 .. 32) of four float32 nx, ny, nz, d; a point p is inside a plane if n.p + d >=
        0.
        """
        new = _NewBlock(self._blocks, "frustums")
        new.first("planes", planes, FLOAT32, 4 * planes_each, 4)
        new.options(planes_each=planes_each, detail=detail)
        return self._add(new, block)

    def views(self, view_projections: ColumnLike, *, clip_depth: ClipDepth = ClipDepth.ZERO_TO_ONE,
              detail: StaticDetail = StaticDetail.INSTANCES, block: Block = Block()) -> "QueryBatch":
        """Adds a block of the views of N cameras, to find the objects and instances in view. `view_projections`: 16N
        float32, column-major matrices that map positions to clip coordinates.
        """
        new = _NewBlock(self._blocks, "frustums")
        new.first("view_projections", view_projections, FLOAT32, 16, 4)
        new.options(clip_depth=clip_depth, detail=detail)
        return self._add(new, block)

    def contains(self, points: ColumnLike, *, block: Block = Block()) -> "QueryBatch":
        """Adds a block of N points, to find the objects and the instances of closed meshes that contain them. `points`:
        3N float32.
        """
        new = _NewBlock(self._blocks, "contains")
        new.first("points", points, FLOAT32, 3)
        return self._add(new, block)

    def sight(self, viewers: ColumnLike, targets: ColumnLike, *, eyes: int = 1, samples: int = 1,
              viewer_groups: ColumnLike = None, target_groups: ColumnLike = None, max_distances: ColumnLike = None,
              pairwise: bool = False, block: Block = Block()) -> "QueryBatch":
        """Adds a block of V viewers that look at M targets; BlockResult.sight has a byte for each viewer and target.
        `viewers`: float32, `eyes` points for each viewer; `targets`: float32, `samples` points for each target;
        `viewer_groups`: V uint64 or one; `target_groups`: M uint64 or one. Objects and instances in the group of a
        viewer or of a target do not block the sight between these two. `max_distances`: V float32 or one, inclusive;
        `pairwise`: viewer i looks only at target i.
        """
        new = _NewBlock(self._blocks, "sight")
        new.first("viewers", viewers, FLOAT32, 3 * eyes, 3)
        new.column("viewer_groups", viewer_groups, UINT64)
        new.column("max_distances", max_distances, FLOAT32)
        viewer_count = new.count
        new.first("targets", targets, FLOAT32, 3 * samples, 3)
        new.column("target_groups", target_groups, UINT64)
        new.count = viewer_count
        new.options(eyes_per_viewer=eyes, samples_per_target=samples, pairwise=pairwise)
        return self._add(new, block)

    def pairs(self, max_distance: float = 0.0, *, first_mask: int = 0, second_mask: int = 0, k: int = 0,
              after_other: int = 0, block: Block = Block()) -> "QueryBatch":
        """Adds one query for the pairs of objects within `max_distance` of each other; 0 finds objects that touch.
        `first_mask`, `second_mask`: layers of the two objects, 0 = all; `k`: find only the k nearest objects of each
        object; `after_other`, together with Block.after_id: only rows after this pair.
        """
        new = _NewBlock(self._blocks, "pairs")
        new.count = 1
        new.numbers(max_distance=max_distance)
        new.masks(first_mask=first_mask, second_mask=second_mask)
        new.options(k=k)
        if after_other:
            new.kind.add_fixed64(_KINDS["pairs"]["after_other"], after_other)
        return self._add(new, block)

    def cells(self, points: ColumnLike, max_distances: ColumnLike, *, max_planes: int = 32,
              block: Block = Block()) -> "QueryBatch":
        """Adds a block of N points, to get the convex free space around each of them. `points`: 3N float32;
        `max_distances`: N float32 or one, above 0. The first row of a point describes the ball that bounds the space:
        it has id 0, and T is the radius of the ball. Each further row is a plane. A point in or on an object or
        triangle has no rows.
        """
        new = _NewBlock(self._blocks, "cells")
        new.first("points", points, FLOAT32, 3)
        new.column("max_distances", max_distances, FLOAT32)
        new.options(max_planes=max_planes)
        return self._add(new, block)

    def lookup(self, ids: ColumnLike, *, block: Block = Block()) -> "QueryBatch":
        """Adds a lookup of objects and instances by N uint64 ids. Each id has one row, in the order of `ids`; the row
        of an unknown id has id 0.
        """
        new = _NewBlock(self._blocks, "lookup")
        new.first("ids", ids, UINT64)
        return self._add(new, block)

    def lookup_groups(self, groups: ColumnLike, *, block: Block = Block()) -> "QueryBatch":
        """Adds a lookup of N uint64 groups, not 0. Each group has one row for each of its objects and instances,
        ascending by id.
        """
        new = _NewBlock(self._blocks, "lookup")
        new.first("groups", groups, UINT64)
        return self._add(new, block)

    def request_bytes(self, scene: str) -> bytes:
        """Returns the encoded request for Query. The columns are copied, so the borrowed buffers may be changed
        afterwards.
        """
        request = wire.Parts()
        request.add(_REQUEST["scene"], scene.encode())
        request.add_parts(_REQUEST["batch"], self._parts)
        return b"".join(request.pieces)

    def batch_bytes(self) -> bytes:
        """Returns the encoded QueryBatch. The columns are copied, so the borrowed buffers may be changed afterwards."""
        return b"".join(self._parts.pieces)

    def _add(self, new: _NewBlock, settings: Block) -> QueryBatch:
        """Adds a complete block to the batch. Adds nothing if the block's settings are refused."""
        block = wire.Parts()
        settings.write(block, new.path, new.count)
        block.add_parts(_BLOCK[new.name], new.kind)
        self._parts.add_parts(_BATCH["blocks"], block)
        self._blocks += 1
        return self


class _NewBlock:
    """Builder of the part of a block that depends on its kind."""

    def __init__(self, blocks_before: int, name: str) -> None:
        self.path = f"blocks[{blocks_before}]."
        self.name = name
        self.kind = wire.Parts()
        self.count = 0

    def first(self, name: str, value: ColumnLike, number_type: columns.Kind, width: int = 1, part: int = 0) -> None:
        """Adds the first column, which determines the number of queries."""
        raw = columns.borrow(f"{self.path}{self.name}.{name}", value, number_type, width, part)
        self.count = columns.entries(raw, number_type, width)
        self.kind.add(_KINDS[self.name][name], raw)

    def column(self, name: str, value: ColumnLike, number_type: columns.Kind, width: int = 1) -> None:
        if value is not None:
            path = f"{self.path}{self.name}.{name}"
            self.kind.add(_KINDS[self.name][name], columns.borrow_for(path, value, number_type, self.count, width))

    def after(self, after: Optional[After]) -> None:
        """Adds the position after which the queries continue."""
        if after is not None:
            self.column("after_ts", after.ts, FLOAT32)
            self.column("after_ids", after.ids, UINT64)
            self.column("after_triangles", after.triangles, UINT32)

    def numbers(self, **fields: float) -> None:
        """Adds fields of type float to the message of the query kind. Fields that are 0 are omitted."""
        for name, value in fields.items():
            if value:
                self.kind.add_fixed32(_KINDS[self.name][name], struct.unpack("<I", struct.pack("<f", value))[0])

    def masks(self, **fields: int) -> None:
        """Adds fields of type fixed32 to the message of the query kind. Fields that are 0 are omitted."""
        for name, value in fields.items():
            if value:
                self.kind.add_fixed32(_KINDS[self.name][name], value)

    def options(self, **fields: int) -> None:
        """Adds varint fields (bool, enum or uint32) to the message of the query kind. Fields that are 0 are omitted."""
        for name, value in fields.items():
            if value:
                self.kind.add_varint(_KINDS[self.name][name], value)
