"""Attacks by messages: small messages that become large when they are inflated or parsed, and many messages that are
never completed.
"""
import functools
import struct
import zlib

import protobuf
import wire
from job import Attack, one

MIB = 1 << 20
LARGEST = 32 * MIB - 64
REFUSED = ("UNIMPLEMENTED", "RESOURCE_EXHAUSTED", "INVALID_ARGUMENT")
HOT = ("/locus.v1.UpdateService/ApplyUpdates", "/locus.v1.UpdateService/StreamUpdates", "/locus.v1.QueryService/Query",
       "/locus.v1.QueryService/StreamQueries", "/locus.v1.QueryService/Step")
GZIPPED = (HOT[0], HOT[3], "/locus.v1.SceneService/CreateScene")


@functools.lru_cache(maxsize=None)
def gzip_of_zeros(mebibytes):
    """Returns a gzip stream of zeros, made by repeating a compressed piece of 1 MiB. The stream is about a thousand
    times smaller than its content.
    """
    piece = zlib.compressobj(9, zlib.DEFLATED, -15)
    packed = piece.compress(bytes(MIB)) + piece.flush(zlib.Z_FULL_FLUSH)
    check = 0
    for _ in range(mebibytes):
        check = zlib.crc32(bytes(MIB), check)
    end = zlib.compressobj(9, zlib.DEFLATED, -15).flush()
    return (b"\x1f\x8b\x08\0\0\0\0\0\0\xff" + packed * mebibytes + end +
            struct.pack("<II", check, mebibytes * MIB & 0xffffffff))


def inflate(job, path, mebibytes):
    job.call(path, gzip_of_zeros(mebibytes), f"{path} with gzip of {mebibytes} MiB", REFUSED,
             extra=(("grpc-encoding", "gzip"),), compressed=True, timeout=30)


def inflate_together(job, path, mebibytes, count):
    """Sends many compressed messages at once on one connection."""
    with job.connect() as connection:
        body = wire.message(gzip_of_zeros(mebibytes), True)
        streams = [connection.start(path, (("grpc-encoding", "gzip"),)) for _ in range(count)]
        for stream in streams:
            connection.write(stream, body)
        for stream in streams:
            job.check(connection.finish(stream), f"{path}, {count} times gzip of {mebibytes} MiB", REFUSED)


def gzip_steps(job):
    sizes = (2048, 1024, 512, 256)
    steps = [(f"{size} MiB, {path.split('/')[-1]}", functools.partial(inflate, path=path, mebibytes=size))
             for size in sizes for path in GZIPPED]
    return steps + [("32 times 64 MiB", functools.partial(inflate_together, path=HOT[2], mebibytes=64, count=32))]


def filled(place):
    """Returns a request of about 32 MiB in which the field of this Place is filled."""
    field = place.fields[-1]
    if place.kind == "map":
        body = protobuf.map_entries(field, LARGEST)
    elif place.kind in ("lists", "strings"):
        entry = protobuf.delimited(field, b"")
        body = entry * (LARGEST // len(entry))
    elif place.kind == "varints":
        body = protobuf.delimited(field, b"\x01" * LARGEST)
    else:
        body = protobuf.delimited(field, b"a" * LARGEST)
    return protobuf.nested(place.fields[:-1], body)


UNKNOWN = {"unknown numbers": protobuf.number(15, 0), "unknown texts": protobuf.delimited(15, b""),
           "unknown groups": protobuf.tag(15, 3) + protobuf.tag(15, 4), "unknown 4 bytes": protobuf.fixed32(15, 0)}


def send_filled(job, method, prefix, make, what):
    job.call(method.path, prefix + make(), f"{method.path} {what}", **job.never_ends(method.path))


def amplify_steps(job):
    """Returns a step for every Place of every request, and steps for unknown fields. First come the steps that fill
    lists in requests of the most frequent calls, because the daemon needs most memory for each byte of such a request.
    """
    schema, steps = protobuf.Schema(), []
    for method in schema.methods:
        prefix = schema.name_field(method.request)
        places = schema.places(method.request)
        kinds = [(place.name, place.kind, functools.partial(filled, place)) for place in places]
        kinds += [(name, "unknown", lambda unit=unit: unit * (LARGEST // len(unit))) for name, unit in UNKNOWN.items()]
        for name, kind, make in kinds:
            run = functools.partial(send_filled, method=method, prefix=prefix, make=make, what=f"{name} ({kind})")
            order = (kind != "lists" or method.path not in HOT, kind == "string", method.path not in HOT)
            steps.append((order, f"{method.path.split('/')[-1]} {name} ({kind})", run))
    return [(name, run) for _, name, run in sorted(steps, key=lambda step: step[0])]


def unfinished_messages(job):
    """Begins messages of 32 MiB on many streams and omits the last MiB of each; sends at most 3 GiB."""
    piece = bytes(MIB)
    with job.connect(timeout=job.seconds + 5) as connection:
        for i in range(96):
            stream = connection.start(HOT[i % len(HOT)])
            if not connection.write(stream, struct.pack(">BI", 0, LARGEST), end=False, until=job.until):
                break
            for _ in range(31):
                if job.over() or not connection.write(stream, piece, end=False, until=job.until):
                    break
        while not job.over():
            connection.step(job.until)


ROWS = [
    Attack("gzip", "messages", gzip_steps, "compressed messages of 2 MB that inflate to 2 GB and less", "13 messages"),
    # With --accept-compression, parsing a message takes up to 0.1 s on an IO loop, so a larger `slower` is allowed.
    Attack("gzip-accepted", "messages", gzip_steps, "the same, with a daemon that accepts compressed messages",
           "13 messages", slower=100, flags=("--accept-compression",)),
    Attack("amplify", "messages", amplify_steps,
           "one message of 32 MB, full of empty lists, numbers, map entries, texts or unknown fields, for each field",
           "32 MiB a message, one at a time"),
    Attack("unfinished", "messages", one(unfinished_messages), "messages of 32 MiB whose last MiB never comes",
           "96 streams, 3 GiB"),
]
