"""Measures a cluster of three daemons on a primary and two standbys: how long writes stop when a leader is killed or drained,
how long it takes until a thousand scenes are led again, and what replicated acks cost. A tool for people, not a test.

    python3 -B measure.py [--scenes 1000] [--rounds 3] [takeover] [drain] [scenes] [acks]
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import threading
import time

from calls import BIN, Answer, Caller, double_column, id_column, request_of
from daemons import Daemons
from engine import Engine

WAIT_SECONDS = 120
KNOWN_REASONS = ("REASON_ELSEWHERE", "REASON_NO_LEADER", "REASON_DRAINING", "REASON_RECOVERING")


class Writer(threading.Thread):
    """Sends numbered batches of one scene, one after another, to its leader, and notes when each is acknowledged."""

    def __init__(self, daemons, scene):
        super().__init__(daemon=True)
        self.names, self.scene = daemons.names(), scene
        self.caller = Caller(daemons.addresses())
        self.at = sorted(daemons.addresses())[0]
        self.acks, self.errors, self.ended = [], [], False

    def run(self):
        number = 1
        while not self.ended:
            answer = self.send(number)
            if answer.answered:
                self.acks.append((time.monotonic(), answer.response.ack.revision))
                number += 1
        self.caller.close()

    def send(self, number) -> Answer:
        request = request_of("Update", "ApplyUpdates", scene=self.scene)
        request.batch.writer, request.batch.batch = 1, number
        insert = request.batch.inserts.add()
        insert.ids, insert.positions_f64 = id_column([number]), double_column([(number, 0, 0)])
        insert.point.SetInParent()
        answer = self.caller.send(self.at, "Update", "ApplyUpdates", request)
        if answer.answered:
            return answer
        if answer.reason == "REASON_ELSEWHERE":
            self.at = self.names[answer.addresses[0]]
            return answer
        if answer.code not in ("UNAVAILABLE", "DEADLINE_EXCEEDED") and answer.reason not in KNOWN_REASONS:
            self.errors.append(answer.error)
        names = sorted(set(self.names.values()))
        self.at = names[(names.index(self.at) + 1) % len(names)]
        time.sleep(0.02)
        return answer

    def longest_gap(self):
        times = [at for at, _ in self.acks]
        return max(after - before for before, after in zip(times, times[1:]))

    def is_dense(self):
        return [revision for _, revision in self.acks] == list(range(1, len(self.acks) + 1))


def create(daemons, at, scene):
    answer = daemons.caller.call(at.name, "Scene", "CreateScene", seconds=10, name=scene)
    if not answer.answered:
        sys.exit(f"{scene}: {answer.error}")


def interrupted(daemons, scene, interrupt):
    """Writes while `interrupt(leader)` happens. Returns the longest time without an ack, and the errors."""
    create(daemons, daemons.running()[0], scene)
    writer = Writer(daemons, scene)
    writer.start()
    time.sleep(3)
    before = len(writer.acks)
    interrupt(daemons.leader(scene))
    deadline = time.monotonic() + WAIT_SECONDS
    while len(writer.acks) < before + 500 and time.monotonic() < deadline:
        time.sleep(0.05)
    writer.ended = True
    writer.join()
    return writer.longest_gap(), writer.errors + ([] if writer.is_dense() else ["the revisions have gaps"])


def measure(rounds, name, bar, daemons, interrupt):
    gaps, errors = [], []
    for number in range(rounds):
        gap, found = interrupted(daemons, f"{name}{number}", interrupt)
        gaps.append(gap)
        errors += found
        daemons.repair()
        time.sleep(3)
    print(f"{name}: writes stopped for {statistics.median(gaps):.2f} s (of {rounds}: {min(gaps):.2f}-{max(gaps):.2f}); "
          f"bar {bar}; errors: {errors or 'none'}", flush=True)


def all_scenes(daemons, at):
    """Returns the leader of each scene as a daemon lists them, and the seconds that the list took."""
    begin, found, token = time.monotonic(), {}, ""
    while True:
        answer = daemons.caller.call(at.name, "Scene", "ListScenes", seconds=30, page_token=token)
        if not answer.answered:
            sys.exit(answer.error)
        found.update({scene.name: scene.placement.leader for scene in answer.response.scenes})
        token = answer.response.next_page_token
        if not token:
            return found, time.monotonic() - begin


def scenes(daemons, count):
    begin = time.monotonic()
    for number in range(count):
        create(daemons, daemons.daemons[number % 3], f"many{number:05}")
    print(f"scenes: {count} created in {time.monotonic() - begin:.1f} s", flush=True)
    killed, asked = daemons.daemons[0], daemons.daemons[1]
    led = sum(1 for leader in all_scenes(daemons, asked)[0].values() if leader == killed.advertised)
    begin = time.monotonic()
    daemons.kill(killed)
    while True:
        leaders, seconds = all_scenes(daemons, asked)
        if all(leader and leader != killed.advertised for leader in leaders.values()):
            break
        time.sleep(0.1)
    assigned = time.monotonic() - begin
    # A scene is led when its leader describes it; the last ones to be read are among those that were taken over.
    for name, leader in leaders.items():
        at = daemons.by_name(daemons.names()[leader])
        while not daemons.caller.call(at.name, "Scene", "GetScene", name=name).answered:
            time.sleep(0.02)
    print(f"scenes: {led} of {count} lost their leader; all have another after {assigned:.1f} s and are served after "
          f"{time.monotonic() - begin:.1f} s; bar 15 s; the list takes {seconds:.2f} s; bar 1 s", flush=True)


def moves_per_second(address, streams=8, seconds=4):
    """Returns the rate of acknowledged moves of `streams` scenes, each by one stream of batches of 256."""
    command = [os.path.join(BIN, "locus"), "--address", address, "-o", "json", "bench", "--connections", "1", "--kinds", "moves",
               "--batch", "256", "--seconds", str(seconds)]
    processes = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(streams)]
    reports = [json.loads(process.communicate()[0]) for process in processes]
    return sum(kind["rate_per_s"] for report in reports for kind in report["kinds"])


def acks(rounds):
    """Compares acks of a cluster of one daemon with those of a daemon that has a data directory, in turns."""
    with Engine() as engine, Daemons(1, engine) as cluster, Daemons(1) as alone:
        time.sleep(2)
        pairs = [(moves_per_second(cluster.daemons[0].address), moves_per_second(alone.daemons[0].address))
                 for _ in range(rounds)]
    replicated, local = (statistics.median(rates) for rates in zip(*pairs))
    print(f"acks: {replicated:.0f} moves/s REPLICATED, {local:.0f} LOCAL: {replicated / local:.2f}x; bar 0.4", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", nargs="*", default=["takeover", "drain", "scenes", "acks"])
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    with Engine() as engine, Daemons(3, engine) as daemons:
        if "takeover" in options.rows:
            measure(options.rounds, "takeover", "6 s + 2 s with followers", daemons, daemons.kill)
        if "drain" in options.rows:
            measure(options.rounds, "drain", "1 s", daemons, daemons.drain)
        if "scenes" in options.rows:
            scenes(daemons, options.scenes)
    if "acks" in options.rows:
        acks(options.rounds)


if __name__ == "__main__":
    main()
