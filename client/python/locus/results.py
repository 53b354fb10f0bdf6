"""Results of query batches: columns that are views of the received bytes, accessed by query and row."""
from __future__ import annotations

import dataclasses
import functools
from typing import List, Optional, Sequence, Tuple, Union, overload

import grpc

from . import columns, schema, wire
from .columns import FLOAT32, FLOAT64, UINT8, UINT32, UINT64, Values
from .errors import LocusError, from_error, neither, parsed
from .values import Ack, Revision, Work

_Work = schema.message("Work")
_Ack = schema.message("UpdateAck")
_Error = schema.message("Error")
NO_TRIANGLE = 0xFFFFFFFF

_RESULT = schema.numbers("QueryResult")
_BLOCK = schema.numbers("BlockResult")
_IN_RESPONSE = schema.numbers("QueryResponse")["result"]
_STEP = schema.numbers("StepResponse")
# _ROW_BYTES: columns with one entry per row, and the size of an entry in bytes. The number of rows of a block is
# computed from the first of these columns that the block contains, so the two most frequent columns come first.
_COUNTS = _BLOCK["counts"]
_ROW_BYTES = tuple((_BLOCK[name], size) for name, size in (
    ("ids", 8), ("t", 4), ("triangles", 4), ("uvs", 8), ("normals", 12), ("points", 12), ("groups", 8), ("tags", 8),
    ("layers", 4), ("positions", 24), ("others", 8),
    ("shapes", 4), ("sizes", 16)))


class _Column:
    """Descriptor of a column of a BlockResult. The column is decoded when it is first read, and then stored as an
    attribute of the block.
    """

    def __init__(self, doc: str, kind: columns.Kind, width: int = 1, *, by_row: bool = True) -> None:
        self.__doc__ = doc
        self._kind = kind
        self._width = width
        self._by_row = by_row

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name
        self._number = _BLOCK[name]

    @overload
    def __get__(self, block: None, owner: type) -> _Column: ...

    @overload
    def __get__(self, block: BlockResult, owner: type) -> Values: ...

    def __get__(self, block: Optional[BlockResult], owner: type) -> Union[_Column, Values]:
        if block is None:
            return self
        raw = wire.column(block._fields, self._number)
        if self._by_row:
            if raw and len(raw) != block.rows * self._kind.size * self._width:
                raise _contradiction(f"{self._name} has {len(raw)} bytes for {block.rows} rows")
        elif len(raw) % self._kind.size:
            raise _contradiction(f"{self._name} has {len(raw)} bytes")
        values = columns.decode(raw, self._kind, self._width)
        block.__dict__[self._name] = values
        return values


class BlockResult:
    """Result of one block of N queries: R rows in columns, first the rows of the first query, then those of the second,
    and so on.

    A column is a read-only numpy array of shape (R,) or (R, width), or, without numpy, a flat array.array. A column
    that was not requested is empty. Columns are decoded when first read. Immutable.
    """

    def __init__(self, message: memoryview) -> None:
        self._fields = wire.fields(message)
        self._rows: Optional[int] = None

    counts = _Column("Number of rows of each query: N uint32; empty if every query has one row (rays FIRST, lookups of "
                     "ids) or none (rays ANY, sight).", UINT32, by_row=False)
    truncated = _Column("Indices of the queries whose result is incomplete (more rows, work or planes than the limit): "
                        "uint32, ascending.",
                        UINT32, by_row=False)
    hits = _Column("Rays ANY: N uint8, 1 if the ray has a hit, else 0.", UINT8, by_row=False)
    sight = _Column("Sight: VM uint8, viewer by viewer, the number of the target's samples that are seen; with `pairwise` "
                    "V uint8.", UINT8, by_row=False)
    unanchored = _Column("Indices of the queries without rows because their anchor is unknown or their position is outside "
                         "the world: uint32, ascending.",
                         UINT32, by_row=False)
    t = _Column("R float32. Rays: t, whose unit is the length of the ray's direction; +infinity for a miss. Nearest: "
                "the distance.", FLOAT32)
    ids = _Column("R uint64 ids of objects and instances; 0 for a miss.", UINT64)
    triangles = _Column("R uint32 indices of triangles in the mesh's uploaded list; NO_TRIANGLE for a miss, an object, "
                        "or the row of a whole instance.", UINT32)
    uvs = _Column("2R float32: the weights of the triangle's second and third vertex at the hit.", FLOAT32, 2)
    normals = _Column("3R float32: the unit normal at the hit, in world axes.", FLOAT32, 3)
    points = _Column("3R float32: position of the hit, or the nearest point, relative to the block's frame.",
                     FLOAT32, 3)
    groups = _Column("R uint64 groups; 0 for no group and for a miss.", UINT64)
    tags = _Column("R uint64 tags; 0 for a miss.", UINT64)
    layers = _Column("R uint32 sets of layer bits; 0 for a miss.", UINT32)
    positions = _Column("3R float64: an object's centre or an instance's translation, absolute; 0 for a miss.",
                        FLOAT64, 3)
    rotations = _Column("4R float32: the rotation as stored, x, y, z, w; 0 for a miss.", FLOAT32, 4)

    others = _Column("R uint64 ids of the second object of each pair.", UINT64)
    shapes = _Column("R uint32: 1 point, 2 ball, 3 box, 4 capsule, 5 instance of a mesh; 0 for a miss.", UINT32)
    sizes = _Column("4R float32: radius (of an instance: scale), then the half extents of a box or the half axis of a "
                    "capsule, in local axes; 0 where they do not apply.", FLOAT32, 4)

    resolved_ticks = _Column("N uint64: the effective tick of each query; empty without `as_of_ticks`.", UINT64,
                             by_row=False)
    resolved_fractions = _Column("N float32: the effective fraction of each query; empty without `as_of_ticks`.",
                                 FLOAT32, by_row=False)
    clamped = _Column("Indices of the queries whose time was outside the history: uint32, ascending.", UINT32,
                      by_row=False)

    @property
    def work(self) -> Optional[Work]:
        """Work of this block; None without `explain`."""
        return _work_in(self._fields, _BLOCK["work"])

    def rows_of(self, query: int) -> slice:
        """Returns a slice that selects the rows of one query from any column that has one number per row. The first
        call takes time linear in N, the number of queries.
        """
        if not len(self.counts):
            return slice(query, query + 1)
        return slice(self._begins[query], self._begins[query + 1])

    @functools.cached_property
    def _begins(self) -> Sequence[int]:
        begins: List[int] = [0]
        for count in self.counts.tolist():
            begins.append(begins[-1] + count)
        return begins

    @property
    def rows(self) -> int:
        """Number of rows, R; with `count_only`, the number of rows that are counted but not contained in the block."""
        if self._rows is None:
            if _COUNTS in self._fields:
                self._rows = self._begins[-1]
            else:
                self._rows = 0
                for number, size in _ROW_BYTES:
                    if number in self._fields:
                        self._rows = len(wire.column(self._fields, number)) // size
                        break
        return self._rows


