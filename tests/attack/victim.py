"""The victim: a process that sends small batches on one connection during an attack, as an honest client would.

It also opens a new connection from time to time. It records the time and the duration of each answer.
"""
import collections
import multiprocessing
import os
import resource
import time

import protobuf
import wire

SCENE = "victim"
RAYS = 16
PAUSE_SECONDS = 0.002
CONNECT_EVERY = 25
WAIT_SECONDS = 5.0
MEMORY = 1 << 30

# One batch, or one new connection with its first batch (`connect` is true): time of the answer, duration, and status
# code.
Sample = collections.namedtuple("Sample", "at seconds code connect")


def prepare(target):
    """Creates the victim's scene. Returns the Reply of the last call."""
    with wire.Connection(target, window=1 << 20) as connection:
        connection.call("/locus.v1.SceneService/CreateScene", protobuf.create_scene(SCENE.encode()))
        return connection.call("/locus.v1.UpdateService/ApplyUpdates",
                               protobuf.apply(SCENE.encode(), protobuf.insert_balls(1, 1000)))


def ask(connection):
    return connection.call("/locus.v1.QueryService/Query", protobuf.query(SCENE.encode(), protobuf.rays(RAYS)),
                           timeout=WAIT_SECONDS)


def is_served(target):
    """Returns whether a new connection receives an answer."""
    try:
        with wire.Connection(target, timeout=WAIT_SECONDS) as connection:
            return ask(connection).code == "OK"
    except (OSError, wire.Closed):
        return False


def measure(target, connection, connect):
    """Makes one call. Returns (Sample, connection), where the connection is None if the next call must open a new one.
    """
    started, fresh = time.monotonic(), connect or connection is None
    try:
        used = wire.Connection(target, timeout=WAIT_SECONDS) if fresh else connection
        reply = ask(used)
        if fresh and connection is not None:
            used.close()
            used = connection
        code = reply.code
    except (OSError, wire.Closed):
        used, code = None, "CONNECT"
    if code != "OK" and used is not None and code in ("CLOSED", "TIMEOUT", "RESET"):
        used.close()
        used = None
    now = time.monotonic()
    return Sample(now, now - started, code, fresh), used


def loop(target, stop, pipe):
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    samples, connection, count, parent = [], None, 0, os.getppid()
    while not stop.is_set() and os.getppid() == parent:
        count += 1
        sample, connection = measure(target, connection, count % CONNECT_EVERY == 0)
        samples.append(sample)
        time.sleep(PAUSE_SECONDS if sample.code == "OK" else 0.05)
    if connection is not None:
        connection.close()
    pipe.send(samples)
    pipe.close()


class Victim:
    """A running victim; stop() ends it and returns its measurements."""

    def __init__(self, target):
        context = multiprocessing.get_context("fork")
        self.stopping = context.Event()
        self.pipe, inner = context.Pipe(duplex=False)
        self.process = context.Process(target=loop, args=(target, self.stopping, inner), daemon=True)
        self.process.start()
        inner.close()

    def stop(self):
        """Ends the victim. Returns its Samples; none if the victim has ended early."""
        self.stopping.set()
        try:
            samples = self.pipe.recv() if self.pipe.poll(4 * WAIT_SECONDS) else []
        except EOFError:
            samples = []
        self.process.join(WAIT_SECONDS)
        if self.process.is_alive():
            self.process.kill()
            self.process.join(WAIT_SECONDS)
        return samples


def quantile(values, share):
    """Returns a quantile in milliseconds; 0 if there are no values."""
    ordered = sorted(values)
    return 1000 * ordered[min(len(ordered) - 1, int(share * len(ordered)))] if ordered else 0.0


def summary(samples, begin, end):
    """Returns statistics of the victim's calls that were open at any time between `begin` and `end`."""
    inside = [sample for sample in samples if sample.at >= begin and sample.at - sample.seconds < end]
    calls = [sample.seconds for sample in inside if not sample.connect]
    connects = [sample.seconds for sample in inside if sample.connect]
    return {"calls": len(inside), "p50_ms": quantile(calls, 0.5), "p99_ms": quantile(calls, 0.99),
            "connect_p50_ms": quantile(connects, 0.5), "connect_p99_ms": quantile(connects, 0.99),
            "errors": dict(collections.Counter(sample.code for sample in inside if sample.code != "OK"))}
