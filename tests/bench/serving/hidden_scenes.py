"""Compares the times that locusd takes to refuse two scenes: one that the caller may not read, and one that is missing.

    /usr/bin/python3 hidden_scenes.py BIN_DIRECTORY [CALLS]

Starts a daemon with the scene `hidden-1` of 10,000 objects, and sends calls as a caller who may not read this scene.
Sends CALLS (default 20,000) GetScene calls for the hidden scene and as many for the missing scene, in random order.
Then does the same with CreateScene (with static_from) and with Query. Prints quantiles of the durations of each method,
and the p-value of a Mann-Whitney test. Repeats all this with a daemon that has an audit file. Needs python3-grpcio and
python3-numpy.
"""

import math
import os
import random
import subprocess
import sys
import tempfile
import time

import grpc
import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../attack"))
import protobuf
from protobuf import delimited

QUANTILES = (1, 10, 25, 50, 75, 90, 99)
START_SECONDS = 30
OBJECTS = 10_000
STATIC_FROM = 6  # field of SceneSpec
# Names of equal length.
HIDDEN, ABSENT = b"hidden-1", b"absent-1"


REQUESTS = {
    "GetScene": ("/locus.v1.SceneService/GetScene", lambda scene: delimited(1, scene)),
    "CreateScene": ("/locus.v1.SceneService/CreateScene",
                    lambda scene: delimited(1, b"own-1") + delimited(2, delimited(STATIC_FROM, scene))),
    "Query": ("/locus.v1.QueryService/Query", lambda scene: delimited(1, scene)),
}


def p_value(first, second):
    """Returns the two-sided p-value of a Mann-Whitney test, by the normal approximation."""
    count, other = len(first), len(second)
    ranks = numpy.empty(count + other)
    ranks[numpy.argsort(numpy.concatenate((first, second)), kind="stable")] = numpy.arange(1, count + other + 1)
    smaller = ranks[:count].sum() - count * (count + 1) / 2
    deviation = math.sqrt(count * other * (count + other + 1) / 12)
    return math.erfc(abs(smaller - count * other / 2) / deviation / math.sqrt(2))


class Daemon:
    """A locusd on a free port of loopback, with a token that may do everything and one that may do little."""

    def __init__(self, programs, folder, audited):
        self.folder = folder
        tokens, port, access = (os.path.join(folder, name) for name in ("tokens", "port", "access"))
        self.tokens = {name: self.token(programs, name, tokens) for name in ("owner", "guest")}
        with open(access, "w", encoding="utf-8", opener=lambda path, flags: os.open(path, flags, 0o600)) as file:
            file.write("grant token:owner admin *\ngrant token:guest admin own-*\n")
        command = [os.path.join(programs, "locusd"), "--listen", "127.0.0.1:0", "--port-file", port, "--http-listen", "",
                   "--access-file", access, "--token-file", tokens, "--log-level", "error"]
        if audited:
            command += ["--audit-file", os.path.join(folder, "audit")]
        self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL)
        until = time.monotonic() + START_SECONDS
        while not os.path.exists(port):
            if self.process.poll() is not None or time.monotonic() > until:
                raise RuntimeError("locusd did not start")
            time.sleep(0.05)
        with open(port, encoding="utf-8") as file:
            self.address = "127.0.0.1:" + file.read().strip()

    @staticmethod
    def token(programs, name, file):
        command = [os.path.join(programs, "locus"), "token", "create", name, "--token-file", file]
        return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, timeout=60).stdout.strip()

    def prepare(self):
        """Makes the scene with its objects."""
        channel, metadata = grpc.insecure_channel(self.address), (("authorization", "Bearer " + self.tokens["owner"]),)
        for path, request in (("/locus.v1.SceneService/CreateScene", protobuf.create_scene(HIDDEN)),
                              ("/locus.v1.UpdateService/ApplyUpdates",
                               protobuf.apply(HIDDEN, protobuf.insert_balls(1, OBJECTS)))):
            channel.unary_unary(path)(request, timeout=60, metadata=metadata)

    def stop(self):
        self.process.terminate()
        self.process.wait(timeout=60)


def measure(daemon, method, calls):
    """Returns the durations in microseconds of calls to the hidden and to the absent scene, as two arrays."""
    path, request = REQUESTS[method]
    call = grpc.insecure_channel(daemon.address).unary_unary(path)
    metadata = (("authorization", "Bearer " + daemon.tokens["guest"]),)
    requests = {scene: request(scene) for scene in (HIDDEN, ABSENT)}
    took = {scene: [] for scene in requests}
    order = [HIDDEN, ABSENT] * (calls + 200)
    random.Random(1).shuffle(order)
    for scene in order:
        start = time.perf_counter_ns()
        try:
            call(requests[scene], timeout=60, metadata=metadata)
            raise RuntimeError(f"{method} of {scene} was served")
        except grpc.RpcError as error:
            took[scene].append((time.perf_counter_ns() - start) / 1e3)
            if error.code() != grpc.StatusCode.NOT_FOUND:
                raise
    return tuple(numpy.array(took[scene][200:]) for scene in (HIDDEN, ABSENT))


def main():
    programs, calls = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 20_000
    print("microseconds, quantiles in percent:", *(f"{quantile:>8}" for quantile in QUANTILES))
    for audited in (False, True):
        with tempfile.TemporaryDirectory() as folder:
            daemon = Daemon(programs, folder, audited)
            try:
                daemon.prepare()
                for method in REQUESTS:
                    both = measure(daemon, method, calls)
                    for name, took in zip(("hidden", "absent"), both):
                        print(f"{method:12} {'audited' if audited else '':8} {name}      ",
                              *(f"{value:8.1f}" for value in numpy.percentile(took, QUANTILES)))
                    print(f"{'':31} p = {p_value(*both):.3f}")
            finally:
                daemon.stop()


if __name__ == "__main__":
    main()
