"""Tests of each rule of checker.py, and of each way to break it: a small history that breaks it in this way only, and one that
looks alike and is correct. So a check that is taken out of checker.py makes one of these tests fail.
"""
import io
import os
import sys
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from checker import RULES  # noqa: E402
from history import AT_LEAST, EXACTLY, FAILED, OK, TOKEN, UNKNOWN, Call, History, Recorder  # noqa: E402
from history_test import read, rules, update  # noqa: E402

MS = 1_000_000
A, B, C = (1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (3.0, 0.0, 0.0)


def token(begin, end, value, daemon="engine"):
    return Call(TOKEN, "s", "watch", begin, end, OK, daemon, token=value)


def led(begin, end, revision, changes, value, daemon, **fields):
    return update(begin, end, revision, changes, token=value, daemon=daemon, **fields)


def lost(begin, changes, **fields):
    return update(begin, begin + 1, 0, changes, UNKNOWN, **fields)


# Each entry: the rule, what breaks it, and calls that break it and no other one.
BROKEN = [
    ("unique", "two acks name one revision", [update(0, 5, 1, {1: A}), update(0, 5, 1, {2: B})]),
    ("dense", "a revision is missing", [update(0, 1, 1, {1: A}), update(2, 3, 3, {1: B})]),
    ("dense", "the ack of a repeated batch shows revisions that nothing made", [
        lost(0, {1: A}, writer=4, batch=1), update(2, 3, 2, {1: A}, writer=4, batch=1, duplicate=True, applied=0)]),
    ("dense", "a batch without changes makes a revision though it names no tick", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {}), update(4, 5, 3, {1: B})]),
    ("dense", "a refused batch makes a revision", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {2: B}, conditional=True, applied=0, refused=1), update(4, 5, 3, {1: B})]),
    ("dense", "two updates that were seen share one missing revision", [
        lost(0, {1: A}), lost(0, {2: B}), update(2, 3, 2, {3: A}), read(4, 5, 2, {1: A, 2: B})]),
    ("dense", "an update that was seen has no missing revision", [
        lost(2, {1: A}), update(2, 5, 1, {2: A}), update(2, 5, 2, {2: B}), read(6, 7, 2, {1: A})]),
    ("committed", "a read shows a revision that no update can have made", [update(0, 1, 1, {1: A}), read(2, 3, 2, {1: A})]),
    ("committed", "a read shows an update before it was sent", [
        read(0, 1, 1, {1: A}), update(2, 3, 1, {1: A})]),
    ("committed", "an old read shows an update of unknown outcome", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B}), lost(4, {2: C}), read(5, 6, 1, {2: C}, view=EXACTLY, asked=1)]),
    ("real_time", "an update has a lower revision than one that had ended", [update(0, 1, 2, {1: A}), update(2, 3, 1, {2: B})]),
    ("epoch", "a scene with a log changes its epoch", [update(0, 1, 1, {1: A}), update(2, 3, 1, {1: B}, epoch=2)]),
    ("once", "two attempts are acknowledged as new", [
        update(0, 5, 1, {1: A}, writer=4, batch=1), update(0, 5, 1, {1: A}, writer=4, batch=1)]),
    ("once", "an update of unknown outcome is shown again after it was overwritten", [
        lost(0, {1: A}), lost(0, {2: C}), update(2, 3, 2, {2: A}), read(4, 5, 2, {1: A}), update(6, 7, 3, {1: B}),
        lost(6, {2: C}), update(8, 9, 5, {2: B}), read(10, 11, 5, {1: A})]),
    ("once", "a repeated batch is shown before its revision", [
        update(0, 9, 1, {1: A}), lost(0, {1: B}, writer=4, batch=1), update(0, 9, 2, {1: B}, writer=4, batch=1),
        read(3, 8, 1, {1: B})]),
    ("same_ack", "the second ack has another revision", [
        update(0, 1, 1, {1: A}, writer=4, batch=1), update(2, 3, 2, {2: A}),
        update(4, 5, 2, {1: A}, writer=4, batch=1, duplicate=True)]),
    ("same_ack", "the second ack has another number of refused items", [
        update(0, 1, 1, {1: A, 2: A}, writer=4, batch=1, applied=1, refused=1, refused_items=[2]),
        update(4, 5, 1, {1: A, 2: A}, writer=4, batch=1, duplicate=True, applied=0, refused=2)]),
    ("writers", "batches are applied in another order", [
        update(0, 9, 2, {1: A}, writer=4, batch=1), update(0, 9, 1, {2: A}, writer=4, batch=2)]),
    ("writers", "a batch without changes has a lower revision than the one before it", [
        update(0, 9, 1, {1: A}), update(0, 9, 2, {1: B}, writer=4, batch=1), update(0, 9, 1, {}, writer=4, batch=2)]),
    ("writers", "a batch was never sent", [
        update(0, 1, 1, {1: A}, writer=4, batch=1), update(2, 3, 2, {2: A}, writer=4, batch=3)]),
    ("failed", "a refused update appears", [
        update(0, 1, 1, {1: A}), update(2, 3, 0, {1: B}, FAILED), read(4, 5, 1, {1: B})]),
    ("failed", "a refused item appears", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B, 2: B}, conditional=True, applied=1, refused=1, refused_items=[1]),
        read(4, 5, 2, {1: B})]),
    ("model", "a read shows an old value", [update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B}), read(4, 5, 2, {1: A})]),
    ("model", "a read shows a value that nobody wrote", [update(0, 1, 1, {1: A}), read(4, 5, 1, {1: C})]),
    ("model", "a read shows a value before its revision", [
        update(0, 9, 1, {1: A}), update(0, 9, 2, {1: B}), read(1, 8, 1, {1: B})]),
    ("model", "an object is there before it was inserted", [update(0, 1, 1, {1: A}), read(4, 5, 1, {2: C})]),
    ("model", "an update of unknown outcome was seen, and then it was lost", [
        lost(0, {1: C}), update(1, 2, 2, {2: A}), read(3, 4, 2, {1: C}), update(6, 7, 3, {2: B}), read(8, 9, 3, {1: None})]),
    ("model", "a batch is acknowledged as applied before, and not shown", [
        update(0, 1, 1, {1: A}), lost(2, {1: B}, writer=4, batch=1),
        update(4, 5, 2, {1: B}, writer=4, batch=1, duplicate=True, applied=0), read(6, 7, 2, {1: A})]),
    ("model", "a batch is not shown though the next one of its writer is", [
        lost(0, {1: A}, writer=4, batch=1), update(2, 3, 2, {2: A}, writer=4, batch=2), read(4, 5, 2, {1: None})]),
    ("equal", "two reads of one revision differ", [
        lost(0, {2: A}), lost(0, {2: B}), update(0, 1, 3, {1: A}), read(2, 3, 3, {2: A}), read(2, 3, 3, {2: B})]),
    ("equal", "digests differ", [
        update(0, 1, 1, {1: A}), read(2, 3, 1, {}, question="all", digest="x"), read(2, 3, 1, {}, question="all", digest="y")]),
    ("tick", "a tick goes down", [update(0, 1, 1, {1: A}, tick=5), update(2, 3, 2, {1: B}, tick=4)]),
    ("tick", "a revision has two ticks", [update(0, 1, 1, {1: A}, tick=5), read(2, 3, 1, {1: A}, tick=6)]),
    ("fresh", "a leader does not show an update that had been acknowledged", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B}), read(4, 5, 1, {1: A}, leader_only=True, age_ms=0)]),
    ("fresh", "a leader does not show what a leader had shown", [
        update(0, 9, 1, {1: A}), read(1, 2, 1, {1: A}, leader_only=True),
        read(3, 4, 0, {1: None}, leader_only=True, process="r")]),
    ("age", "a read is older than it says", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B}), read(3 + 3 * MS, 4 + 3 * MS, 1, {1: A}, age_ms=2)]),
    ("age", "a read without an age is old", [update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B}), read(4, 5, 1, {1: A})]),
    ("max_age", "an answer is older than asked for", [update(0, 1, 1, {1: A}), read(2, 3, 1, {1: A}, age_ms=5, max_age_ms=4)]),
    ("at_least", "an answer is of an earlier revision", [
        update(0, 1, 1, {1: A}), update(2, 9, 2, {1: B}), read(4, 5, 1, {1: A}, view=AT_LEAST, asked=2)]),
    ("exactly", "an answer is of a later revision", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B}), read(4, 5, 2, {1: B}, view=EXACTLY, asked=1)]),
    ("session", "reads of one client go back", [
        update(0, 1, 1, {1: A}), update(2, 9, 2, {1: B}), read(3, 4, 2, {1: B}, age_ms=0), read(5, 6, 1, {1: A}, age_ms=1)]),
    ("session", "a client does not see what it wrote", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B}, process="q"), read(5, 6, 1, {1: A}, age_ms=1)]),
    ("token", "a daemon names an older token than before", [token(0, 1, 5, "d1"), token(2, 3, 4, "d1")]),
    ("token", "an ack has an older token than an ack before", [
        led(0, 1, 1, {1: A}, 2, "d1"), led(2, 3, 2, {1: B}, 1, "d0")]),
    ("token", "an ack has an older token than the engine had named", [token(0, 1, 2), led(2, 3, 1, {1: A}, 1, "d0")]),
    ("token", "a leader answers with an older token than another daemon had named", [
        token(0, 1, 2, "d1"), update(0, 1, 1, {1: A}), read(2, 3, 1, {1: A}, leader_only=True, token=1, daemon="d0")]),
    ("token", "two daemons lead with one token", [led(0, 9, 1, {1: A}, 1, "d0"), led(0, 9, 2, {1: B}, 1, "d1")]),
    ("token", "tokens go down from one revision to the next", [led(0, 9, 1, {1: A}, 2, "d1"), led(0, 9, 2, {1: B}, 1, "d0")]),
]
MEMORY_BROKEN = [
    ("epoch", "an old epoch is acknowledged after a newer one", [
        led(0, 1, 1, {1: A}, 1, "d0"), led(2, 3, 1, {1: B}, 2, "d1", epoch=2), led(4, 5, 2, {1: C}, 1, "d0", process="r")]),
    ("epoch", "an old epoch is read after a newer one was acknowledged", [
        update(0, 1, 1, {1: A}), update(2, 3, 1, {1: B}, epoch=2), read(4, 5, 1, {1: A})]),
    ("dense", "a revision of a later epoch is missing", [
        update(0, 1, 1, {1: A}), read(2, 3, 0, {1: None}, epoch=2), update(4, 5, 2, {1: B}, epoch=2)]),
    ("epoch", "a client reads an old epoch after a newer one", [
        led(0, 1, 1, {1: A}, 1, "d0"), led(2, 9, 1, {1: B}, 2, "d1", epoch=2),
        read(3, 4, 1, {1: B}, epoch=2), read(5, 6, 1, {1: A})]),
    ("epoch", "a daemon answers in an old epoch after a newer one", [
        led(0, 1, 1, {1: A}, 1, "d0"), led(2, 9, 1, {1: B}, 2, "d1", epoch=2),
        read(3, 4, 1, {1: B}, epoch=2, daemon="d2"), read(5, 6, 1, {1: A}, process="r", daemon="d2")]),
]


