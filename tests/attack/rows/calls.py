"""Attacks by calls: invalid messages, deep nesting, false lengths, many writers; and heavy loads that are no attacks
("honest").
"""
import functools
import random
import struct
import time

import protobuf
import wire
from job import Attack, one

QUERY, STREAM_QUERIES = "/locus.v1.QueryService/Query", "/locus.v1.QueryService/StreamQueries"
APPLY, STREAM_UPDATES = "/locus.v1.UpdateService/ApplyUpdates", "/locus.v1.UpdateService/StreamUpdates"
GET_SERVER, CHECK = "/locus.v1.ServerService/GetServer", "/grpc.health.v1.Health/Check"
UPLOAD = "/locus.v1.SceneService/UploadMesh"
REFLECTION = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"
NO_MESSAGES = {"ff": b"\xff\xff\xff\xff", "a cut field": b"\x0a\x7f", "a cut number": b"\x08\x80", "field 0": b"\x02\x00",
               "an end without a group": b"\x7c", "a text that is not UTF-8": b"\x0a\x02\xc3\x28"}
# Codes that are allowed in addition to INVALID_ARGUMENT, by kind of bytes. A text that is not UTF-8 is valid in
# requests whose field 1 is no string.
OTHER_ENDS = {"a text that is not UTF-8": ("OK", "NOT_FOUND", "UNIMPLEMENTED")}
DEPTH = 100_000
WRITERS = 6000
ANSWERED = ("OK", "RESOURCE_EXHAUSTED")
SEED = 11
EDGE_PAUSE_SECONDS = 0.001
HELD = 1100  # more calls than the daemon allows at the same time, whatever their kind
HONEST_CALLS = ((GET_SERVER, b""), (CHECK, b""), (QUERY, protobuf.query(b"world", protobuf.rays(16))),
                (STREAM_QUERIES, protobuf.stream_message(b"world", 1, protobuf.rays(16))))


def wrong_bytes(job, path):
    """Sends bytes that are not a valid message. The daemon must refuse them."""
    with job.connect() as connection:
        for name, body in NO_MESSAGES.items():
            allowed = ("INVALID_ARGUMENT", *OTHER_ENDS.get(name, ()))
            job.check(connection.call(path, body), f"{path} {name}", allowed)


def wrong_bytes_steps(job):
    return [(method.path.split("/")[-1], functools.partial(wrong_bytes, path=method.path))
            for method in protobuf.Schema().methods]


def random_bytes(job):
    """Sends random bytes to every call except Watch."""
    chance, methods = random.Random(SEED), protobuf.Schema().methods
    with job.connect(timeout=20) as connection:
        while not job.over():
            method = chance.choice([method for method in methods if "Watch" not in method.path])
            body = bytes(chance.randrange(256) for _ in range(chance.randrange(200)))
            job.check(connection.call(method.path, body), f"{method.path}, seed {SEED}")
            # The front refuses calls beyond 200 in 100 ms, and closes the connection beyond 1,000.
            if job.front == "edge":
                time.sleep(EDGE_PAUSE_SECONDS)


def nested_lists(depth):
    """Returns an unknown field of nested messages."""
    body = b""
    for _ in range(depth):
        body = protobuf.delimited(15, body)
    return body


def nesting_steps(job):
    groups = protobuf.tag(15, 3) * DEPTH + protobuf.tag(15, 4) * DEPTH
    bodies = (("groups", groups), ("open groups", protobuf.tag(15, 3) * (4 << 20)), ("messages", nested_lists(2000)))
    return [(f"{name}, {path.split('/')[-1]}", functools.partial(job_call, path=path, body=body, what=name))
            for path in (QUERY, APPLY, STREAM_UPDATES, "/locus.v1.SceneService/CreateScene") for name, body in bodies]


def job_call(job, path, body, what):
    job.call(path, body, f"{path} {what}")


def declared_lengths(job):
    """Declares message lengths that are above any maximum, above the server's limit, or above the number of bytes that
    follow.
    """
    with job.connect() as connection:
        for declared in (0xffffffff, 0x7fffffff, (32 << 20) + 1, 1000):
            for path in (QUERY, STREAM_QUERIES, "/locus.v1.SceneService/CreateScene"):
                stream = connection.start(path)
                connection.write(stream, struct.pack(">BI", 0, declared) + bytes(10))
                # gRPC itself ends a call with a truncated message. This step checks only that the declared length is
                # not allocated.
                job.check(connection.finish(stream), f"{path} declares {declared} bytes", wire.CODES, text=False)


def writers(job):
    """Sends batches of more writer ids than a scene stores."""
    with job.connect(timeout=20) as connection:
        stream = connection.start(STREAM_UPDATES)
        for writer in range(1, WRITERS + 1):
            batch = protobuf.fixed64(12, writer) + protobuf.fixed64(13, 1)
            connection.write(stream, wire.message(protobuf.stream_message(b"world", writer, batch)), end=writer == WRITERS)
        job.check(connection.finish(stream), "stream of 6,000 writers", ("OK",))


