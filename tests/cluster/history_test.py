"""Tests of the checker of histories: correct histories of a simulated cluster pass, each planted fault is found by its
rule, and a failing history is printed small.
"""
import io
import os
import random
import sys
import time
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from checker import RULES, Violation, check  # noqa: E402
from history import (EXACTLY, FAILED, OK, READ, TOKEN, UNKNOWN, UPDATE, Call, History, Recorder,  # noqa: E402
                     outcome_of_update)
from planted_faults import FAULTS  # noqa: E402
from shrink import report, shrink  # noqa: E402
from simulator import Simulator, simulate  # noqa: E402

SEEDS = 5  # histories of each planted fault
CALLS = 1000
MS = 1_000_000


def rules(history, hidden=frozenset()):
    return {violation.rule for violation in check(history, hidden)}


def update(begin, end, revision, changes, outcome=OK, **fields):
    return Call(UPDATE, "s", fields.pop("process", "p"), begin, end, outcome, epoch=fields.pop("epoch", 1), revision=revision,
                changes=changes, **fields)


def read(begin, end, revision, answer, **fields):
    return Call(READ, "s", fields.pop("process", "q"), begin, end, OK, epoch=fields.pop("epoch", 1), revision=revision,
                answer=answer, **fields)


class CorrectHistoryTest(unittest.TestCase):
    def test_correct_histories_pass(self):
        for seed in range(40):
            history = simulate(seed, CALLS)
            self.assertFalse(check(history), f"seed {seed}\n" + report(history, check(history)))

    def test_correct_histories_with_many_unknown_outcomes_pass(self):
        for seed in range(60):
            history = simulate(seed, 600, unknown=0.5, scenes=1, clients=4 + seed % 20)
            self.assertFalse(check(history), f"seed {seed}\n" + report(history, check(history)))

    def test_hiding_calls_of_a_correct_history_makes_no_violation(self):
        for seed in range(40):
            history = simulate(seed, 600, unknown=0.2, scenes=1)
            chance = random.Random(seed)
            hidden = {number for number in range(len(history.calls)) if chance.random() < 0.6}
            self.assertFalse(check(history, hidden), f"seed {seed}")

    def test_a_hundred_thousand_calls_are_checked(self):
        history = simulate(5, 100_000)
        start = time.perf_counter()
        self.assertFalse(check(history))
        print(f"checked {len(history.calls)} calls in {time.perf_counter() - start:.1f} s", file=sys.stderr)

    def test_a_memory_scene_may_begin_another_epoch_at_takeover(self):
        calls = [update(0, 1, 1, {7: (1.0,)}), update(2, 3, 2, {7: (2.0,)}), read(4, 5, 2, {7: (2.0,)}),
                 update(6, 7, 2, {8: (3.0,)}, epoch=2), read(8, 9, 2, {7: (1.0,), 8: (3.0,)}, epoch=2)]
        self.assertEqual(rules(History(calls)), {"epoch"})
        self.assertEqual(rules(History(calls, memory_scenes={"s"})), set())

    def test_an_unknown_update_that_was_never_applied_passes(self):
        calls = [update(0, 5, 0, {1: (9.0,)}, UNKNOWN), update(1, 2, 1, {1: (1.0,)}), read(3, 4, 1, {1: (1.0,)})]
        self.assertEqual(rules(History(calls)), set())

    def test_a_batch_that_changes_nothing_makes_no_revision(self):
        calls = [update(0, 1, 1, {1: (1.0,)}), update(2, 3, 1, {}, writer=4, batch=1),
                 update(4, 5, 2, {1: (2.0,)}, writer=4, batch=2)]
        self.assertEqual(rules(History(calls)), set())

    def test_a_duplicate_whose_ack_is_no_longer_stored_passes(self):
        calls = [update(0, 1, 1, {1: (1.0,)}, writer=4, batch=1, applied=1), update(2, 3, 2, {2: (1.0,)}),
                 update(4, 5, 2, {1: (1.0,)}, writer=4, batch=1, applied=0, duplicate=True)]
        self.assertEqual(rules(History(calls)), set())


