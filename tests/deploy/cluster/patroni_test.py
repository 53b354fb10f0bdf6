"""Tests of the engine of deploy/cluster with Patroni: writes come back after the loss of a primary, and nothing that was
acknowledged is lost. Runs etcd, Patroni, PostgreSQL and HAProxy as plain processes.

    python3 patroni_test.py [TEST...]

Exits 77, which counts as skipped, where they are missing. Takes three minutes, most of which are timeouts of Patroni.
"""
import signal
import sys
import threading
import time
import unittest

import plain_cluster
import sql
from plain_cluster import PlainCluster, wait_for

SKIPPED = 77
WRITE_SECONDS = 3  # as locusd: without an answer for so long, it asks the next host
BACK_SECONDS = 90
FROZEN_SECONDS = 35  # longer than Patroni's ttl
STEADY_WRITES = 20
SETTINGS = ("SELECT current_setting('fsync'), current_setting('full_page_writes'), current_setting('synchronous_commit'), "
            "current_setting('synchronous_standby_names') <> '', current_setting('server_encoding')")
ACCEPTED = ("on", "on", "on", True, "UTF8")


class Writer(threading.Thread):
    """Writes one numbered row after the other, as locusd does: an answer that does not come is unknown, the next host is asked.
    `acknowledged` are the numbers whose commit was confirmed, with the times of the answers.
    """

    def __init__(self, cluster):
        super().__init__(daemon=True)
        self.cluster, self.ended = cluster, threading.Event()
        self.acknowledged, self.refused = {}, set()

    def run(self):
        session, host, number = None, 0, 0
        while not self.ended.is_set():
            number += 1
            try:
                session = session or sql.Session(self.cluster.dsn(self.cluster.nodes[host]))
                rows = session.run(WRITE_SECONDS, ("INSERT INTO written VALUES (%s)", (number,)), (SETTINGS, None))
                if rows[1][0] != ACCEPTED:
                    self.refused.add(rows[1][0])
                self.acknowledged[number] = time.monotonic()
            except sql.Unknown:
                if session:
                    session.close()
                session, host = None, (host + 1) % plain_cluster.COUNT
                self.ended.wait(0.1)
            self.ended.wait(0.005)

    def since(self, moment):
        """Returns the number of rows that were acknowledged after a moment."""
        return sum(1 for answered in list(self.acknowledged.values()) if answered > moment)

    def wait_until_back(self):
        """Waits until rows are acknowledged again. Returns the seconds until the first of them."""
        start = time.monotonic()
        wait_for(lambda: self.since(start) >= STEADY_WRITES, BACK_SECONDS, "writes come back")
        return min(answered for answered in list(self.acknowledged.values()) if answered > start) - start

    def longest_pause(self, start):
        times = [start] + sorted(answered for answered in list(self.acknowledged.values()) if answered > start)
        return max(after - before for before, after in zip(times, times[1:]))

    def end(self):
        self.ended.set()
        self.join()


class PatroniTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.cluster = PlainCluster()
        cls.addClassCleanup(cls.cluster.close)
        cls.cluster.ask("CREATE TABLE written (number bigint PRIMARY KEY); SELECT 1")

    def setUp(self):
        wait_for(self.cluster.is_complete, BACK_SECONDS, "the engine is whole")
        self.cluster.ask("TRUNCATE written; SELECT 1")
        self.writer = Writer(self.cluster)
        self.writer.start()
        self.addCleanup(self.writer.end)
        self.writer.wait_until_back()

    def check(self, what):
        """Ends the writer, and verifies that every acknowledged row is there and that locusd would have accepted the engine's
        settings after every commit."""
        self.writer.end()
        found = {row[0] for row in self.cluster.ask("SELECT number FROM written")}
        lost = sorted(set(self.writer.acknowledged) - found)
        print(f"proof: {what}; {len(self.writer.acknowledged)} acknowledged, {len(lost)} lost", flush=True)
        self.assertEqual((lost, self.writer.refused), ([], set()))

    def test_a_primary_that_is_killed(self):
        old = self.cluster.primary()
        self.cluster.kill(old)
        seconds = self.writer.wait_until_back()
        self.assertNotIn(self.cluster.primary(), (None, old))
        self.cluster.start_node(old)
        wait_for(self.cluster.is_complete, BACK_SECONDS, "the old primary follows the new one")
        self.check(f"primary killed, writes back after {seconds:.1f} s")

    def test_a_primary_that_is_frozen_and_woken(self):
        old = self.cluster.primary()
        self.addCleanup(self.cluster.signal, old, signal.SIGCONT)
        start = time.monotonic()
        self.cluster.signal(old, signal.SIGSTOP)
        seconds = self.writer.wait_until_back()
        time.sleep(max(0.0, FROZEN_SECONDS - (time.monotonic() - start)))
        self.cluster.signal(old, signal.SIGCONT)
        woken = time.monotonic()
        # It believes at first that it leads; its commits wait for a standby that has left it.
        with self.assertRaises(sql.Unknown):
            session = sql.Session(self.cluster.dsn(old))
            self.addCleanup(session.close)
            session.run(WRITE_SECONDS, ("INSERT INTO written VALUES (-1)", None))
        wait_for(self.cluster.is_complete, BACK_SECONDS, "the woken node follows the new primary")
        wait_for(lambda: self.writer.since(woken) >= STEADY_WRITES, BACK_SECONDS, "writes go on")
        self.check(f"primary frozen for {FROZEN_SECONDS} s, writes back after {seconds:.1f} s")
        self.assertEqual(self.cluster.ask("SELECT count(*) FROM written WHERE number = -1"), [(0,)])

    def test_a_synchronous_standby_that_is_killed(self):
        states = self.cluster.states()
        standby = next(node for node in self.cluster.nodes if states[node.name][0] == "sync_standby")
        start = time.monotonic()
        self.cluster.kill(standby)
        self.writer.wait_until_back()
        pause = self.writer.longest_pause(start)
        self.cluster.start_node(standby)
        wait_for(self.cluster.is_complete, BACK_SECONDS, "the standby is back")
        self.check(f"synchronous standby killed, writes paused for {pause:.1f} s")

    def test_etcd_that_is_away(self):
        for member in self.cluster.etcds[:2]:
            start = time.monotonic()
            self.cluster.kill(member)
            time.sleep(FROZEN_SECONDS)
            wait_for(lambda: self.writer.since(start + FROZEN_SECONDS) >= STEADY_WRITES, BACK_SECONDS, "writes go on")
        pause = self.writer.longest_pause(start)
        for member in self.cluster.etcds[:2]:
            self.cluster.start_etcd(member)
        wait_for(self.cluster.is_complete, BACK_SECONDS, "etcd is back")
        self.check(f"two of three etcd killed for {FROZEN_SECONDS} s, longest pause of writes {pause:.1f} s")


if __name__ == "__main__":
    if plain_cluster.unavailable():
        print(f"SKIPPED: {plain_cluster.unavailable()}")
        sys.exit(SKIPPED)
    plain_cluster.keeper.end_in_order()
    unittest.main(verbosity=2)