def reflections(job):
    """Opens 700 reflection streams that send no request."""
    with job.connect() as connection:
        for _ in range(700):
            connection.start(REFLECTION)
        while not job.over():
            connection.step(job.until)


def hold_calls(job, path, body=None, window=wire.DEFAULT_WINDOW, count=HELD):
    """Keeps as many calls open as the daemon allows, while another client makes honest calls. Without `body` the open
    calls send no message; otherwise their answers are not ready or, with a `window` of 0, are not read.
    """
    with job.connect(window=window, grant=window > 0) as holder, job.connect() as other:
        for _ in range(count):
            stream = holder.start(path, (("grpc-timeout", "100S"),))
            if body is not None:
                holder.write(stream, wire.message(body), until=job.until)
        while not job.over():
            holder.step(min(job.until, time.monotonic() + 0.01))
            for honest, request in HONEST_CALLS:
                job.check(other.call(honest, request), f"{honest} beside held calls of {path}", ("OK",))


def held_steps(job):
    parked = protobuf.query(b"world", protobuf.awaiting(1 << 60))
    cases = (("GetServer without a message", GET_SERVER, None, wire.DEFAULT_WINDOW),
             ("Check without a message", CHECK, None, wire.DEFAULT_WINDOW),
             ("unread answers of GetServer", GET_SERVER, b"", 0), ("unread answers of Check", CHECK, b"", 0),
             ("parked queries", QUERY, parked, wire.DEFAULT_WINDOW),
             ("silent streams", STREAM_QUERIES, None, wire.DEFAULT_WINDOW))
    return [(name, functools.partial(hold_calls, path=path, body=body, window=window)) for name, path, body, window in cases]


def big_updates(job):
    """Inserts 100,000 objects in one batch: an honest load."""
    with job.connect(timeout=20) as connection:
        batch = protobuf.insert_balls(1, 100_000)
        job.check(connection.call("/locus.v1.SceneService/CreateScene", protobuf.create_scene(b"big")), "CreateScene", ("OK",))
        while not job.over():
            job.check(connection.call(APPLY, protobuf.apply(b"big", batch)), "100,000 inserts", ANSWERED)


def big_queries(job):
    """Queries with the largest number of rays in a batch, several batches at the same time: an honest load."""
    with job.connect(window=64 << 20, timeout=20) as connection:
        body = wire.message(protobuf.query(b"world", protobuf.rays(65536)))
        while not job.over():
            streams = [connection.start(QUERY) for _ in range(4)]
            for stream in streams:
                connection.write(stream, body)
            for stream in streams:
                job.check(connection.finish(stream), "65,536 rays", ANSWERED)


def big_mesh(job):
    """Uploads a mesh of 200,000 triangles in messages of 4 MB: an honest load."""
    count = 200_000
    corners = struct.pack(f"<{9 * count}f", *(float(v) for i in range(count)
                                              for v in (i, 0, 0, i + 1, 0, 0, i, 1, i % 7)))
    indices = struct.pack(f"<{3 * count}I", *range(3 * count))
    head = protobuf.delimited(1, b"big") + protobuf.fixed32(3, 3 * count) + protobuf.fixed32(4, count)
    messages = [head] + [protobuf.delimited(field, data[at:at + 4_000_000]) for field, data in ((6, corners), (7, indices))
                         for at in range(0, len(data), 4_000_000)]
    with job.connect(timeout=30) as connection:
        stream = connection.start(UPLOAD)
        for i, body in enumerate(messages):
            if not connection.write(stream, wire.message(body), end=i == len(messages) - 1):
                break
        job.check(connection.finish(stream), "upload of a mesh", ANSWERED)


def honest_steps(job):
    return [("inserts", big_updates), ("rays", big_queries), ("mesh", big_mesh)]


ROWS = [
    Attack("wrong-bytes", "calls", wrong_bytes_steps, "invalid messages, to every call", "6 messages a call"),
    Attack("random-bytes", "calls", one(random_bytes), "random bytes to every call", "200 bytes"),
    Attack("nesting", "calls", nesting_steps, "fields within fields", "100,000 deep"),
    Attack("declared-lengths", "calls", one(declared_lengths), "false lengths", "12 messages"),
    Attack("writers", "calls", one(writers), "more writers than a scene stores", "6,000"),
    Attack("reflections", "calls", one(reflections), "reflection streams without a request", "700"),
    Attack("held-calls", "calls", held_steps, "calls without a message, unread answers, parked queries, silent streams",
           "1,100 at once"),
    Attack("honest", "calls", honest_steps, "honest load: many objects, many rays, a large mesh", "32 MiB a message", 1000),
]
