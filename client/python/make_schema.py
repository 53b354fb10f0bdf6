"""Generates the parts of the Python package that depend on the protocol: the mirrored schema and the enums.

    make_schema.py DESCRIPTOR_SET SCHEMA ENUMS

DESCRIPTOR_SET is the output of `protoc --include_imports --include_source_info --descriptor_set_out=` for the real
files. SCHEMA receives the same files, but with every packed fixed-width column declared `bytes`. On the wire both types
are a length and little-endian numbers; with `bytes`, Python reads and writes a column as one buffer instead of number
by number. ENUMS receives a Python module with the protocol's enums and their comments. The build runs this script; its
output is not in the repository.
"""
from __future__ import annotations

import re
import sys
import textwrap
from typing import Any, Dict, Iterator, List, Tuple

try:
    from google.protobuf import descriptor_pb2  # type: ignore[import]
except ImportError:
    sys.exit("make_schema.py: Debian's python3-protobuf is missing: run ./deploy/packages.sh python")

Field: Any = descriptor_pb2.FieldDescriptorProto
FIXED_WIDTH = {Field.TYPE_FLOAT, Field.TYPE_DOUBLE, Field.TYPE_FIXED32, Field.TYPE_FIXED64, Field.TYPE_SFIXED32,
               Field.TYPE_SFIXED64}
PACKAGE = "locus.v1"
ENUM_TYPE, ENUM_VALUE = 5, 2  # field numbers in FileDescriptorProto and EnumDescriptorProto, for paths of comments


def is_column(field: Any) -> bool:
    """Returns True for packed numbers of fixed width. Varints are not columns: their width depends on their value."""
    packed = not field.options.HasField("packed") or field.options.packed
    return bool(field.label == Field.LABEL_REPEATED and field.type in FIXED_WIDTH and packed)


def mirror(files: descriptor_pb2.FileDescriptorSet) -> descriptor_pb2.FileDescriptorSet:
    """Returns the files with columns declared `bytes` and without comments."""
    result = descriptor_pb2.FileDescriptorSet()
    for file in files.file:
        copy = result.file.add()
        copy.CopyFrom(file)
        copy.ClearField("source_code_info")
        if copy.package == PACKAGE and copy.syntax != "proto3":
            raise SystemExit(f"make_schema.py: {file.name} is not proto3, whose numbers are packed by default")
        messages = list(copy.message_type) if copy.package == PACKAGE else []
        while messages:
            message = messages.pop()
            messages += message.nested_type
            for field in filter(is_column, message.field):
                field.label = Field.LABEL_OPTIONAL
                field.type = Field.TYPE_BYTES
                field.options.ClearField("packed")
    result.file.append(health())
    return result


def health() -> descriptor_pb2.FileDescriptorProto:
    """Returns the description of grpc.health.v1.Health/Check, whose file Debian does not ship. The status is declared
    as int32.
    """
    file = descriptor_pb2.FileDescriptorProto(name="grpc/health/v1/health.proto", package="grpc.health.v1",
                                              syntax="proto3")
    for name, field, kind in (("HealthCheckRequest", "service", Field.TYPE_STRING),
                              ("HealthCheckResponse", "status", Field.TYPE_INT32)):
        file.message_type.add(name=name).field.add(name=field, number=1, type=kind, label=Field.LABEL_OPTIONAL)
    file.service.add(name="Health").method.add(name="Check", input_type=".grpc.health.v1.HealthCheckRequest",
                                               output_type=".grpc.health.v1.HealthCheckResponse")
    return file


def comments(file: descriptor_pb2.FileDescriptorProto) -> Dict[Tuple[int, ...], str]:
    """Returns the comment of each element of a file, keyed by the element's path (descriptor.proto, SourceCodeInfo)."""
    return {tuple(location.path): location.leading_comments for location in file.source_code_info.location}


def commented(text: str, indent: str) -> List[str]:
    return textwrap.wrap(" ".join(text.split()), 119, initial_indent=indent + "# ", subsequent_indent=indent + "# ")


def enum_lines(file: descriptor_pb2.FileDescriptorProto) -> Iterator[str]:
    """Yields the Python source of a file's enums. The names of their members are written without the prefix that
    repeats the enum's name.
    """
    text = comments(file)
    for index, enum in enumerate(file.enum_type):
        prefix = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", enum.name).upper() + "_"
        summary = " ".join(text.get((ENUM_TYPE, index), "").split())
        yield f"\n\nclass {enum.name}(enum.IntEnum):"
        yield textwrap.fill(f'"""{summary}"""', 119, initial_indent="    ", subsequent_indent="    ") + "\n"
        for position, value in enumerate(enum.value):
            yield from commented(text.get((ENUM_TYPE, index, ENUM_VALUE, position), ""), "    ")
            yield f"    {value.name[len(prefix):]} = {value.number}"


def enums(files: descriptor_pb2.FileDescriptorSet) -> str:
    lines = ['"""The enums of locus.v1, made from the protocol by make_schema.py."""', "import enum"]
    for file in files.file:
        if file.package == PACKAGE:
            lines += enum_lines(file)
    return "\n".join(lines) + "\n"


def main(source: str, schema: str, enum_module: str) -> None:
    with open(source, "rb") as file:
        files = descriptor_pb2.FileDescriptorSet.FromString(file.read())
    with open(schema, "wb") as file:
        file.write(mirror(files).SerializeToString(deterministic=True))
    with open(enum_module, "w", encoding="utf-8") as text:
        text.write(enums(files))


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