class PlantedFaultTest(unittest.TestCase):
    def test_each_rule_has_a_planted_fault(self):
        self.assertEqual({rule for rule, _, _ in FAULTS.values()}, set(RULES))

    def test_each_planted_fault_is_found_by_its_rule_and_printed_small(self):
        for name, (rule, options, plant) in FAULTS.items():
            planted = 0
            for seed in range(SEEDS):
                run = Simulator(seed, CALLS, **options)
                history = run.run()
                if not plant(run, history):
                    continue
                planted += 1
                found = [violation for violation in check(history) if violation.rule == rule]
                self.assertTrue(found, f"{name}, seed {seed}: not found by the rule {rule}, only by {rules(history)}")
                if seed < 2:
                    self.check_shrunk(name, history, found[0])
            self.assertGreaterEqual(planted, SEEDS // 2, f"{name} found few places")

    def check_shrunk(self, name, history, violation):
        small = shrink(history, violation)
        self.assertLessEqual(len(small), 6, f"{name}, seed {history.seed}")
        hidden = set(range(len(history.calls))) - set(small)
        self.assertIn(violation.rule, rules(history, hidden), f"{name}, seed {history.seed}")
        text = report(history, [violation])
        self.assertIn(f"seed {history.seed}", text)
        self.assertIn(f"{violation.rule}: {RULES[violation.rule]}", text)
        self.assertLessEqual(len(text.split("\n")), 2 + len(small))

    def test_an_update_seen_before_a_read_that_does_not_show_it_was_lost(self):
        calls = [update(0, 5, 0, {1: (9.0,)}, UNKNOWN), update(1, 2, 2, {2: (1.0,)}), read(3, 4, 2, {1: (9.0,)}),
                 update(6, 7, 3, {2: (2.0,)}), read(8, 9, 3, {1: None})]
        self.assertEqual(rules(History(calls)), {"model"})

    def test_more_missing_revisions_than_unknown_updates_are_found(self):
        calls = [update(0, 5, 0, {1: (9.0,)}, UNKNOWN), update(1, 2, 3, {2: (1.0,)})]
        self.assertEqual(rules(History(calls)), {"dense"})

    def test_an_unknown_update_sent_later_cannot_fill_a_gap_before_an_answer(self):
        calls = [update(1, 2, 2, {2: (1.0,)}), update(3, 5, 0, {1: (9.0,)}, UNKNOWN)]
        self.assertEqual(rules(History(calls)), {"dense"})

    def test_two_seen_updates_cannot_share_one_missing_revision(self):
        calls = [update(0, 5, 0, {1: (8.0,)}, UNKNOWN), update(0, 5, 0, {2: (9.0,)}, UNKNOWN), update(1, 2, 2, {3: (1.0,)}),
                 read(3, 4, 2, {1: (8.0,), 2: (9.0,)})]
        self.assertEqual(rules(History(calls)), {"dense"})

    def test_a_token_that_the_engine_named_may_not_go_back(self):
        calls = [Call(TOKEN, "s", "watch", 0, 1, OK, "engine", token=5), Call(TOKEN, "s", "watch", 2, 3, OK, "engine", token=4)]
        self.assertEqual(rules(History(calls)), {"token"})

    def test_a_token_may_not_go_down_from_one_revision_to_the_next(self):
        calls = [update(0, 5, 1, {1: (1.0,)}, token=2, daemon="d1"), update(1, 6, 2, {1: (2.0,)}, token=1, daemon="d0")]
        self.assertEqual(rules(History(calls)), {"token"})

    def test_a_read_may_not_show_an_unknown_update_at_a_revision_before_it_was_sent(self):
        calls = [update(0, 1, 1, {1: (1.0,)}), update(2, 3, 2, {1: (2.0,)}), update(4, 9, 0, {2: (3.0,)}, UNKNOWN),
                 read(5, 6, 1, {2: (3.0,)}, view=EXACTLY, asked=1)]
        self.assertEqual(rules(History(calls)), {"committed"})

    def test_a_read_may_not_show_an_update_before_its_revision(self):
        calls = [update(0, 9, 1, {1: (1.0,)}), update(0, 9, 2, {1: (2.0,)}, writer=3, batch=1), read(1, 8, 1, {1: (2.0,)})]
        self.assertEqual(rules(History(calls)), {"model"})
        calls.append(update(0, 4, 0, {1: (2.0,)}, UNKNOWN, writer=3, batch=1))
        self.assertEqual(rules(History(calls)), {"once"})

    def test_a_huge_revision_is_reported_without_listing_all_before_it(self):
        self.assertEqual(rules(History([update(0, 1, 1 << 60, {1: (1.0,)})])), {"dense"})


class ShrinkTest(unittest.TestCase):
    def test_a_violation_whose_calls_do_not_suffice_is_searched_in_the_whole_scene(self):
        calls = [update(number * 10, number * 10 + 1, number + 1, {number: (1.0,)}) for number in range(50)]
        calls += [read(1000, 1001, 50, {7: (1.0,)}), read(1002, 1003, 50, {9: None})]
        history = History(calls)
        self.assertEqual(rules(history), {"model"})
        self.assertEqual(shrink(history, Violation("model", "", [50])), [9, 51])


class FileTest(unittest.TestCase):
    def test_a_written_history_is_read_again(self):
        history = simulate(3, 300)
        file = io.StringIO()
        history.write(file)
        file.seek(0)
        again = History.read(file)
        self.assertEqual(again.seed, 3)
        self.assertEqual(sorted(again.calls, key=repr), sorted(history.calls, key=repr))

    def test_calls_that_a_killed_process_left_open_are_unknown(self):
        file = io.StringIO()
        recorder = Recorder(seed=9, file=file)
        done = recorder.invoke(UPDATE, "s", "p", writer=1, batch=1, changes={1: (1.0, 2.0, 3.0)})
        recorder.end(done, OK, epoch=1, revision=1)
        recorder.invoke(UPDATE, "s", "p", writer=1, batch=2, changes={1: None})
        other = io.StringIO()
        Recorder(seed=9, file=other).invoke(READ, "s", "q", leader_only=True)
        again = History.read(io.StringIO(file.getvalue() + other.getvalue()))
        self.assertEqual([call.outcome for call in again.calls], [OK, UNKNOWN, UNKNOWN])
        self.assertEqual(again.calls[0], recorder.history.calls[0])
        self.assertEqual(again.calls[1].changes, {1: None})

    def test_only_errors_without_a_reason_leave_the_outcome_unknown(self):
        self.assertEqual(outcome_of_update("OK"), OK)
        self.assertEqual(outcome_of_update("UNAVAILABLE"), UNKNOWN)
        self.assertEqual(outcome_of_update("DEADLINE_EXCEEDED"), UNKNOWN)
        self.assertEqual(outcome_of_update("UNAVAILABLE", "REASON_NO_LEADER"), FAILED)
        self.assertEqual(outcome_of_update("FAILED_PRECONDITION", "REASON_ELSEWHERE"), FAILED)
        self.assertEqual(outcome_of_update("RESOURCE_EXHAUSTED"), FAILED)


if __name__ == "__main__":
    unittest.main()
