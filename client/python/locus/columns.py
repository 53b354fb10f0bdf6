"""Columns between Python and the wire: any buffer or list goes in, numpy arrays or array.array come out.

A column is packed little-endian numbers, several to an entry where an entry is a vector: N positions are 3N float32.
Going in, a buffer of the right type (numpy array of any shape, array.array, memoryview) is taken in C order, so arrays
with gaps are fine; `bytes` and `bytearray` are taken as they are; numbers and (nested) lists are converted.
Nothing of another type is converted silently: float64 given for float32 would round, int64 for ids would wrap.

Coming out, a column is a numpy array over the received bytes, without a copy and therefore read-only, of shape (R,) or
(R, width); where numpy is not installed it is a flat array.array, copied once.
"""
from __future__ import annotations

import array
import itertools
import numbers
from typing import Any, Iterable, Iterator, List, NamedTuple, Protocol, Tuple, Union

try:
    import numpy
except ImportError:
    numpy = None  # type: ignore[assignment]

HAS_NUMPY = numpy is not None

# What a column can be given as: a buffer, bytes, one number, a list of numbers or a list of vectors.
ColumnLike = Any
# A column's bytes, little-endian.
Raw = Union[bytes, bytearray, memoryview]


class Values(Protocol):
    """A column that came back: a numpy array or an array.array."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: Any) -> Any: ...
    def __iter__(self) -> Iterator[Any]: ...

    def tolist(self) -> List[Any]:
        """The column as a list of Python numbers."""


class Kind(NamedTuple):
    """A type of number: its name, its code in array.array, its size in bytes, its codes in buffers."""

    name: str
    code: str
    size: int
    formats: Tuple[str, ...]


FLOAT32 = Kind("float32", "f", 4, ("f",))
FLOAT64 = Kind("float64", "d", 8, ("d",))
UINT32 = Kind("uint32", "I", 4, ("I", "L"))
UINT64 = Kind("uint64", "Q", 8, ("Q", "L"))
UINT8 = Kind("uint8", "B", 1, ("B",))
_DTYPES = {} if numpy is None else {kind.code: numpy.dtype(kind.name) for kind in (FLOAT32, FLOAT64, UINT32, UINT64, UINT8)}
_NAMES = {"e": "float16", "f": "float32", "d": "float64", "?": "bool"}


def _name_of(view: memoryview) -> str:
    code = view.format[-1:]
    if view.format[0] in ">!":
        return f"big-endian '{view.format}'"
    if code in _NAMES:
        return _NAMES[code]
    if code in "bhilqnBHILQN":
        return f"{'u' if code.isupper() else ''}int{8 * view.itemsize}"
    return f"'{view.format}'"


def _from_buffer(path: str, view: memoryview, kind: Kind) -> Raw:
    """The view's bytes in C order, borrowed where they lie so already."""
    format = view.format
    if view.itemsize != kind.size or (format not in kind.formats and format.lstrip("@=<") not in kind.formats):
        raise TypeError(f"{path}: holds {_name_of(view)}, but {kind.name} is wanted: convert it, "
                        f"for example with .astype('{kind.name}')")
    if view.c_contiguous and len(format) == 1:
        return view.cast("B")
    return view.tobytes()


def _flat(value: Iterable[Any]) -> Iterable[Any]:
    items = value if isinstance(value, (list, tuple)) else list(value)
    if not items or isinstance(items[0], (float, int, numbers.Number)):
        return items
    return list(itertools.chain.from_iterable(items))


def _from_numbers(path: str, value: Any, kind: Kind) -> bytes:
    try:
        items = [value] if isinstance(value, (float, int, numbers.Number)) else _flat(value)
        return array.array(kind.code, items).tobytes()
    except (TypeError, OverflowError) as error:
        raise TypeError(f"{path}: {error}: give {kind.name} numbers, as a list or a buffer") from error


def borrow(path: str, value: ColumnLike, kind: Kind, width: int = 1) -> Raw:
    """The column as it goes over the wire; None is an empty one. A buffer is not copied: it is read when it is sent.

    `path` names the column in errors. TypeError for numbers of another type, ValueError if there are not `width`
    numbers for each entry. Linear for lists and for arrays with gaps.
    """
    if value is None:
        return b""
    raw: Raw
    if isinstance(value, (bytes, bytearray)):
        raw = value
    elif isinstance(value, (float, int, list, tuple)):
        raw = _from_numbers(path, value, kind)
    else:
        try:
            view = memoryview(value)
        except TypeError:
            raw = _from_numbers(path, value, kind)
        else:
            raw = _from_buffer(path, view, kind)
    if len(raw) % (kind.size * width):
        count = f"{len(raw) // kind.size} numbers" if len(raw) % kind.size == 0 else f"{len(raw)} bytes"
        raise ValueError(f"{path}: has {count}: give {width} {kind.name} for each entry")
    return raw


def entries(raw: Raw, kind: Kind, width: int = 1) -> int:
    """Number of entries of an encoded column."""
    return len(raw) // (kind.size * width)


def borrow_for(path: str, value: ColumnLike, kind: Kind, count: int, width: int = 1) -> Raw:
    """Like borrow(), for a column that holds `count` entries, one for all, or none; ValueError otherwise."""
    raw = borrow(path, value, kind, width)
    found = entries(raw, kind, width)
    if found not in (0, 1, count):
        raise ValueError(f"{path}: has {found} entries: give {count}, one for all, or none")
    return raw


def encode(path: str, value: ColumnLike, kind: Kind, width: int = 1) -> bytes:
    """Like borrow(), but copied."""
    return bytes(borrow(path, value, kind, width))


def encode_for(path: str, value: ColumnLike, kind: Kind, count: int, width: int = 1) -> bytes:
    """Like borrow_for(), but copied."""
    return bytes(borrow_for(path, value, kind, count, width))


def decode(raw: Raw, kind: Kind, width: int = 1) -> Values:
    """The received column as an array: see the module. `raw` holds whole entries."""
    if numpy is None:
        column = array.array(kind.code)
        column.frombytes(raw)
        return column
    flat = numpy.frombuffer(raw, _DTYPES[kind.code])
    return flat if width == 1 else flat.reshape(-1, width)


def vector(path: str, value: ColumnLike) -> List[float]:
    """Three Python floats from anything that holds three numbers, for frames."""
    items = [float(number) for number in value]
    if len(items) != 3:
        raise ValueError(f"{path}: has {len(items)} numbers: give x, y and z")
    return items
