"""Tests of a client with several addresses, against servers that play the members of a cluster."""
import time
import unittest

import grpc
import locus
from cluster_support import FakeMember
from locus import QueryBatch, ReadFrom, Retry, Revision, UpdateBatch
from support import WAIT_SECONDS

QUICK = Retry(attempts=40, first_wait=0.02, max_wait=0.05)


class ClusterTest(unittest.TestCase):
    def setUp(self):
        self.cluster = {"leader": "", "token": 1, "applied": [], "numbers": {}, "epoch": 1, "down": {}}
        self.members = [FakeMember(self.cluster) for _ in range(3)]
        for member in self.members:
            self.addCleanup(member.stop)
        self.lead(0)

    def lead(self, index, token=None):
        self.cluster["leader"] = self.members[index].address
        self.cluster["token"] = token if token is not None else self.cluster["token"] + 1

    def connect(self, *indices, **options):
        addresses = [self.members[index].address for index in indices or range(3)]
        client = locus.connect(addresses, **{"retry": QUICK, **options})
        self.addCleanup(client.close)
        return client

    def views(self, index):
        return self.members[index].seen


class CallsTest(ClusterTest):
    def test_addresses_are_a_list_or_a_text_with_commas(self):
        addresses = [member.address for member in self.members]
        for given in (addresses, ",".join(addresses), ", ".join(addresses)):
            with locus.connect(given) as client:
                self.assertEqual(client.address, ",".join(addresses))
        with self.assertRaisesRegex(ValueError, "no address"):
            locus.connect([])

    def test_a_client_of_one_address_follows_nobody_and_adds_nothing_to_views(self):
        with locus.connect(self.members[1].address) as client:
            with self.assertRaises(locus.LocusError) as refused:
                client.query("arena", QueryBatch())
            self.assertEqual(refused.exception.reason, locus.Reason.ELSEWHERE)
            self.assertEqual(refused.exception.addresses, (self.members[0].address,))
        with locus.connect(self.members[0].address) as client:
            client.apply("arena", UpdateBatch())
            client.query("arena", QueryBatch())
        self.assertEqual([view.ByteSize() for view in self.views(0) + self.views(1)], [0, 0])

    def test_every_call_reaches_the_leader_which_may_be_an_unknown_server(self):
        client = self.connect(1)
        self.assertEqual(client.apply("arena", UpdateBatch(tick=3)).revision, 1)  # also without a number
        self.assertEqual(client.query("arena", QueryBatch()).revision, 1)
        self.assertEqual(client.scene("arena").placement.leader, self.members[0].address)
        client.create_scene("hall", static_from="arena")
        self.lead(2)
        self.assertEqual(client.apply("arena", UpdateBatch(tick=4)).revision, 2)
        self.assertEqual(self.cluster["applied"], [3, 4])

    def test_calls_wait_until_a_server_leads(self):
        client = self.connect()
        for reason, code in ((locus.Reason.DRAINING, 14), (locus.Reason.RECOVERING, 14), (locus.Reason.UNSPECIFIED, 14)):
            self.cluster["down"] = {self.members[0].address: (code, reason)}
            self.lead(0)
            with self.subTest(reason):
                self.assertRaises(locus.LocusError, self.connect(retry=Retry(attempts=3, first_wait=0.01)).scene, "arena")
                self.lead(1)
                self.assertEqual(client.scene("arena").placement.leader, self.members[1].address)
        self.cluster.update(leader="", down={})
        with self.assertRaisesRegex(locus.LocusError, "no server leads the scene; tried at .*: check that") as lost:
            self.connect(retry=Retry(attempts=3, first_wait=0.01)).apply("arena", UpdateBatch())
        self.assertEqual(lost.exception.reason, locus.Reason.NO_LEADER)

    def test_a_dead_server_is_left_at_once_whatever_the_call(self):
        client = self.connect()
        client.apply("arena", UpdateBatch(tick=1))
        self.members[0].stop()
        self.lead(1)
        begun = time.monotonic()
        deadline = begun + WAIT_SECONDS
        while True:  # the first call may still be sent on the broken connection, so its outcome is unknown
            try:
                client.apply("arena", UpdateBatch(tick=2))
                break
            except locus.LocusError as error:
                self.assertLess(time.monotonic(), deadline, str(error))
        self.assertEqual(self.cluster["applied"], [1, 2])
        self.assertEqual(self.connect(0, 1).query("arena", QueryBatch()).revision, 2)

    def test_an_update_without_number_is_sent_once_if_its_outcome_is_unknown(self):
        self.cluster["breaks"] = lambda batch: len(self.cluster["applied"]) < 2
        with self.assertRaises(locus.LocusError) as lost:
            self.connect().apply("arena", UpdateBatch(tick=1))
        self.assertFalse(lost.exception.refused)
        self.assertEqual(self.cluster["applied"], [1])

    def test_a_numbered_update_is_sent_again_and_applied_once(self):
        breaks = [True]
        self.cluster["breaks"] = lambda batch: breaks and breaks.pop()
        ack = self.connect().apply("arena", UpdateBatch(tick=1, writer=9, number=1))
        self.assertTrue(ack.duplicate)
        self.assertEqual(self.cluster["applied"], [1])

    def test_a_numbered_update_that_is_refused_after_it_was_lost_has_an_unknown_outcome(self):
        def breaks(batch):
            self.cluster["leader"] = ""
            return True
        self.cluster["breaks"] = breaks
        with self.assertRaisesRegex(locus.LocusError, "may have been applied") as lost:
            self.connect(retry=Retry(attempts=4, first_wait=0.01)).apply("arena", UpdateBatch(writer=9, number=1))
        self.assertFalse(lost.exception.refused)

    def test_connecting_needs_one_server_that_answers(self):
        self.members[0].stop()
        self.assertEqual(self.connect().address.count(","), 2)
        for member in self.members:
            member.stop()
        with self.assertRaisesRegex(locus.LocusError, "nothing answers at .*,.*,"):
            self.connect()
        with self.assertRaisesRegex(locus.LocusError, "nothing answers at"):
            self.connect(timeout=0.5, wait_for_server=True)

    def test_a_token_is_not_sent_unencrypted_to_a_server_that_another_one_names(self):
        self.cluster["leader"] = "10.0.0.9:7575"
        with self.assertRaisesRegex(locus.LocusError, "10.0.0.9:7575 .* does not connect there: without TLS"):
            self.connect(token="secret").apply("arena", UpdateBatch())

    def test_a_closed_client_says_so(self):
        client = self.connect()
        client.close()
        with self.assertRaisesRegex(locus.LocusError, "was closed"):
            client.scene("arena")


