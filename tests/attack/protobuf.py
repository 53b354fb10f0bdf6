"""Hand-written protobuf encoding: encoders of fields and messages, the requests that the attacks send, and a list of
the fields of every request.
"""
import collections
import os
import struct
import subprocess
import tempfile

from google.protobuf import descriptor_pb2

PROTO = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../proto")
Kind = descriptor_pb2.FieldDescriptorProto
VARINTS = (Kind.TYPE_UINT32, Kind.TYPE_INT32, Kind.TYPE_UINT64, Kind.TYPE_INT64, Kind.TYPE_ENUM, Kind.TYPE_BOOL)

# An rpc of the schema: path, name of its request, whether the client streams requests.
Method = collections.namedtuple("Method", "path request streams")
# A field of a request that can contain many or large entries. `fields` are the field numbers that lead to it, from the
# outermost message inwards; `kind` is `lists`, `varints`, `map`, `strings` or `string`.
Place = collections.namedtuple("Place", "fields name kind")


def varint(value):
    out = bytearray()
    while value >= 128:
        out.append(0x80 | value & 0x7f)
        value >>= 7
    out.append(value)
    return bytes(out)


def tag(field, wire_type):
    return varint(field << 3 | wire_type)


def delimited(field, body):
    """Returns an encoded field of type bytes, string or message."""
    return tag(field, 2) + varint(len(body)) + body


def number(field, value):
    return tag(field, 0) + varint(value)


def fixed64(field, value):
    return tag(field, 1) + struct.pack("<Q", value)


def fixed32(field, value):
    return tag(field, 5) + struct.pack("<I", value)


def floats(field, values):
    return delimited(field, struct.pack(f"<{len(values)}f", *values))


def fixed64s(field, values):
    return delimited(field, struct.pack(f"<{len(values)}Q", *values))


def create_scene(name, history_ticks=0):
    return delimited(1, name) + delimited(2, number(2, history_ticks)) + number(3, 1)


def insert_balls(first, count):
    """Returns an UpdateBatch that inserts or replaces balls, 100 x 100 in each layer, one world unit apart."""
    places = [float(v) for i in range(count) for v in (i % 100, i // 100 % 100, i // 10000)]
    return delimited(6, fixed64s(1, range(first, first + count)) + floats(2, places) +
                     delimited(6, floats(1, [0.5]))) + number(9, 1)


def move_balls(first, count, tick, height):
    """Returns an UpdateBatch that has the tick `tick` and moves balls to the height `height`."""
    places = [v for i in range(count) for v in (float(i % 100), float(i // 100 % 100), height)]
    return fixed64(2, tick) + delimited(7, fixed64s(1, range(first, first + count)) + floats(2, places))


def apply(scene, batch):
    return delimited(1, scene) + delimited(2, batch)


def stream_message(scene, sequence, batch):
    """Returns a message of StreamUpdates or StreamQueries."""
    return delimited(1, scene) + fixed64(2, sequence) + delimited(3, batch)


def rays(count):
    """Returns a QueryBatch of rays that point down at the balls of insert_balls()."""
    origins = [float(v) for i in range(count) for v in (i % 100, i // 100 % 100, 50)]
    return delimited(2, delimited(16, floats(1, origins) + floats(2, [0, 0, -1])))


def awaiting(revision):
    """Returns a QueryBatch without queries that waits until the scene has reached a revision."""
    return delimited(1, fixed64(1, revision))


def everything(count, reply_bytes):
    """Returns a QueryBatch of balls, each of which contains the whole scene. It requests every column, and so causes
    the largest replies.
    """
    columns = delimited(4, bytes((2, 7, 8, 9, 10)))
    balls = delimited(17, floats(1, [0.0] * (3 * count)) + floats(2, [1e6]))
    return delimited(2, columns + number(8, 1 << 20) + balls) + fixed32(5, reply_bytes)


def query(scene, batch):
    return delimited(1, scene) + delimited(2, batch)


def nested(fields, body):
    """Returns `body` nested in one message for each of `fields`, the field numbers from the outermost message inwards.
    """
    for field in reversed(fields):
        body = delimited(field, body)
    return body


class Schema:
    """Rpcs and messages of the project's proto files, parsed by protoc."""

    def __init__(self):
        files = [os.path.join(folder, name) for folder, _, names in os.walk(PROTO) for name in names if name.endswith(".proto")]
        with tempfile.NamedTemporaryFile() as out:
            subprocess.run(["protoc", "-I", PROTO, "--include_imports", "--descriptor_set_out", out.name, *sorted(files)],
                           check=True, timeout=60)
            parsed = descriptor_pb2.FileDescriptorSet.FromString(out.read())
        self.messages, self.methods = {}, []
        for file in parsed.file:
            self.add_messages("." + file.package, file.message_type)
            for service in file.service:
                self.methods += [Method(f"/{file.package}.{service.name}/{method.name}", method.input_type,
                                        method.client_streaming) for method in service.method]

    def add_messages(self, prefix, messages):
        for entry in messages:
            self.messages[f"{prefix}.{entry.name}"] = entry
            self.add_messages(f"{prefix}.{entry.name}", entry.nested_type)

    def places(self, name, fields=(), path="", seen=()):
        """Returns the Places of a message, including those of nested messages."""
        found = []
        for field in self.messages[name].field:
            here, label = (*fields, field.number), f"{path}{field.name}"
            many = field.label == Kind.LABEL_REPEATED
            if field.type == Kind.TYPE_MESSAGE:
                is_map = self.messages[field.type_name].options.map_entry
                if many:
                    found.append(Place(here, label, "map" if is_map else "lists"))
                if not is_map and field.type_name not in seen:
                    found += self.places(field.type_name, here, label + ".", (*seen, name))
            elif field.type in (Kind.TYPE_STRING, Kind.TYPE_BYTES):
                found.append(Place(here, label, "strings" if many else "string"))
            elif many and field.type in VARINTS:
                found.append(Place(here, label, "varints"))
        return found

    def name_field(self, name):
        """Returns the encoded field of this request that names a scene or a mesh. Requests that read or change a scene
        get the name `world`.
        """
        first = self.messages[name].field[:1]
        if not first or first[0].type != Kind.TYPE_STRING or first[0].number != 1:
            return b""
        return delimited(1, b"world" if first[0].name == "scene" else b"other")


def map_entries(field, size):
    """Returns about `size` bytes of entries of a map<string, string>, each with a different key of 4 bytes."""
    head = tag(field, 2) + b"\x06\x0a\x04"
    count = size // (len(head) + 4)
    block = bytearray((head + b"keys") * count)
    for byte in range(4):
        period = 128 ** byte
        runs = (bytes([i % 128]) * min(period, count) for i in range(count // period + 1))
        block[len(head) + byte::len(head) + 4] = b"".join(runs)[:count]
    return bytes(block)