class RuleTest(unittest.TestCase):
    def test_each_broken_rule_is_reported_and_no_other_one(self):
        for rule, what, calls in BROKEN:
            with self.subTest(rule=rule, what=what):
                self.assertEqual(rules(History(calls)), {rule})

    def test_each_broken_rule_of_scenes_without_a_log_is_reported(self):
        for rule, what, calls in MEMORY_BROKEN:
            with self.subTest(rule=rule, what=what):
                self.assertIn(rule, rules(History(calls, memory_scenes={"s"})))
                self.assertLessEqual(rules(History(calls, memory_scenes={"s"})), {rule, "token"})

    def test_each_rule_has_such_a_history(self):
        self.assertEqual({rule for rule, _, _ in BROKEN}, set(RULES))


# Histories that are correct, though a hasty checker refuses them.
CORRECT = [
    ("the first attempt is not answered and the second is a repeated batch", [
        update(0, 1, 1, {2: A}), lost(2, {1: A}, writer=4, batch=1), update(4, 5, 3, {2: B}),
        update(6, 7, 2, {1: A}, writer=4, batch=1, duplicate=True, applied=1), read(8, 9, 3, {1: A, 2: B})]),
    ("the ack of a repeated batch is no longer there, and its first attempt was not answered", [
        update(0, 1, 1, {2: A}), lost(2, {1: A}, writer=4, batch=1), update(4, 5, 3, {2: B}),
        update(6, 7, 3, {1: A}, writer=4, batch=1, duplicate=True, applied=0), read(8, 9, 3, {1: A, 2: B})]),
    ("a repeated batch without a stored ack was applied after the last update that was answered", [
        update(0, 1, 1, {2: A}), lost(2, {1: A}, writer=4, batch=1),
        update(6, 7, 2, {1: A}, writer=4, batch=1, duplicate=True, applied=0)]),
    ("the attempt that is answered as repeated was sent before the one that is answered as new", [
        update(0, 9, 2, {1: A}, writer=4, batch=1, duplicate=True, applied=0),
        update(1, 2, 1, {1: A}, writer=4, batch=1, applied=1), update(3, 4, 2, {2: A}), read(10, 11, 2, {1: A, 2: A})]),
    ("items of a batch are refused, and the ack names them", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B, 2: B}, conditional=True, applied=1, refused=1, refused_items=[2]),
        read(4, 5, 2, {1: B, 2: None})]),
    ("items of a batch are refused, and the history does not name them", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B, 2: B}, conditional=True, applied=1, refused=1),
        read(4, 5, 2, {1: A, 2: B})]),
    ("all items of a batch are refused", [
        update(0, 1, 1, {1: A}), update(2, 3, 1, {2: B}, conditional=True, applied=0, refused=1), update(4, 5, 2, {1: B}),
        read(6, 7, 2, {1: B, 2: None})]),
    ("a numbered batch of unknown outcome was refused item by item", [
        update(0, 1, 1, {1: A}), lost(2, {2: B}, conditional=True, writer=4, batch=1),
        update(4, 5, 2, {1: B}, writer=4, batch=2), read(6, 7, 2, {1: B, 2: None})]),
    ("items of an update of unknown outcome were refused, and others appear", [
        update(0, 1, 1, {1: A}), lost(2, {1: B, 2: B}, conditional=True), read(4, 5, 2, {1: B, 2: None})]),
    ("a batch without changes names a tick and makes a revision", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {}, asked_tick=9), update(4, 5, 3, {1: B})]),
    ("a batch without changes names a tick of before", [
        update(0, 1, 1, {1: A}), update(2, 3, 1, {}, asked_tick=9), update(4, 5, 2, {1: B})]),
    ("a batch without changes, of unknown outcome, made a revision by its tick", [
        update(0, 1, 1, {1: A}), lost(2, {}, asked_tick=9), update(4, 5, 3, {1: B})]),
    ("a batch without changes of unknown outcome makes no revision and no gap of its writer", [
        update(0, 1, 1, {1: A}, writer=4, batch=1), lost(2, {}, writer=4, batch=2), update(4, 5, 2, {1: B}, writer=4, batch=3)]),
    ("a deposed leader tells of a batch that had been applied before", [
        led(0, 1, 1, {1: A}, 1, "d0", writer=4, batch=1), token(2, 3, 2),
        led(4, 5, 1, {1: A}, 1, "d0", writer=4, batch=1, duplicate=True)]),
    ("a deposed leader answers batches that change nothing", [
        led(0, 1, 1, {1: A}, 1, "d0"), token(2, 3, 2), led(4, 5, 1, {}, 1, "d0"),
        led(4, 5, 1, {2: B}, 1, "d0", conditional=True, applied=0, refused=1)]),
    ("an update was acknowledged while a takeover was seen", [token(0, 2, 2), led(1, 3, 1, {1: A}, 1, "d0")]),
    ("an old answer says so", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B}), read(3 + 3 * MS, 4 + 3 * MS, 1, {1: A}, age_ms=4)]),
    ("answers are as asked for", [
        update(0, 1, 1, {1: A}, tick=3), update(2, 3, 2, {1: B}, tick=3), update(4, 5, 3, {1: C}, tick=4),
        read(6, 7, 3, {1: C}, view=AT_LEAST, asked=2, tick=4), read(6, 7, 3, {1: C}, age_ms=4, max_age_ms=4)]),
    ("a follower names the token of before", [
        led(0, 1, 1, {1: A}, 1, "d0"), led(2, 3, 2, {1: B}, 2, "d1"), read(4, 5, 2, {1: B}, token=1, daemon="d2")]),
    ("a batch that was refused is sent again", [
        update(0, 1, 1, {2: A}), update(2, 3, 0, {1: A}, FAILED, writer=4, batch=1), update(4, 5, 2, {1: A}, writer=4, batch=1),
        read(6, 7, 2, {1: A, 2: A})]),
    ("a batch is sent again after an attempt of unknown outcome, and refused", [
        lost(0, {1: A}, writer=4, batch=1), update(2, 3, 0, {1: A}, FAILED, writer=4, batch=1),
        update(4, 5, 2, {2: A}), read(6, 7, 2, {1: A, 2: A})]),
    ("reads that are not of one session go back", [
        update(0, 1, 1, {1: A}), update(2, 9, 2, {1: B}), read(3, 4, 2, {1: B}, age_ms=0),
        read(5, 6, 1, {1: A}, age_ms=1, session=False)]),
    ("an update of unknown outcome is hidden by a later one", [
        lost(0, {1: A}), update(2, 3, 2, {1: B}), read(4, 5, 2, {1: B})]),
    ("an old revision that was asked for needs no age", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B}), read(4, 5, 1, {1: A}, view=EXACTLY, asked=1)]),
]
MEMORY_CORRECT = [
    ("a takeover begins another epoch", [
        led(0, 1, 1, {1: A}, 1, "d0"), led(2, 3, 1, {1: B}, 2, "d1", epoch=2), read(4, 5, 1, {1: B}, epoch=2)]),
    ("an update that is answered late by the new epoch was sent before one of the old epoch", [
        update(0, 1, 1, {1: A}), update(2, 30, 1, {1: B}, epoch=2), update(8, 9, 2, {1: C}), update(31, 32, 2, {1: A}, epoch=2)]),
    ("a new epoch begins without objects, at revision 0", [
        update(0, 1, 1, {1: A}), read(2, 3, 0, {1: None}, epoch=2), update(4, 5, 1, {1: B}, epoch=2)]),
    ("the two epochs name no tokens", [
        update(0, 1, 1, {1: A}), update(2, 3, 2, {1: B}), update(4, 5, 1, {1: B}, epoch=2), update(6, 7, 2, {1: C}, epoch=2)]),
    ("a client asks for the old epoch by its revision", [
        update(0, 1, 1, {1: A}), update(2, 3, 1, {1: B}, epoch=2), read(4, 5, 1, {1: A}, view=EXACTLY, asked=1)]),
    ("a follower reads the old epoch and says its age", [
        led(0, 1, 1, {1: A}, 1, "d0"), led(2, 3, 1, {1: B}, 2, "d1", epoch=2),
        read(3 + 3 * MS, 4 + 3 * MS, 1, {1: A}, age_ms=4)]),
]
PARTITION = [led(0, 1, 1, {1: A}, 1, "d0"), led(2, 3, 1, {1: B}, 2, "d1", epoch=2), led(4, 5, 2, {1: C}, 1, "d0", process="r")]


