"""Attacks by data that the daemon must keep in memory: unread replies, and history."""
import functools
import time

import protobuf
import wire
from job import Attack

SCENE = b"world"
QUERY, STREAM_QUERIES = "/locus.v1.QueryService/Query", "/locus.v1.QueryService/StreamQueries"
DUMP, LIST = "/locus.v1.SceneService/DumpScene", "/locus.v1.SceneService/ListScenes"
LARGE_REPLY = protobuf.everything(40, 64 << 20)
MOVERS = 20000


def ask_and_wait(job, path, body, count, connections, window):
    """Makes calls with large replies and does not read the replies."""
    opened = [job.connect(window=window, grant=window > 0, timeout=job.seconds, receive_buffer=4096)
              for _ in range(connections)]
    try:
        for connection in opened:
            for _ in range(count):
                if job.over():
                    break
                connection.write(connection.start(path), wire.message(body), end=path != STREAM_QUERIES, until=job.until)
        while not job.over():
            for connection in opened:
                if window == 0 and not connection.closed:
                    connection.step(min(job.until, time.monotonic() + 0.1))
                elif window:
                    time.sleep(0.05)
    finally:
        for connection in opened:
            connection.close()


def unread_steps(job):
    single = protobuf.query(SCENE, LARGE_REPLY)
    streamed = protobuf.stream_message(SCENE, 1, LARGE_REPLY)
    cases = (("64 streams", STREAM_QUERIES, streamed, 64, 1), ("200 calls", QUERY, single, 200, 1),
             ("16 connections of 16 calls", QUERY, single, 16, 16), ("250 dumps", DUMP, protobuf.delimited(1, SCENE), 250, 1),
             ("250 lists of scenes", LIST, b"", 250, 1))
    return [(f"{name}, {how}", functools.partial(ask_and_wait, path=path, body=body, count=count, connections=connections,
                                                 window=window))
            for how, window in (("window of 0 bytes", 0), ("socket not read", wire.LARGEST_WINDOW))
            for name, path, body, count, connections in cases]


CREATE, DELETE = "/locus.v1.SceneService/CreateScene", "/locus.v1.SceneService/DeleteScene"
APPLY, STREAM_UPDATES = "/locus.v1.UpdateService/ApplyUpdates", "/locus.v1.UpdateService/StreamUpdates"


def moving_scenes(job, connection, count):
    """Creates scenes with history and 20,000 objects. Returns (name, update stream) of each scene."""
    streams = []
    for i in range(count):
        name = b"history-%d" % i
        job.check(connection.call(CREATE, protobuf.create_scene(name, 16384)), "CreateScene", ("OK", "RESOURCE_EXHAUSTED"))
        inserted = connection.call(APPLY, protobuf.apply(name, protobuf.insert_balls(1, MOVERS)))
        job.check(inserted, "insert of 20,000 objects", ("OK", "RESOURCE_EXHAUSTED", "NOT_FOUND"))
        streams.append((name, connection.start(STREAM_UPDATES)))
    return streams


def grow_history(job, scenes):
    """Moves 20,000 objects of each scene at every tick, on one stream for each scene, then deletes the scenes."""
    moves, tick = [protobuf.move_balls(1, MOVERS, 0, float(height))[9:] for height in range(2)], 0
    with job.connect(window=1 << 20, timeout=20) as connection:
        streams = moving_scenes(job, connection, scenes)
        job.until = time.monotonic() + job.seconds
        while not job.over():
            tick += 1
            batch = protobuf.fixed64(2, tick) + moves[tick % 2]
            for name, stream in streams:
                connection.write(stream, wire.message(protobuf.stream_message(name, tick, batch)), end=False, until=job.until)
    job.count("TICKS", tick)
    with job.connect(timeout=30) as connection:
        for name, _ in streams:
            job.check(connection.call(DELETE, protobuf.delimited(1, name)), "DeleteScene", ("OK", "NOT_FOUND"))


def history_steps(job):
    return [(f"{count} scenes", functools.partial(grow_history, scenes=count)) for count in (1, 8)]


ROWS = [
    Attack("unread", "replies", unread_steps, "calls with replies of 54 MB that nobody reads", "64 streams, 200 to 256 calls"),
    Attack("history", "replies", history_steps, "20,000 objects that move at every tick of a scene with history",
           "1 and 8 scenes, default limits"),
]
