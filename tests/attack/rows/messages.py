"""Attacks by messages: small messages that become large when they are inflated or parsed, and many messages or
revisions that are never completed.
"""
import functools
import struct
import time
import zlib

import protobuf
import wire
from job import STRANGER, Attack, one

MIB = 1 << 20
LARGEST = 32 * MIB - 64
REFUSED = ("UNIMPLEMENTED", "RESOURCE_EXHAUSTED", "INVALID_ARGUMENT")
HOT = ("/locus.v1.UpdateService/ApplyUpdates", "/locus.v1.UpdateService/StreamUpdates", "/locus.v1.QueryService/Query",
       "/locus.v1.QueryService/StreamQueries", "/locus.v1.QueryService/Step")
PENDING, CONTINUES, REMOVE_IDS = 8, 17, 4  # fields of UpdateAck and UpdateBatch
HELD_STREAMS, STREAMS_A_HOLDER, HELD_TOGETHER = 256, 32, 256
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


def is_pending(answer):
    """Returns whether an answer of StreamUpdates is the ack of a held message."""
    return answer[9:] == protobuf.delimited(2, protobuf.number(PENDING, 1))  # after the sequence number


def held_updates(job, batch, count):
    """Sends `count` messages with `continues` on each of many streams and never the last message of their revisions,
    while another client makes honest calls. Messages beyond a limit must be refused, and queries must be answered.
    """
    holders, query = [], protobuf.query(b"world", protobuf.rays(16))
    pieces = [b"".join(wire.message(protobuf.stream_message(b"world", sequence, batch))
                       for sequence in range(first, min(first + HELD_TOGETHER, count + 1)))
              for first in range(1, count + 1, HELD_TOGETHER)]
    try:
        with job.connect() as other:
            for i in range(HELD_STREAMS):
                if job.over():
                    break
                if i % STREAMS_A_HOLDER == 0:
                    holders.append(job.connect())
                stream = holders[-1].start(HOT[1])
                for piece in pieces:
                    holders[-1].write(stream, piece, end=False, until=job.until)
                job.check(other.call(HOT[2], query), "a query beside held messages", ("OK",))
            while not job.over():
                for holder in holders:
                    holder.step(min(job.until, time.monotonic() + 0.01))
                job.check(other.call(HOT[2], query), "a query beside held messages", ("OK",))
        answers = [answer for holder in holders for body in holder.bodies.values() for answer in wire.messages(body)]
        held = sum(is_pending(answer) for answer in answers)
        job.count("HELD", held)
        job.count("REFUSED", len(answers) - held)
        if not held and job.front != STRANGER:
            job.wrong("no message was held")
    finally:
        for holder in holders:
            holder.close()


def held_steps(job):
    continues = protobuf.number(CONTINUES, 1)
    cases = (("inserts", protobuf.insert_balls(1, 20_000), 12),
             ("removes", protobuf.fixed64s(REMOVE_IDS, range(1, 80_001)), 13), ("empty messages", b"", 4095))
    return [(name, functools.partial(held_updates, batch=batch + continues, count=count)) for name, batch, count in cases]


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
    Attack("held-updates", "messages", held_steps, "messages of revisions whose last message never comes",
           "256 streams, 2 GB"),
]