class ReadsTest(ClusterTest):
    def setUp(self):
        super().setUp()
        self.cluster["followers"] = [self.members[1].address]

    def test_reads_of_the_leader_are_marked_so(self):
        client = self.connect()
        client.query("arena", QueryBatch())
        with client.query_stream("arena") as stream:
            stream.send(QueryBatch()).result(WAIT_SECONDS)
        self.assertEqual([view.leader_only for view in self.views(0)], [True, True])
        self.assertEqual(self.views(1), [])

    def test_a_follower_answers_if_it_has_what_was_seen(self):
        client = self.connect(read_from=ReadFrom.FOLLOWER)
        client.query("arena", QueryBatch())
        client.apply("arena", UpdateBatch())
        client.query("arena", QueryBatch())
        self.assertEqual([(view.at_least, view.epoch) for view in self.views(1)], [(0, 0), (1, 1)])
        self.assertEqual(self.views(0), [])

    def test_reads_never_go_back_when_a_follower_lags(self):
        for make in (self.ask, self.ask_stream):
            with self.subTest(make.__name__):
                self.members[1].revision = None
                client = self.connect(read_from=ReadFrom.FOLLOWER)
                ask = make(client)
                client.apply("arena", UpdateBatch())
                newest = len(self.cluster["applied"])
                self.assertEqual(ask(QueryBatch()).revision, newest)
                self.members[1].revision = newest - 1
                self.assertEqual(ask(QueryBatch()).revision, newest)  # from the leader
                self.assertTrue(self.views(0)[-1].leader_only)
                self.assertEqual(ask(QueryBatch(exactly=Revision(1, 1))).revision, 1)  # the view says otherwise

    def ask(self, client):
        return lambda batch: client.query("arena", batch)

    def ask_stream(self, client):
        stream = client.query_stream("arena")
        self.addCleanup(stream.cancel)
        return lambda batch: stream.send(batch).result(WAIT_SECONDS)

    def test_a_scene_with_another_epoch_is_believed_of_the_leader_only(self):
        for make in (self.ask, self.ask_stream):
            with self.subTest(make.__name__):
                client = self.connect(read_from=ReadFrom.FOLLOWER)
                ask = make(client)
                client.apply("arena", UpdateBatch())
                self.cluster["epoch"] += 1
                self.cluster["applied"].clear()
                result = ask(QueryBatch())
                self.assertEqual((result.epoch, result.revision), (self.cluster["epoch"], 0))
                self.assertTrue(self.views(0)[-1].leader_only)
                with self.assertRaises(locus.LocusError) as refused:
                    ask(QueryBatch(at_least=Revision(self.cluster["epoch"] - 1, 0)))
                self.assertEqual(refused.exception.reason, locus.Reason.SCENE_RESTARTED)

    def test_any_server_may_answer_and_others_do_when_it_fails(self):
        client = self.connect(read_from=ReadFrom.ANY)
        for _ in range(5):
            client.query("arena", QueryBatch())
        self.assertIn((len(self.views(0)), len(self.views(1))), ((5, 0), (0, 5)))
        self.members[0 if self.views(0) else 1].stop()
        client.query("arena", QueryBatch())
        self.assertTrue(self.views(0) and self.views(1))

    def test_followers_answer_while_no_server_leads(self):
        client = self.connect(read_from=ReadFrom.FOLLOWER)
        client.query("arena", QueryBatch())
        self.cluster["leader"] = ""
        self.assertEqual(client.query("arena", QueryBatch()).revision, 0)

    def test_a_scene_without_followers_is_read_from_its_leader(self):
        self.cluster["followers"] = []
        client = self.connect(read_from=ReadFrom.FOLLOWER)
        client.query("arena", QueryBatch())
        self.assertEqual((len(self.views(0)), len(self.views(1))), (1, 0))

    def test_the_leader_is_asked_for_a_batch_that_says_so(self):
        client = self.connect(read_from=ReadFrom.FOLLOWER)
        client.query("arena", QueryBatch(leader_only=True, max_age_ms=7))
        self.assertEqual([(view.leader_only, view.max_age_ms) for view in self.views(0)], [(True, 7)])

    def test_encoded_requests_are_read_alike(self):
        client = self.connect(read_from=ReadFrom.FOLLOWER)
        client.apply("arena", UpdateBatch())
        client.query_bytes("arena", QueryBatch().request_bytes("arena"))
        client.query_bytes("arena", QueryBatch(exactly=Revision(1, 1)).request_bytes("arena"))
        self.assertEqual([(view.at_least, view.exactly) for view in self.views(1)], [(1, 0), (0, 1)])


