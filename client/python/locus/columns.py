"""Conversion of columns between Python and the wire: buffers and lists to bytes, bytes to numpy arrays or array.array.

A column is packed little-endian numbers. An entry that is a vector has several numbers: N positions are 3N float32.

Arguments: a buffer of the right type (numpy array, array.array, memoryview) is read in C order and need not be
contiguous; `bytes` and `bytearray` are used unchanged; numbers and (nested) lists are converted. A buffer of another
type is refused, not converted, because float64 given for float32 would be rounded; only int64 is accepted for ids,
unless one is negative. If the entries are vectors, the last axis of an array must have the numbers of one entry, or of
one of its parts, as a row of a matrix, and so must each inner list: (N, 3), never (3, N).

Results: a column is a numpy array of shape (R,) or (R, width) over the received bytes, and therefore read-only. It is
copied only if the received bytes are not aligned to its type. If numpy is not installed it is a flat array.array, copied
once.
"""
from __future__ import annotations

import array
import itertools
import numbers
from typing import Any, Iterable, Iterator, List, NamedTuple, Protocol, Sequence, Tuple, Union

try:
    import numpy
except ImportError:
    numpy = None  # type: ignore[assignment]

HAS_NUMPY = numpy is not None

# Argument types of a column: a buffer, bytes, one number, a list of numbers or a list of vectors.
ColumnLike = Any
# Encoded column: little-endian bytes.
Raw = Union[bytes, bytearray, memoryview]


class Values(Protocol):
    """Received column: a numpy array or an array.array."""

    def __len__(self) -> int: ...
    def __getitem__(self, index: Any) -> Any: ...
    def __iter__(self) -> Iterator[Any]: ...

    def tolist(self) -> List[Any]:
        """Returns the column as a list of Python numbers."""


class Kind(NamedTuple):
    """Number type of a column: its name, its type code in array.array, its size in bytes, and the format codes that a
    buffer of this type may have.
    """

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


# Columns of positions that are relative to the frame of their block.
_IN_FRAME = ("origins", "starts", "ends", "centers", "points", "viewers", "targets")


def _remedy(path: str, view: memoryview, kind: Kind) -> str:
    """Returns what to do about a buffer whose type is not `kind`."""
    name = path.rsplit(".", 1)[-1]
    if kind is FLOAT32 and view.format[-1:] == "d":
        if name == "positions":
            return "give it as positions_f64, because float32 rounds large coordinates"
        if name in _IN_FRAME:
            return ("give positions relative to a frame, (positions - frame).astype('float32') with frame=frame, because "
                    "float32 rounds large coordinates; without a frame, convert it with .astype('float32')")
    return f"convert it, for example with .astype('{kind.name}')"


def _check_shape(path: str, shape: Sequence[int], width: int, part: int) -> None:
    """Raises ValueError unless the last axis of an array of vectors has the numbers of one entry or of a part of it."""
    if width > 1 and len(shape) > 1 and 0 not in shape and shape[-1] not in (width, part):
        raise ValueError(f"{path}: has the shape {tuple(shape)}: give {width} numbers for each entry along the last axis, "
                         f"as in (N, {width})")


def _check_not_negative(path: str, view: memoryview) -> None:
    values = array.array("q", view.tobytes()) if numpy is None else numpy.asarray(view).ravel()
    if len(values) and min(values if numpy is None else (values.min(),)) < 0:
        index = next(index for index, value in enumerate(values) if value < 0)
        raise ValueError(f"{path}[{index}]: is {values[index]}: give numbers from 0 to 2^64 - 1")


def _from_buffer(path: str, view: memoryview, kind: Kind, width: int, part: int) -> Raw:
    """Returns the bytes of the numbers in `view`, in C order: borrowed if `view` is contiguous, else copied."""
    _check_shape(path, view.shape or (), width, part)
    format = view.format
    if kind is UINT64 and view.itemsize == 8 and format.lstrip("@=<") in ("q", "l"):
        _check_not_negative(path, view)
    elif view.itemsize != kind.size or (format not in kind.formats and format.lstrip("@=<") not in kind.formats):
        raise TypeError(f"{path}: holds {_name_of(view)}, but {kind.name} is wanted: "
                        f"{_remedy(path, view, kind)}")
    if view.nbytes == 0:  # a view with an axis of length 0 cannot be cast
        return b""
    if view.c_contiguous and len(format) == 1:
        return view.cast("B")
    return view.tobytes()


