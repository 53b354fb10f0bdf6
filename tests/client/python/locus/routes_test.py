"""Tests of what a client of a cluster knows about leaders, readers, failed servers and seen revisions."""
import unittest

from locus import Follower, Placement, Revision, SceneRole
from locus.routes import ReadFrom, Routes

A, B, C, D = (f"10.0.0.{number}:7575" for number in range(1, 5))


class RoutesTest(unittest.TestCase):
    def setUp(self):
        self.now = 100.0
        self.routes = Routes([A, B, C], lambda: self.now)

    def placed(self, leader, *followers):
        return Placement(SceneRole.LEADING, leader, tuple(Follower(address, 1, 0.0) for address in followers), 1)

    def test_without_knowledge_the_first_server_that_did_not_fail_is_asked(self):
        self.assertEqual(self.routes.next("arena"), A)
        self.routes.failed(A)
        self.assertEqual(self.routes.next("arena"), B)
        self.routes.failed(B)
        self.routes.failed(C)
        self.assertEqual(self.routes.next("arena"), A)  # the one that failed first

    def test_a_named_leader_is_asked_though_it_was_not_given(self):
        self.routes.elsewhere("arena", A, ["10.0.0.4"], 5)
        self.assertEqual(self.routes.next("arena"), D)
        self.assertEqual(self.routes.next("hall"), A)
        self.assertEqual(self.routes.addresses, (A, B, C, D))

    def test_the_newer_token_wins(self):
        self.routes.elsewhere("arena", A, [B], 5)
        self.routes.elsewhere("arena", A, [C], 4)
        self.assertEqual(self.routes.next("arena"), B)
        self.routes.elsewhere("arena", A, [C], 6)
        self.assertEqual(self.routes.next("arena"), C)

    def test_an_older_token_counts_once_the_leader_failed_or_says_so(self):
        self.routes.elsewhere("arena", A, [B], 5)
        self.routes.elsewhere("arena", B, [C], 1)
        self.assertEqual(self.routes.next("arena"), C)
        self.routes.elsewhere("arena", A, [B], 5)
        self.routes.failed(B)
        self.routes.elsewhere("arena", A, [C], 1)
        self.assertEqual(self.routes.next("arena"), C)

    def test_a_leader_that_failed_or_does_not_lead_yet_is_asked_again_later(self):
        self.routes.elsewhere("arena", A, [B], 5)
        self.routes.has_no_leader("arena", B, 0.25)
        self.assertNotEqual(self.routes.next("arena"), B)
        self.now += 0.3
        self.assertEqual(self.routes.next("arena"), B)
        self.routes.failed(B)
        self.assertNotEqual(self.routes.next("arena"), B)
        self.assertFalse(self.routes.would_answer(B))
        self.now += 2
        self.assertEqual(self.routes.next("arena"), B)
        self.routes.failed(B)
        self.routes.answered(B)
        self.assertEqual(self.routes.next("arena"), B)

    def test_the_only_server_is_asked_in_any_case(self):
        routes = Routes([A], lambda: self.now)
        routes.elsewhere("arena", A, [A], 5)
        routes.failed(A)
        routes.has_no_leader("arena", A, 9)
        self.assertEqual(routes.next("arena"), A)

    def test_a_server_that_knows_no_leader_is_not_the_next_one(self):
        self.routes.has_no_leader("arena", A, 0.25)
        self.assertEqual(self.routes.next("arena"), B)

    def test_readers_are_kept_while_they_answer(self):
        self.assertIsNone(self.routes.reader("arena"))
        self.routes.set_readers("arena", self.placed(A, B, C), ReadFrom.FOLLOWER)
        chosen = self.routes.reader("arena")
        self.assertIn(chosen, (B, C))
        self.routes.failed(chosen)
        other = self.routes.reader("arena")
        self.assertEqual({chosen, other}, {B, C})
        self.routes.set_readers("arena", None, ReadFrom.FOLLOWER)  # the leader did not answer
        self.assertEqual(self.routes.reader("arena"), other)
        self.now += 60
        self.assertIsNone(self.routes.reader("arena"))

    def test_readers_are_those_that_the_user_admits(self):
        self.routes.set_readers("arena", self.placed(A), ReadFrom.FOLLOWER)
        self.assertEqual(self.routes.reader("arena"), A)
        seen = set()
        for _ in range(200):
            self.routes.forget_readers("arena")
            self.routes.set_readers("arena", self.placed(A, B), ReadFrom.ANY)
            seen.add(self.routes.reader("arena"))
        self.assertEqual(seen, {A, B})

    def test_the_highest_revision_is_kept_and_only_the_leader_changes_the_epoch(self):
        self.assertIsNone(self.routes.floor("arena"))
        for epoch, revision, from_leader, expected in ((1, 5, False, (1, 5)), (1, 3, True, (1, 5)), (2, 1, False, (1, 5)),
                                                       (2, 1, True, (2, 1)), (2, 2, False, (2, 2))):
            self.routes.saw("arena", epoch, revision, from_leader)
            self.assertEqual(self.routes.floor("arena"), Revision(*expected))
        self.routes.forget("arena")
        self.assertIsNone(self.routes.floor("arena"))

    def test_what_is_kept_is_bounded(self):
        for number in range(10_100):
            self.routes.elsewhere(f"s{number}", A, [f"10.0.{number // 250}.{number % 250}:1"], 1)
            self.routes.saw(f"s{number}", 1, 1, True)
        self.assertEqual(len(self.routes.addresses), 3 + 64)
        self.assertIsNone(self.routes.floor("s0"))
        self.assertIsNotNone(self.routes.floor("s10099"))