class StreamsTest(ClusterTest):
    def test_a_stream_follows_the_leader_and_applies_each_batch_once_in_order(self):
        with self.connect().update_stream("arena") as stream:
            acks = []
            for tick in range(1, 61):
                if tick % 10 == 0:
                    self.lead(tick // 10 % 3)
                acks.append(stream.send(UpdateBatch(tick=tick)))
        self.assertEqual(self.cluster["applied"], list(range(1, 61)))
        self.assertEqual([future.result().revision for future in acks], list(range(1, 61)))

    def test_batches_that_were_sent_before_the_leader_was_lost_are_applied_once(self):
        broken = []

        def breaks(batch):
            if batch.tick in (3, 7) and batch.tick not in broken:
                broken.append(batch.tick)
                self.lead(len(broken))
                return True
            return False
        self.cluster["breaks"] = breaks
        with self.connect().update_stream("arena") as stream:
            acks = [stream.send(UpdateBatch(tick=tick)) for tick in range(1, 21)]
        self.assertEqual(self.cluster["applied"], list(range(1, 21)))
        self.assertTrue(acks[2].result().duplicate)

    def test_a_stream_waits_until_a_server_leads(self):
        client = self.connect()
        with client.update_stream("arena") as stream:
            stream.send(UpdateBatch(tick=1)).result(WAIT_SECONDS)
            self.cluster["leader"] = ""
            futures = [stream.send(UpdateBatch(tick=tick)) for tick in (2, 3)]
            time.sleep(0.3)
            self.assertFalse(any(future.done() for future in futures))
            self.lead(2)
            self.assertEqual([future.result(WAIT_SECONDS).duplicate for future in futures], [False, False])
        self.assertEqual(self.cluster["applied"], [1, 2, 3])

    def test_a_stream_that_gives_up_says_what_to_do(self):
        self.cluster["leader"] = ""
        stream = self.connect().update_stream("arena", reconnect=Retry(attempts=3, first_wait=0.01))
        error = stream.send(UpdateBatch(tick=1)).exception(WAIT_SECONDS)
        self.assertRegex(str(error), "no server leads the scene; tried at .*: check that these servers run")
        with self.assertRaises(locus.LocusError):
            stream.close()

    def test_a_batch_that_was_sent_before_the_stream_gave_up_has_an_unknown_outcome(self):
        def breaks(batch):
            self.cluster["leader"] = ""
            return True
        self.cluster["breaks"] = breaks
        stream = self.connect().update_stream("arena", reconnect=Retry(attempts=3, first_wait=0.01))
        error = stream.send(UpdateBatch(tick=1)).exception(WAIT_SECONDS)
        self.assertFalse(error.refused)
        self.assertIn("may have been applied", str(error))
        stream.cancel()

    def test_a_scene_that_was_created_anew_ends_the_stream(self):
        stream = self.connect().update_stream("arena")
        stream.send(UpdateBatch(tick=1)).result(WAIT_SECONDS)
        self.cluster["epoch"] += 1
        self.cluster["numbers"].clear()
        error = stream.send(UpdateBatch(tick=2)).exception(WAIT_SECONDS)
        self.assertEqual(error.reason, locus.Reason.BATCH_GAP)
        stream.cancel()

    def test_a_query_stream_follows_the_leader(self):
        with self.connect().query_stream("arena") as stream:
            results = []
            for index in (0, 1, 2, 1):
                self.lead(index)
                results += [stream.send(QueryBatch()) for _ in range(5)]
            self.assertEqual([future.result(WAIT_SECONDS).epoch for future in results], [1] * 20)

    def test_closing_the_client_ends_its_streams(self):
        client = self.connect()
        stream = client.update_stream("arena")
        stream.send(UpdateBatch(tick=1)).result(WAIT_SECONDS)
        client.close()
        with self.assertRaises(locus.LocusError) as ended:
            stream.send(UpdateBatch(tick=2)).result(WAIT_SECONDS)
        self.assertIn(ended.exception.code, (grpc.StatusCode.FAILED_PRECONDITION, grpc.StatusCode.CANCELLED))
        stream.cancel()
