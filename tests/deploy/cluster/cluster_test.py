"""Test of deploy/cluster as a whole in plain processes: three locusd on PostgreSQL with Patroni, behind HAProxy. Clients that
know only the proxy write without pause; a daemon is killed, then the primary, then a daemon is stopped in order. Work goes on,
and every acknowledged update is there, once.

    LOCUS_PACKAGE=build/release/python LOCUS_BIN=build/release/bin python3 cluster_test.py

Exits 77, which counts as skipped, where programs are missing.
"""
import collections
import os
import random
import signal
import subprocess
import sys
import threading
import time
import unittest

import plain_cluster
from plain_cluster import DEPLOY, HAPROXY, Member, PlainCluster, wait_for

import calls  # its folder is on the path since plain_cluster was imported
from calls import BIN, LOCUSD

SKIPPED = 77
UNANSWERED = ("UNAVAILABLE", "DEADLINE_EXCEEDED")  # what a call may also end with that no daemon answered
SCENES = [f"arena-{number}" for number in range(6)]
CALL_SECONDS = 3
BACK_SECONDS = 90
STEADY_ACKS = 20
PAUSE_SECONDS = 0.005
HANDED_OVER_SECONDS = 60  # stop_grace_period of compose.yaml


class Daemon(Member):
    """One locusd: ports for calls and for its pages."""

    @property
    def address(self):
        return f"127.0.0.1:{self.ports[0]}"


class WholeCluster(PlainCluster):
    """A cluster with daemons and proxy. Clients use `address`."""

    def __init__(self):
        super().__init__()
        self.daemons = [self.member(f"locusd-{number}", Daemon) for number in range(1, plain_cluster.COUNT + 1)]
        self.proxy = self.member("haproxy")
        self.address = f"127.0.0.1:{self.proxy.ports[0]}"
        self.map, self.socket = self.path("scenes.map"), self.path("haproxy.sock")
        try:
            for daemon in self.daemons:
                self.start_daemon(daemon)
            self.start_proxy()
            wait_for(self.is_served, plain_cluster.START_SECONDS, "the proxy passes on calls")
        except BaseException:
            self.close()
            raise

    def start_daemon(self, daemon):
        daemon.process = self.start(daemon.name, [LOCUSD], {
            "LOCUS_LISTEN": daemon.address, "LOCUS_HTTP_LISTEN": f"127.0.0.1:{daemon.ports[1]}", "LOCUS_CLUSTER": self.url(),
            "LOCUS_ADVERTISE": daemon.address, "LOCUS_ZONE": "here", "LOCUS_DATA_DIR": ""})

    def start_proxy(self):
        open(self.map, "w", encoding="utf-8").close()
        ports = {f"LOCUS_CLUSTER_{kind}_{number}": str(value) for number, daemon in enumerate(self.daemons, 1)
                 for kind, value in (("DAEMON", daemon.address), ("HTTP", daemon.ports[1]))}
        self.proxy.process = self.start(self.proxy.name, [HAPROXY, "-W", "-db", "-f", os.path.join(DEPLOY, "haproxy.cfg")], {
            **ports, "LOCUS_CLUSTER_LISTEN": self.address, "LOCUS_CLUSTER_ADMIN": self.socket, "LOCUS_CLUSTER_MAP": self.map})
        self.start("update_map", ["/usr/bin/python3", "-B", os.path.join(DEPLOY, "update_map.py"), "--cluster", self.url(),
                                  "--socket", self.socket, "--map", self.map], {})

    def is_served(self):
        try:
            with calls.locus.connect(self.address, timeout=CALL_SECONDS) as client:
                return client.healthy()
        except calls.locus.LocusError:
            return False

    def leaders(self):
        """Returns the daemon of each scene that one leads."""
        by_address = {daemon.address: daemon for daemon in self.daemons}
        rows = self.ask("SELECT s.name, m.address FROM locus.scene s JOIN locus.scene_log l ON l.scene = s.key "
                        "JOIN locus.member m ON m.id = l.leader WHERE m.dead = 0")
        return {row[0]: by_address[row[1]] for row in rows if row}

    def all_led_by(self, daemons):
        led = self.leaders()
        return set(led) == set(SCENES) and all(daemon in daemons for daemon in led.values())


class Writer(threading.Thread):
    """Inserts one point after the other into a scene, through the proxy, by numbered batches: each is sent again until it is
    acknowledged. `acknowledged` are the times of the answers.
    """

    def __init__(self, address, scene):
        super().__init__(daemon=True)
        self.address, self.scene, self.ended = address, scene, threading.Event()
        self.writer = random.SystemRandom().randrange(1, 1 << 62)
        self.acknowledged, self.errors, self.last = [], collections.Counter(), None

    def run(self):
        with calls.locus.connect(self.address, timeout=CALL_SECONDS) as client:
            while not self.ended.is_set():
                number = len(self.acknowledged) + 1
                batch = calls.locus.UpdateBatch(writer=self.writer, number=number)
                try:
                    ack = client.apply(self.scene, batch.insert_points([number], positions=[[number, 0, 0]]))
                except calls.locus.LocusError as error:
                    unnamed = "" if error.refused or error.code.name in UNANSWERED else f": {error.message}"
                    self.errors[f"{error.code.name} {error.reason.name}{unnamed}"] += 1
                    self.ended.wait(0.05)
                    continue
                self.last = ack
                self.acknowledged.append(time.monotonic())
                self.ended.wait(PAUSE_SECONDS)

    def since(self, moment):
        return sum(1 for answered in list(self.acknowledged) if answered > moment)

    def longest_pause(self, start, end):
        times = [start] + [answered for answered in list(self.acknowledged) if start < answered < end] + [end]
        return max(after - before for before, after in zip(times, times[1:]))


class ClusterTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cluster = WholeCluster()
        cls.addClassCleanup(cls.cluster.close)
        with calls.locus.connect(cls.cluster.address, timeout=CALL_SECONDS) as client:
            for scene in SCENES:
                client.create_scene(scene)

    def setUp(self):
        self.writers = [Writer(self.cluster.address, scene) for scene in SCENES]
        for writer in self.writers:
            writer.start()
            self.addCleanup(writer.ended.set)
        self.wait_until_back("writes begin")

    def wait_until_back(self, what):
        """Waits until every scene acknowledges again."""
        start = time.monotonic()
        wait_for(lambda: all(writer.since(start) >= STEADY_ACKS for writer in self.writers), BACK_SECONDS, what)

    def fault(self, what, act):
        """Does something to the cluster while clients write, waits until all scenes are written again, and says how long."""
        start = time.monotonic()
        act()
        self.wait_until_back(f"writes after: {what}")
        end = time.monotonic()
        pause = max(writer.longest_pause(start, end) for writer in self.writers)
        print(f"proof: {what}: longest pause of a scene {pause:.1f} s", flush=True)

    def verify(self):
        """Verifies that all acknowledged points are there, and that each batch made one revision."""
        for writer in self.writers:
            writer.ended.set()
        errors = collections.Counter()
        for writer in self.writers:
            writer.join()
            errors += writer.errors
            count = len(writer.acknowledged)

            def read(writer=writer, count=count):
                try:
                    with calls.locus.connect(self.cluster.address, timeout=CALL_SECONDS) as client:
                        batch = calls.locus.QueryBatch(at_least=writer.last).lookup(list(range(1, count + 3)))
                        return client.query(writer.scene, batch)
                except calls.locus.LocusError:
                    return None
            result = wait_for(read, BACK_SECONDS, f"{writer.scene} is read")
            found = sum(1 for number in result.blocks[0].ids if number)  # 0 stands for an object that is not there
            # The last batch may have been applied although its answer never came.
            self.assertIn((found, result.revision), ((count, count), (count + 1, count + 1)), writer.scene)
        total = sum(len(writer.acknowledged) for writer in self.writers)
        print(f"proof: {total} updates acknowledged in {len(SCENES)} scenes, 0 lost, 0 twice; refused meanwhile: {dict(errors)}",
              flush=True)

    def stop_in_order(self, daemon):
        """Stops a daemon as an operator does: by SIGTERM. It must end in time."""
        first = plain_cluster.keeper.family(daemon.process.pid)[1]
        os.kill(first, signal.SIGTERM)
        daemon.process.wait(timeout=HANDED_OVER_SECONDS)
        self.cluster.keeper.release(daemon.process.pid)
        self.assertEqual(daemon.process.returncode, 0, self.cluster.log(daemon.name)[-2000:])

    def test_work_goes_on_without_a_daemon_and_without_the_primary(self):
        cluster, daemons = self.cluster, self.cluster.daemons
        self.assertTrue(cluster.all_led_by(daemons))
        self.assertGreater(len(set(cluster.leaders().values())), 1)
        first, second = sorted(set(cluster.leaders().values()), key=lambda daemon: daemon.name)[:2]
        self.fault("a daemon killed", lambda: cluster.kill(first))
        self.assertTrue(cluster.all_led_by([daemon for daemon in daemons if daemon is not first]))
        cluster.start_daemon(first)
        primary = cluster.primary()
        self.fault("the primary killed", lambda: cluster.kill(primary))
        cluster.start_node(primary)
        wait_for(cluster.is_complete, BACK_SECONDS, "the old primary follows the new one")
        self.fault("a daemon stopped in order", lambda: self.stop_in_order(second))
        wait_for(lambda: cluster.all_led_by([daemon for daemon in daemons if daemon is not second]), BACK_SECONDS, "all are led")
        self.wait_until_back("writes go on")
        self.verify()


def unavailable():
    if plain_cluster.unavailable() or calls.unavailable():
        return plain_cluster.unavailable() or calls.unavailable()
    answer = subprocess.run([LOCUSD, "--help"], stdout=subprocess.PIPE, text=True, timeout=60, check=False)
    return "" if "--cluster " in answer.stdout else f"{BIN}/locusd has no option --cluster"


if __name__ == "__main__":
    if unavailable():
        print(f"SKIPPED: {unavailable()}")
        sys.exit(SKIPPED)
    plain_cluster.keeper.end_in_order()
    unittest.main(verbosity=2)
