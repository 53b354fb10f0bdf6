"""Tests of a client of three locusd on one replicated PostgreSQL, while servers are killed, frozen and drained."""
import contextlib
import os
import signal
import threading
import time
import unittest

import cluster_support
import locus
from cluster_support import Member, wait_until
from locus import QueryBatch, ReadFrom, SceneRole, UpdateBatch
from support import WAIT_SECONDS, listed

MISSING = cluster_support.engine.unavailable()
TAKEOVER_SECONDS = 60
LOST, AFTER = 100, 200  # batches sent before a fault, and in all


@unittest.skipIf(MISSING, MISSING)
class TakeoverTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.engine = cluster_support.engine.Engine()
        cls.addClassCleanup(cls.engine.close)

    def setUp(self):
        self.failures = []  # of readers
        self.members = [self.start(name) for name in ("a", "b", "c")]
        self.client = wait_until(lambda: locus.connect([member.address for member in self.members]))
        self.addCleanup(self.client.close)
        started = {member.address for member in self.members}
        wait_until(lambda: started <= {member.address for member in self.client.server().cluster.members})
        self.scene = self._testMethodName[:60].replace("_", "-").rstrip("-")
        self.client.create_scene(self.scene)

    def start(self, name):
        member = Member(self.engine, name)
        self.addCleanup(member.close)
        return member

    def leads(self, member):
        if member.process.poll() is not None:
            return False
        with contextlib.suppress(locus.LocusError), locus.connect(member.address, timeout=2) as client:
            return client.scene(self.scene).placement.role == SceneRole.LEADING
        return False

    def leader(self):
        return wait_until(lambda: next(filter(self.leads, self.members), None))

    def reader(self, stop, **options):
        """Starts a thread that queries until `stop` is set. Returns it and the list of the revisions that it sees."""
        seen = []

        def run():
            try:
                with locus.connect([member.address for member in self.members], **options) as client:
                    while not stop.is_set():
                        seen.append(client.query(self.scene, QueryBatch()).revision)
                        time.sleep(0.01)
            except locus.LocusError as error:
                self.failures.append(str(error))

        thread = threading.Thread(target=run)
        thread.start()
        return thread, seen

    def send_through(self, fault):
        """Sends numbered batches, with a fault among them. Returns the acks."""
        stop = threading.Event()
        thread, seen = self.reader(stop)
        try:
            with self.client.update_stream(self.scene) as stream:
                sent = []
                for tick in range(1, AFTER + 1):
                    sent.append(stream.send(UpdateBatch(tick=tick).insert_balls([tick], [[tick, 0, 0]], 1)))
                    if tick == LOST:
                        sent[0].result(WAIT_SECONDS)
                        fault()
                acks = [future.result(TAKEOVER_SECONDS) for future in sent]
        finally:
            stop.set()
            thread.join(WAIT_SECONDS)
        self.assertEqual(self.failures, [])
        self.assertEqual(seen, sorted(seen), "reads went back")
        return acks

    def assertAppliedOnce(self, acks):
        """Checks that each batch was applied, once, in the order sent: the revisions are dense, and so are the objects. The
        second ack of a batch may have a later revision, if the server does not store the first ack any more.
        """
        first = acks[0].revision
        for index, ack in enumerate(acks):
            self.assertGreaterEqual(ack.revision, first + index)
            if not ack.duplicate:
                self.assertEqual(ack.revision, first + index)
        self.assertEqual({ack.epoch for ack in acks}, {acks[0].epoch})
        result = self.client.query(self.scene, QueryBatch().lookup(list(range(1, AFTER + 1))))
        self.assertEqual((result.epoch, result.revision), (acks[-1].epoch, first + AFTER - 1))
        self.assertEqual(listed(result.blocks[0].ids), list(range(1, AFTER + 1)))

    def test_killing_the_leader_loses_no_batch_and_applies_none_twice(self):
        acks = self.send_through(lambda: self.leader().kill())
        self.assertAppliedOnce(acks)

    def test_draining_the_leader_loses_no_batch_and_applies_none_twice(self):
        acks = self.send_through(lambda: self.leader().terminate())
        self.assertAppliedOnce(acks)

    def test_a_frozen_leader_is_left_and_acknowledges_nothing_when_it_wakes(self):
        frozen = self.leader()
        acks = self.send_through(lambda: os.kill(frozen.process.pid, signal.SIGSTOP))
        os.kill(frozen.process.pid, signal.SIGCONT)
        self.assertAppliedOnce(acks)
        self.assertNotEqual(self.leader().address, frozen.address)

    def test_no_step_is_lost_or_applied_twice_when_the_leader_is_killed(self):
        with self.client.query_stream(self.scene) as stream:
            sent = []
            for tick in range(1, AFTER + 1):
                update = UpdateBatch(tick=tick).insert_balls([tick], [[tick, 0, 0]], 1)
                sent.append(stream.step(update, QueryBatch().lookup([tick])))
                if tick == LOST:
                    self.leader().kill()
            steps = [future.result(TAKEOVER_SECONDS) for future in sent]
        self.assertEqual([listed(step.result.blocks[0].ids) for step in steps], [[tick] for tick in range(1, AFTER + 1)])
        self.assertAppliedOnce([step.ack for step in steps])

    def test_reads_of_any_server_never_go_back_while_leaders_are_killed(self):
        stop = threading.Event()
        readers = [self.reader(stop, read_from=read_from) for read_from in (ReadFrom.ANY, ReadFrom.FOLLOWER)]
        try:
            for tick in range(1, 21):
                self.client.apply(self.scene, UpdateBatch(tick=tick, writer=7, number=tick))
                if tick == 10:
                    self.leader().kill()
        finally:
            stop.set()
            for thread, _ in readers:
                thread.join(WAIT_SECONDS)
        self.assertEqual(self.failures, [])
        for _, seen in readers:
            self.assertEqual(seen, sorted(seen))
            self.assertGreater(seen[-1], 10)

    def test_a_moved_scene_is_followed(self):
        leader = self.leader()
        other = next(member.address for member in self.members if member is not leader)
        with self.client.update_stream(self.scene) as stream:
            stream.send(UpdateBatch(tick=1)).result(WAIT_SECONDS)
            moved = wait_until(lambda: self.client.move_scene(self.scene, other))  # once the leader knows the other member
            self.assertEqual(moved.leader, other)
            self.assertEqual(stream.send(UpdateBatch(tick=2)).result(WAIT_SECONDS).tick, 2)
        self.assertEqual(self.leader().address, other)
        self.assertEqual(self.client.query(self.scene, QueryBatch()).tick, 2)

    def test_calls_survive_the_loss_of_the_leader(self):
        self.client.apply(self.scene, UpdateBatch(tick=1, writer=7, number=1))
        self.leader().kill()
        ack = self.client.apply(self.scene, UpdateBatch(tick=2, writer=7, number=2))
        self.assertEqual((ack.tick, ack.duplicate), (2, False))
        self.assertTrue(self.client.apply(self.scene, UpdateBatch(tick=2, writer=7, number=2)).duplicate)
        self.assertEqual(self.client.query(self.scene, QueryBatch()).tick, 2)
        self.assertIn(self.scene, [scene.name for scene in self.client.scenes()])
        self.client.create_scene(self.scene + ".2")
        self.client.delete_scene(self.scene + ".2")

    def test_a_client_of_one_address_is_told_where_to_go(self):
        leader = self.leader()
        other = next(member for member in self.members if member is not leader)
        with locus.connect(other.address) as client:
            error = wait_until(lambda: self.refusal(client))
        self.assertIn(leader.address, str(error))
        self.assertEqual(error.addresses, (leader.address,))
        self.assertGreater(error.token, 0)

    def refusal(self, client):
        """Returns the error that names the leader; None while the server asks its engine for it."""
        with self.assertRaises(locus.LocusError) as refused:
            client.apply(self.scene, UpdateBatch())
        return refused.exception if refused.exception.reason == locus.Reason.ELSEWHERE else None

    def test_servers_and_scenes_describe_the_cluster(self):
        leader = self.leader()
        with locus.connect([leader.address]) as client:
            cluster, scene = client.server().cluster, client.scene(self.scene)
        own = next(member for member in cluster.members if member.id == cluster.member)
        self.assertIn(own.address, [member.address for member in self.members])
        self.assertTrue(cluster.engine and cluster.engine_answers)
        self.assertEqual(scene.durability, locus.Durability.REPLICATED)
        self.assertEqual((scene.placement.role, scene.placement.followers), (SceneRole.LEADING, ()))
        self.assertGreater(scene.placement.token, 0)
        listed_scene = next(one for one in self.client.scenes() if one.name == self.scene)
        self.assertEqual(listed_scene.placement.token, scene.placement.token)

    def test_one_address_is_enough_to_find_the_others(self):
        leader = self.leader()
        other = next(member for member in self.members if member is not leader)
        for read_from in ReadFrom:
            with locus.connect([other.address], read_from=read_from) as client:
                ack = client.apply(self.scene, UpdateBatch(tick=5))
                result = client.query(self.scene, QueryBatch())
                self.assertEqual((result.revision, result.age_ms), (ack.revision, 0))