class AcceptTest(unittest.TestCase):
    def test_correct_histories_are_accepted(self):
        for what, calls in CORRECT:
            with self.subTest(what=what):
                self.assertEqual(rules(History(calls)), set())

    def test_correct_histories_of_scenes_without_a_log_are_accepted(self):
        for what, calls in MEMORY_CORRECT:
            with self.subTest(what=what):
                self.assertEqual(rules(History(calls, memory_scenes={"s"})), set())

    def test_a_partition_lets_two_daemons_lead_a_scene_without_a_log_but_no_other_scene(self):
        self.assertEqual(rules(History(PARTITION, memory_scenes={"s"}, partitions=[(4, 6)])), set())
        self.assertEqual(rules(History(PARTITION, memory_scenes={"s"}, partitions=[(6, 9)])), {"epoch", "token"})
        same_client = [*PARTITION[:2], led(4, 5, 2, {1: C}, 1, "d0")]
        self.assertEqual(rules(History(same_client, memory_scenes={"s"}, partitions=[(4, 6)])), set())
        self.assertEqual(rules(History(PARTITION, partitions=[(0, 9)])), {"epoch", "token"})

    def test_partitions_are_written_and_read_again(self):
        file = io.StringIO()
        recorder = Recorder(seed=3, memory_scenes={"s"}, file=file)
        recorder.partition(4, 6)
        self.assertEqual(History.read(io.StringIO(file.getvalue())).partitions, [(4, 6)])
        again = io.StringIO()
        recorder.history.write(again)
        self.assertEqual(History.read(io.StringIO(again.getvalue())).partitions, [(4, 6)])


if __name__ == "__main__":
    unittest.main()
