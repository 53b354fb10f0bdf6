"""Message classes of the protocol, with columns declared `bytes`; internal to the package.

The mirrored schema (schema.binpb, made by make_schema.py) is loaded into a descriptor pool of its own. Therefore one
process can also use the classes that protoc generates from the real protocol files. Classes are looked up by their name
in the protocol: `message("QueryBatch")`.
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
    """One rpc: its path, and the classes of its request and response."""

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
    """Returns the class of a message of locus.v1."""
    return _class_of(POOL.FindMessageTypeByName("locus.v1." + name))


def numbers(name: str) -> Dict[str, int]:
    """Returns the field numbers of a message of locus.v1, by name."""
    return {field.name: field.number for field in message(name).DESCRIPTOR.fields}


def method(service: str, name: str) -> Method:
    """Returns the rpc `name` of the service with this full name."""
    found = POOL.FindServiceByName(service).methods_by_name[name]
    return Method(f"/{service}/{name}", _class_of(found.input_type), _class_of(found.output_type))
