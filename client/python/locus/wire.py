"""Protobuf's wire format, as far as columns need it: reading answers without copying them, and framing batches that are
bytes already; internal to the package.

Parsing an answer with protobuf would copy each column twice (into the message and out of it), which is most of what an
answer costs a client. Here a column is a view of the received bytes. Everything else goes through the mirrored schema.
"""
from __future__ import annotations

from typing import Any, Dict, List, Tuple, Union

from .errors import unreadable

Fields = Dict[int, List[Any]]
_VARINT, _FIXED64, _DELIMITED, _FIXED32 = 0, 1, 2, 5
_MOST_VARINT_BYTES = 10
_NOTHING = memoryview(b"")


def _varint(data: memoryview, position: int) -> Tuple[int, int]:
    value = 0
    for count in range(_MOST_VARINT_BYTES):
        if position >= len(data):
            raise unreadable("it ends within a number")
        byte = data[position]
        position += 1
        value |= (byte & 127) << (7 * count)
        if byte < 128:
            return value, position
    raise unreadable("a number has too many bytes")


def fields(data: memoryview) -> Fields:
    """A message's fields by number, each with its occurrences: ints of varints, views of everything else.

    Linear in the number of fields, whatever their size. LocusError DATA_LOSS for bytes that are no message.
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
    """A column's bytes; empty where there is none. One that was sent in pieces, as protobuf allows, is joined."""
    pieces = views(found, number)
    if not pieces:
        return _NOTHING
    return pieces[0] if len(pieces) == 1 else memoryview(b"".join(pieces))


def views(found: Fields, number: int) -> List[memoryview]:
    """Every occurrence of a field that is no varint, messages for example."""
    pieces = found.get(number, [])
    for piece in pieces:
        if isinstance(piece, int):
            raise unreadable(f"field {number} is a number")
    return pieces


def fixed64(found: Fields, number: int) -> int:
    """A fixed64 field; 0 where there is none."""
    pieces = views(found, number)
    return int.from_bytes(pieces[-1], "little") if pieces else 0


def delimited(number: int, content: bytes) -> Tuple[bytes, bytes]:
    """What to join into a message so that `content` is its field `number`."""
    head = bytearray()
    for value in (number << 3 | _DELIMITED, len(content)):
        while value > 127:
            head.append(value & 127 | 128)
            value >>= 7
        head.append(value)
    return bytes(head), content