@dataclasses.dataclass(frozen=True, eq=False, init=False)
class QueryResult(Revision):
    """Result of a batch at one revision. `blocks` are in the order of the request; `tick` is the scene's tick.

    `work` is the work of the whole batch; None without `explain`. `age_ms`: in a cluster, the time in milliseconds for
    which the server may have missed later revisions, rounded up; 0 from the leader of the scene.
    """

    tick: int
    blocks: Tuple[BlockResult, ...]
    work: Optional[Work]
    age_ms: int

    @classmethod
    def of(cls, message: memoryview) -> "QueryResult":
        """Decodes the protocol's QueryResult. Columns are views of `message`, so the memory of `message` is freed only
        after the last column has been freed.
        """
        found = wire.fields(message)
        result = cls.__new__(cls)
        # Set all attributes by one update() of the dictionary, which is measurably faster than one object.__setattr__()
        # for each.
        result.__dict__.update(
            epoch=wire.fixed64(found, _RESULT["epoch"]), revision=wire.fixed64(found, _RESULT["revision"]),
            tick=wire.fixed64(found, _RESULT["tick"]), work=_work_in(found, _RESULT["work"]),
            age_ms=wire.varint(found, _RESULT["age_ms"]),
            blocks=tuple(map(BlockResult, wire.views(found, _RESULT["blocks"]))))
        return result

    @classmethod
    def from_bytes(cls, response: bytes) -> "QueryResult":
        """Decodes a response of Query."""
        return cls.of(wire.column(wire.fields(memoryview(response)), _IN_RESPONSE))


@dataclasses.dataclass(frozen=True)
class StepResult:
    """Result of a step: its update was applied, except the refused items in `ack`.

    `error` is the LocusError of the queries, or None. The update stays applied if the queries fail.
    """

    ack: Ack
    error: Optional[LocusError]
    _result: Optional[QueryResult]

    @property
    def result(self) -> QueryResult:
        """Result of the queries, at the revision of `ack` or a later one. Raises `error` if the queries failed."""
        if self._result is None:
            raise self.error or neither()
        return self._result

    @classmethod
    def of(cls, found: wire.Fields, ack: int, result: int, error: int) -> "StepResult":
        """Decodes a response of Step or StreamQueries from its fields. The other arguments are field numbers."""
        failed = from_error(parsed(_Error, bytes(wire.column(found, error)))) if error in found else None
        answer = QueryResult.of(wire.column(found, result)) if result in found else None
        return cls(Ack.of(parsed(_Ack, bytes(wire.column(found, ack)))), failed, answer)

    @classmethod
    def from_bytes(cls, response: bytes) -> "StepResult":
        """Decodes a response of Step."""
        return cls.of(wire.fields(memoryview(response)), _STEP["ack"], _STEP["result"], _STEP["error"])


def _contradiction(what: str) -> LocusError:
    return LocusError(grpc.StatusCode.DATA_LOSS, f"the answer contradicts itself: {what}; report it")


def _work_in(found: wire.Fields, number: int) -> Optional[Work]:
    return Work.of(parsed(_Work, bytes(wire.column(found, number)))) if number in found else None
