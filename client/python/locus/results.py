"""Answers to query batches: columns over the received bytes, by query and row."""
from __future__ import annotations

import dataclasses
import functools
from typing import Dict, List, Optional, Sequence, Tuple

import grpc

from . import columns, schema, wire
from .columns import FLOAT32, FLOAT64, UINT8, UINT32, UINT64, Values
from .errors import LocusError, parsed
from .values import Revision, Work

_Work = schema.message("Work")
NO_TRIANGLE = 0xFFFFFFFF


def _numbers(message: str) -> Dict[str, int]:
    return {field.name: field.number for field in schema.message(message).DESCRIPTOR.fields}


_RESULT = _numbers("QueryResult")
_BLOCK = _numbers("BlockResult")
_IN_RESPONSE = _numbers("QueryResponse")["result"]
# Bytes a row of each column that tells how many rows there are; the two wanted most often first.
_ROW_BYTES = {"ids": 8, "t": 4, "triangles": 4, "uvs": 8, "normals": 12, "points": 12, "groups": 8, "tags": 8,
              "layers": 4, "positions": 24}


class BlockResult:
    """The answer to one block: R rows in columns, the rows of its queries one after another, in their order.

    A column is a read-only numpy array of shape (R,) or (R, width), or, without numpy, a flat array.array. One that was
    not asked for is empty. Columns are made when first read. Immutable.
    """

    def __init__(self, message: memoryview) -> None:
        self._fields = wire.fields(message)

    @functools.cached_property
    def counts(self) -> Values:
        """N uint32: rows of each query; empty where each has one (rays FIRST, lookups of ids) or none (rays ANY)."""
        return self._list("counts", UINT32)

    @functools.cached_property
    def truncated(self) -> Values:
        """uint32 numbers of the queries that had more rows than they report, ascending."""
        return self._list("truncated", UINT32)

    @functools.cached_property
    def hits(self) -> Values:
        """Rays ANY: N uint8, 1 where something is hit, else 0."""
        return self._list("hits", UINT8)

    @functools.cached_property
    def t(self) -> Values:
        """R float32, in lengths of the ray's direction; +infinity for a miss."""
        return self._column("t", FLOAT32)

    @functools.cached_property
    def ids(self) -> Values:
        """R uint64 ids of objects and instances; 0 for a miss."""
        return self._column("ids", UINT64)

    @functools.cached_property
    def triangles(self) -> Values:
        """R uint32 positions in the mesh's index list; NO_TRIANGLE for a miss, an object, or an instance's own row."""
        return self._column("triangles", UINT32)

    @functools.cached_property
    def uvs(self) -> Values:
        """2R float32: the weights of the triangle's second and third vertex at the hit."""
        return self._column("uvs", FLOAT32, 2)

    @functools.cached_property
    def normals(self) -> Values:
        """3R float32: the unit normal at the hit, in world axes."""
        return self._column("normals", FLOAT32, 3)

    @functools.cached_property
    def points(self) -> Values:
        """3R float32: where the hit is, relative to the block's frame."""
        return self._column("points", FLOAT32, 3)

    @functools.cached_property
    def groups(self) -> Values:
        """R uint64 groups; 0 for none and for a miss."""
        return self._column("groups", UINT64)

    @functools.cached_property
    def tags(self) -> Values:
        """R uint64 tags; 0 for a miss."""
        return self._column("tags", UINT64)

    @functools.cached_property
    def layers(self) -> Values:
        """R uint32 sets of layer bits; 0 for a miss."""
        return self._column("layers", UINT32)

    @functools.cached_property
    def positions(self) -> Values:
        """3R float64: an object's centre or an instance's translation, absolute; 0 for a miss."""
        return self._column("positions", FLOAT64, 3)

    @functools.cached_property
    def rotations(self) -> Values:
        """4R float32: the rotation as stored, x, y, z, w; 0 for a miss."""
        return self._column("rotations", FLOAT32, 4)

    @property
    def work(self) -> Optional[Work]:
        """The work of this block; None without `explain`."""
        return _work_in(self._fields, _BLOCK["work"])

    def rows_of(self, query: int) -> slice:
        """The rows of one query, to index columns of one number a row with. Linear in N once."""
        if not len(self.counts):
            return slice(query, query + 1)
        return slice(self._begins[query], self._begins[query + 1])

    @functools.cached_property
    def _begins(self) -> Sequence[int]:
        begins: List[int] = [0]
        for count in self.counts.tolist():
            begins.append(begins[-1] + count)
        return begins

    @functools.cached_property
    def rows(self) -> int:
        """R, the number of rows."""
        if _BLOCK["counts"] in self._fields:
            return self._begins[-1]
        return next((len(self._raw(name)) // size for name, size in _ROW_BYTES.items() if _BLOCK[name] in self._fields), 0)

    def _raw(self, name: str) -> memoryview:
        return wire.column(self._fields, _BLOCK[name])

    def _column(self, name: str, kind: columns.Kind, width: int = 1) -> Values:
        raw = self._raw(name)
        if raw and len(raw) != self.rows * kind.size * width:
            raise _contradiction(f"{name} has {len(raw)} bytes for {self.rows} rows")
        return columns.decode(raw, kind, width)

    def _list(self, name: str, kind: columns.Kind) -> Values:
        """A column that does not go by rows."""
        raw = self._raw(name)
        if len(raw) % kind.size:
            raise _contradiction(f"{name} has {len(raw)} bytes")
        return columns.decode(raw, kind)


@dataclasses.dataclass(frozen=True, eq=False)
class QueryResult(Revision):
    """The answer to a batch, all at one revision: `blocks` in the order of the request, `tick` the scene's.

    `work` is that of the whole batch; None without `explain`.
    """

    tick: int
    blocks: Tuple[BlockResult, ...]
    work: Optional[Work]

    @classmethod
    def of(cls, message: memoryview) -> "QueryResult":
        """From the protocol's QueryResult in its wire form, which is kept as long as a column of it is."""
        found = wire.fields(message)
        epoch, revision, tick = (wire.fixed64(found, _RESULT[name]) for name in ("epoch", "revision", "tick"))
        blocks = tuple(map(BlockResult, wire.views(found, _RESULT["blocks"])))
        return cls(epoch, revision, tick, blocks, _work_in(found, _RESULT["work"]))

    @classmethod
    def from_bytes(cls, response: bytes) -> "QueryResult":
        """From a whole response of Query, as it came over the wire."""
        return cls.of(wire.column(wire.fields(memoryview(response)), _IN_RESPONSE))


def _contradiction(what: str) -> LocusError:
    return LocusError(grpc.StatusCode.DATA_LOSS, f"the answer contradicts itself: {what}; report it")


def _work_in(found: wire.Fields, number: int) -> Optional[Work]:
    return Work.of(parsed(_Work, bytes(wire.column(found, number)))) if number in found else None