def _flat(path: str, value: Iterable[Any], width: int, part: int) -> Iterable[Any]:
    items = value if isinstance(value, (list, tuple)) else list(value)
    if not items or isinstance(items[0], (float, int, numbers.Number, str)):
        return items
    vectors = [list(item) for item in items]
    wrong = next((vector for vector in vectors if len(vector) not in (width, part)), None)
    if width > 1 and wrong is not None:
        raise ValueError(f"{path}: has an entry of {len(wrong)} numbers: give {width} numbers for each entry")
    return list(itertools.chain.from_iterable(vectors))


def _from_numbers(path: str, value: Any, kind: Kind, width: int, part: int) -> bytes:
    try:
        items = [value] if isinstance(value, (float, int, numbers.Number)) else _flat(path, value, width, part)
        return array.array(kind.code, items).tobytes()
    except (TypeError, OverflowError) as error:
        raise TypeError(f"{path}: {error}: give {kind.name} numbers, as a list or a buffer") from error


def borrow(path: str, value: ColumnLike, kind: Kind, width: int = 1, part: int = 0) -> Raw:
    """Returns the encoded column; empty for None. A contiguous buffer is borrowed, not copied, so it must not change
    until the request was sent.

    `path` names the column in errors. `part` is the number of numbers of a part of an entry, for example 4 for the planes
    of a region; 0 if the entry has no parts. Raises TypeError for numbers of another type, ValueError if the number of values
    is not a multiple of `width`, if the shape is not that of entries of `width` numbers, or for a negative id. Cost:
    linear for lists, for int64 and for arrays that are not contiguous, else constant.
    """
    if value is None:
        return b""
    raw: Raw
    if isinstance(value, (bytes, bytearray)):
        raw = value
    elif isinstance(value, (float, int, list, tuple)):
        raw = _from_numbers(path, value, kind, width, part)
    else:
        try:
            view = memoryview(value)
        except TypeError:
            raw = _from_numbers(path, value, kind, width, part)
        else:
            raw = _from_buffer(path, view, kind, width, part)
    if len(raw) % (kind.size * width):
        count = f"{len(raw) // kind.size} numbers" if len(raw) % kind.size == 0 else f"{len(raw)} bytes"
        raise ValueError(f"{path}: has {count}: give {width} {kind.name} for each entry")
    return raw


def entries(raw: Raw, kind: Kind, width: int = 1) -> int:
    """Returns the number of entries of an encoded column."""
    return len(raw) // (kind.size * width)


def borrow_for(path: str, value: ColumnLike, kind: Kind, count: int, width: int = 1) -> Raw:
    """Returns the encoded column like borrow(). Raises ValueError unless the column has `count` entries, one entry or
    no entry.
    """
    raw = borrow(path, value, kind, width)
    found = entries(raw, kind, width)
    if found not in (0, 1, count):
        raise ValueError(f"{path}: has {found} entries: give {count}, one for all, or none")
    return raw


def encode(path: str, value: ColumnLike, kind: Kind, width: int = 1, part: int = 0) -> bytes:
    """Returns a copy of the encoded column. Arguments and errors are those of borrow()."""
    return bytes(borrow(path, value, kind, width, part))


def encode_for(path: str, value: ColumnLike, kind: Kind, count: int, width: int = 1) -> bytes:
    """Returns a copy of the encoded column. Arguments and errors are those of borrow_for()."""
    return bytes(borrow_for(path, value, kind, count, width))


def decode(raw: Raw, kind: Kind, width: int = 1) -> Values:
    """Returns a received column as an array, as described in the module's docstring. The size of `raw` must be a
    multiple of the size of an entry.
    """
    if numpy is None:
        column = array.array(kind.code)
        column.frombytes(raw)
        return column
    flat = numpy.frombuffer(raw, _DTYPES[kind.code])
    if not flat.flags.aligned:
        flat = flat.copy()
        flat.setflags(write=False)
    return flat if width == 1 else flat.reshape(-1, width)


def vector(path: str, value: ColumnLike) -> List[float]:
    """Returns a frame's three coordinates as Python floats, from any iterable of three numbers."""
    items = [float(item) for item in value]
    if len(items) != 3:
        raise ValueError(f"{path}: has {len(items)} numbers: give x, y and z")
    return items
