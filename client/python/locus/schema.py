"""The protocol's messages as the wire sees them, with columns as `bytes`; internal to the package.

The mirrored schema (schema.binpb, made by make_schema.py) is loaded into a pool of its own, so it never meets classes
that somebody generated from the real files in the same process. Every class is reached by its protocol name:
`message("QueryBatch")`.
"""
from __future__ import annotations

import pathlib
import sys
from typing import Any, Dict, NamedTuple

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory  # type: ignore[import]
from google.protobuf.message import DecodeError as DecodeError  # type: ignore[import]

if sys.byteorder != "little":
    raise ImportError("locus: columns travel as little-endian numbers and are not converted: big-endian hosts are not "
                      "supported. Generate a client from proto/ with protoc instead.")


class Method(NamedTuple):
    """How to call one rpc: its path, and what goes in and out."""

    path: str
    request: Any
    response: Any


def _load() -> descriptor_pool.DescriptorPool:
    raw = pathlib.Path(__file__).with_name("schema.binpb").read_bytes()
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(raw).file:
        pool.AddSerializedFile(file.SerializeToString())
    return pool


POOL = _load()
if hasattr(message_factory, "GetMessageClass"):  # protobuf 4.22 and later
    _class_of = message_factory.GetMessageClass
else:
    _class_of = message_factory.MessageFactory(POOL).GetPrototype


def message(name: str) -> Any:
    """The class of a message of locus.v1."""
    return _class_of(POOL.FindMessageTypeByName("locus.v1." + name))


def numbers(name: str) -> Dict[str, int]:
    """The field numbers of a message of locus.v1, by name."""
    return {field.name: field.number for field in message(name).DESCRIPTOR.fields}


def method(service: str, name: str) -> Method:
    """The rpc `name` of a service given by its full name."""
    found = POOL.FindServiceByName(service).methods_by_name[name]
    return Method(f"/{service}/{name}", _class_of(found.input_type), _class_of(found.output_type))
