"""Part of protobuf's wire format: decodes query results without copies, and frames encoded batches. Internal to the
package.

Parsing an answer with protobuf would copy each column twice (into the message and out of the message), and these copies
would be most of the client's cost of an answer. In this module a decoded column is a view of the received bytes. All
other messages are encoded and decoded by protobuf with the mirrored schema (schema.py).
"""
from __future__ import annotations

import struct
from typing import Any, Dict, List, Sequence, Tuple, Union

from . import schema
from .columns import Raw
from .errors import unreadable

Fields = Dict[int, List[Any]]
_VARINT, _FIXED64, _DELIMITED, _FIXED32 = 0, 1, 2, 5
_MAX_VARINT_BYTES = 10
_NOTHING = memoryview(b"")
_VECTOR = struct.Struct("<BdBdBd")
_AXES = tuple(number << 3 | _FIXED64 for number in schema.numbers("Vec3d").values())


def _varint(data: memoryview, position: int) -> Tuple[int, int]:
    value = 0
    for count in range(_MAX_VARINT_BYTES):
        if position >= len(data):
            raise unreadable("it ends within a number")
        byte = data[position]
        position += 1
        value |= (byte & 127) << (7 * count)
        if byte < 128:
            return value, position
    raise unreadable("a number has too many bytes")


def fields(data: memoryview) -> Fields:
    """Returns the fields of a message by number. Each value is the list of a field's occurrences: ints for varints,
    memory views for other types.

    Cost: linear in the number of fields, independent of their size. Raises LocusError DATA_LOSS if `data` is not a
    message.
    """
    found: Fields = {}
    position = 0
    while position < len(data):
        tag = data[position]
        if tag < 128:
            position += 1
        else:
            tag, position = _varint(data, position)
        kind = tag & 7
        value: Union[int, memoryview]
        if kind == _VARINT:
            value, position = _varint(data, position)
        else:
            if kind == _DELIMITED:
                size, position = _varint(data, position)
            elif kind in (_FIXED64, _FIXED32):
                size = 8 if kind == _FIXED64 else 4
            else:
                raise unreadable(f"wire type {kind}")
            if position + size > len(data):
                raise unreadable(f"field {tag >> 3} has more bytes than the message")
            value = data[position:position + size]
            position += size
        found.setdefault(tag >> 3, []).append(value)
    return found


def column(found: Fields, number: int) -> memoryview:
    """Returns the bytes of the column in field `number`, empty if the field is absent. If the field occurs several
    times, which protobuf allows for a column, its parts are joined.
    """
    pieces = views(found, number)
    if not pieces:
        return _NOTHING
    return pieces[0] if len(pieces) == 1 else memoryview(b"".join(pieces))


def views(found: Fields, number: int) -> List[memoryview]:
    """Returns every occurrence of a field whose type is not varint, for example of a repeated message."""
    pieces = found.get(number, [])
    for piece in pieces:
        if isinstance(piece, int):
            raise unreadable(f"field {number} is a number")
    return pieces


def fixed64(found: Fields, number: int) -> int:
    """Returns a fixed64 field, 0 if it is absent."""
    pieces = views(found, number)
    return int.from_bytes(pieces[-1], "little") if pieces else 0


def varint(found: Fields, number: int) -> int:
    """Returns a uint32 or bool field, 0 if it is absent."""
    if number not in found:
        return 0
    value = found[number][-1]
    if not isinstance(value, int):
        raise unreadable(f"field {number} is no number")
    return value


def _encoded(value: int) -> bytes:
    if value < 128:
        return _SMALL[value]
    result = bytearray()
    while value > 127:
        result.append(value & 127 | 128)
        value >>= 7
    result.append(value)
    return bytes(result)


_SMALL = tuple(bytes((value,)) for value in range(128))


def head(number: int, size: int) -> bytes:
    """Returns the tag and length of field `number`, whose content is a message, string or column of `size` bytes."""
    return _encoded(number << 3 | _DELIMITED) + _encoded(size)


def vector(xyz: Sequence[float]) -> bytes:
    """Returns the encoded Vec3d."""
    x, y, z = _AXES
    return _VECTOR.pack(x, xyz[0], y, xyz[1], z, xyz[2])


class Parts:
    """Encoded message as a list of byte strings. The columns in the list are borrowed: they are copied only once, when
    the caller joins the list.
    """

    def __init__(self) -> None:
        self.pieces: List[Raw] = []
        self.size = 0

    def add(self, number: int, content: Raw) -> None:
        """Appends field `number` with this content. Appends nothing if `content` is empty, since an empty column means
        the same as an absent column.
        """
        size = len(content)
        if size:
            before = head(number, size)
            self.pieces += (before, content)
            self.size += len(before) + size

    def add_parts(self, number: int, parts: Parts) -> None:
        """Appends the message `parts` as field `number`. The message may be empty."""
        before = head(number, parts.size)
        self.pieces.append(before)
        self.pieces += parts.pieces
        self.size += len(before) + parts.size

    def add_fixed64(self, number: int, value: int) -> None:
        """Appends field `number`, a fixed64. Raises OverflowError if the value is out of range."""
        self._put(_encoded(number << 3 | _FIXED64) + value.to_bytes(8, "little"))

    def add_fixed32(self, number: int, value: int) -> None:
        """Appends field `number`, a fixed32. Raises OverflowError if the value is out of range."""
        self._put(_encoded(number << 3 | _FIXED32) + value.to_bytes(4, "little"))

    def add_varint(self, number: int, value: int) -> None:
        """Appends field `number`, a bool, an enum or a uint32. Raises OverflowError if the value is out of range."""
        if not 0 <= value < 1 << 32:
            raise OverflowError(f"{value} is no uint32")
        self._put(_encoded(number << 3 | _VARINT) + _encoded(value))

    def _put(self, field: bytes) -> None:
        self.pieces.append(field)
        self.size += len(field)
