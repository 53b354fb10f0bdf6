"""Tests of the engine for tests: through faults from a seed no acknowledged record is lost or doubled; without a quorum, or
without synchronous commit, the same test loses records; and whatever ends the test, nothing of it is left.

    LOCUS_CLUSTER_SEED=7 LOCUS_CLUSTER_SECONDS=300 python3 engine_test.py
    LOCUS_CLUSTER_PLAN=plan.txt LOCUS_CLUSTER_HISTORY=history.jsonl python3 engine_test.py FaultPlanOnEngineTest

LOCUS_CLUSTER_HISTORY names a file for the whole history; shrink.py judges it again.
Exits 77, which counts as skipped, if PostgreSQL or psycopg2 is missing.
"""
import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)

import append_log  # noqa: E402
from append_log import Writer, compare  # noqa: E402
from checker import check  # noqa: E402
from engine import CUT, HUNG, Engine, EngineError, unavailable  # noqa: E402
from engine_faults import EngineFaults  # noqa: E402
from fault_plan import ENGINE, Plan, names, run  # noqa: E402
from history import Recorder  # noqa: E402
from keeper import end_in_order, started_at  # noqa: E402
from shrink import report  # noqa: E402
from sql import Session, Unknown  # noqa: E402

SKIPPED = 77
SEED = int(os.environ.get("LOCUS_CLUSTER_SEED", "1"))
SECONDS = float(os.environ.get("LOCUS_CLUSTER_SECONDS", "30"))
LIFE_SECONDS = 240 + 2 * SECONDS
MAX_FAULT_SECONDS = 3  # keeps the run short; longer plans are given by LOCUS_CLUSTER_PLAN
SCENES = ["arena", "lobby", "maze"]
WRITERS = ["w0", "w1", "w2"]


def plan_of_this_run():
    path = os.environ.get("LOCUS_CLUSTER_PLAN")
    if path:
        with open(path, encoding="utf-8") as file:
            return Plan.parse(file.read())
    return Plan.make(SEED, SECONDS, names(ENGINE), MAX_FAULT_SECONDS, pause=(0.1, 0.3))


def say(text):
    print(text, file=sys.stderr, flush=True)


def start_writers(engine, recorder, **options):
    append_log.create_tables(engine, SCENES)
    writers = [Writer(engine, name, SCENES, recorder, f"{recorder.history.seed} {name}", **options) for name in WRITERS]
    for writer in writers:
        writer.start()
    return writers


def wait_for_appends(writers, count):
    """Waits until the writers have appended `count` more records."""
    goal = sum(writer.appended for writer in writers) + count
    until = time.monotonic() + 30
    while sum(writer.appended for writer in writers) < goal:
        if time.monotonic() > until:
            raise AssertionError("the writers do not get on")
        time.sleep(0.01)


class FaultPlanOnEngineTest(unittest.TestCase):
    def test_no_acknowledged_record_is_lost_or_doubled_by_faults_of_the_engine(self):
        plan, recorder = plan_of_this_run(), Recorder(SEED)
        say("\n" + str(plan))
        with Engine(life_seconds=LIFE_SECONDS) as engine:
            writers = start_writers(engine, recorder)
            run(plan, EngineFaults(engine, WRITERS).actions(), say)
            engine.repair()
            engine.wait_until_writable()
            wait_for_appends(writers, 30)
            for writer in writers:
                writer.stop()
            result = compare(engine, recorder, SCENES)
        say(f"{result.acknowledged} records acknowledged, {len(recorder.history.calls)} calls")
        if os.environ.get("LOCUS_CLUSTER_HISTORY"):
            with open(os.environ["LOCUS_CLUSTER_HISTORY"], "w", encoding="utf-8") as file:
                recorder.history.write(file)
        violations = check(recorder.history)
        self.assertFalse(violations, report(recorder.history, violations, origin=str(plan)))
        self.assertEqual((result.lost, result.doubled, result.refused), ([], [], []), str(plan))
        self.assertGreater(result.acknowledged, 100, str(plan))


class FenceTest(unittest.TestCase):
    def fight(self, **options):
        """Lets writers take over each other's scenes all the time. Returns the violations of their history."""
        recorder = Recorder(SEED)
        with Engine(life_seconds=LIFE_SECONDS) as engine:
            writers = start_writers(engine, recorder, steal=0.2, **options)
            wait_for_appends(writers, 200)
            for writer in writers:
                writer.stop()
        return check(recorder.history)

    def test_writers_that_take_over_from_each_other_break_no_rule(self):
        self.assertEqual(self.fight(), [])

    def test_writers_that_ignore_newer_tokens_are_found(self):
        self.assertIn("token", {violation.rule for violation in self.fight(statement=append_log.UNFENCED_APPEND)})


class LosingEngineTest(unittest.TestCase):
    """The primary's log stops to reach the standbys, and then the primary is lost with its disk."""

    def lose_primary(self, **options):
        recorder = Recorder(SEED)
        with Engine(life_seconds=LIFE_SECONDS, **options) as engine:
            writers = start_writers(engine, recorder, steal=0)
            wait_for_appends(writers, 30)
            engine.wait_until_replicated()
            engine.set_links(HUNG, sources=[node.name for node in engine.standbys()], nodes=[engine.primary])
            time.sleep(1)
            old = engine.primary
            engine.kill(old)
            engine.wipe(old)
            engine.fail_over()
            engine.heal()
            engine.rejoin(old)
            for writer in writers:
                writer.stop()
            result = compare(engine, recorder, SCENES)
        return result, recorder.history

    def test_a_lost_primary_loses_nothing_with_a_quorum(self):
        result, history = self.lose_primary()
        self.assertEqual((result.lost, result.doubled, check(history)), ([], [], []))

    def test_a_lost_primary_loses_records_without_a_quorum(self):
        result, history = self.lose_primary(quorum=False)
        self.assertTrue(result.lost)
        self.assertTrue(check(history), "the checker of histories does not see the loss")

    def test_a_lost_primary_loses_records_without_synchronous_commit(self):
        result, history = self.lose_primary(settings={"synchronous_commit": "off"})
        self.assertTrue(result.lost)
        self.assertTrue(check(history), "the checker of histories does not see the loss")


class EngineTest(unittest.TestCase):
    def test_a_restarted_primary_shows_a_plain_read_a_commit_that_can_still_be_lost_but_no_locking_read(self):
        with Engine(life_seconds=LIFE_SECONDS) as engine:
            append_log.create_tables(engine, ["arena"])
            engine.wait_until_replicated()
            engine.set_links(HUNG, sources=["n1", "n2"])
            session = Session(engine.dsn(engine.primary))
            with self.assertRaises(Unknown):
                session.run(1, (append_log.APPEND, ("arena", 0, 0, "1=a")))
            old = engine.primary
            engine.kill(old)
            engine.start(old)
            self.assertEqual(engine.ask(old, "SELECT last FROM scene"), [(1,)])
            with self.assertRaises(Unknown):
                Session(engine.dsn(old)).run(1, (append_log.LOCKED, ("arena",)))
            engine.kill(old)
            engine.wipe(old)
            engine.fail_over()
            self.assertEqual(engine.ask(engine.primary, "SELECT last FROM scene"), [(0,)])

    def test_an_old_primary_without_standbys_takes_connections_and_never_commits(self):
        with Engine(life_seconds=LIFE_SECONDS) as engine:
            append_log.create_tables(engine, ["arena"])
            old = engine.primary
            engine.set_links(CUT, sources=["n1", "n2"], nodes=[old])
            new = engine.fail_over()
            append = (append_log.APPEND, ("arena", 0, 0, "1=a"))
            with self.assertRaises(Unknown):
                Session(engine.dsn(old, "client")).run(2, append)
            self.assertEqual(Session(engine.dsn(new, "client")).run(10, append), [1])

    def test_without_standbys_nothing_is_committed_and_the_old_primary_is_copied_anew_after_it_was_wiped(self):
        with Engine(life_seconds=LIFE_SECONDS) as engine:
            engine.set_links(HUNG, sources=["n1", "n2"])
            with self.assertRaises(EngineError):
                engine.wait_until_writable(2)
            engine.heal()
            engine.wait_until_writable()
            old = engine.primary
            engine.kill(old)
            engine.wipe(old)
            self.assertIn(engine.fail_over(), [node for node in engine.nodes if node is not old])
            self.assertEqual(engine.rejoin(old), "copied")
            engine.wait_until_replicated()

    def test_an_old_primary_whose_log_went_its_own_way_is_rewound(self):
        with Engine(life_seconds=LIFE_SECONDS, quorum=False) as engine:
            old = engine.primary
            engine.set_links(HUNG, sources=["n1", "n2"])
            engine.ask(old, "CREATE TABLE only_here (x int)")
            engine.kill(old)
            engine.fail_over()
            engine.heal()
            self.assertEqual(engine.rejoin(old), "rewound")
            engine.wait_until_replicated()
            self.assertEqual(engine.ask(old, "SELECT to_regclass('only_here')"), [(None,)])


# A test that starts an engine, says what it started, and then waits.
CHILD = f"""
import sys, time
sys.path.insert(0, {HERE!r})
from engine import Engine
from keeper import end_in_order, family
end_in_order()
with Engine(life_seconds=float(sys.argv[1])) as engine:
    print(engine.folder, *(pid for node in engine.nodes for pid in family(node.process.pid)), flush=True)
    if sys.argv[2] == "life":
        engine.keeper.set_life(1)
    if sys.argv[2] == "frozen":
        engine.freeze(engine.primary)
    if sys.argv[2] in ("frozen", "raise"):
        raise RuntimeError("a test failed")
    time.sleep(120)
"""


class EndTest(unittest.TestCase):
    def end(self, how):
        """Starts a test with an engine and ends it in some way. Nothing of it may be left soon after."""
        child = subprocess.Popen([sys.executable, "-B", "-c", CHILD, str(LIFE_SECONDS), how], stdout=subprocess.PIPE, text=True,
                                 stderr=subprocess.DEVNULL)
        with child.stdout:
            line = child.stdout.readline()
            started = {pid: started_at(pid) for pid in line.split()[1:]}
            if how.startswith("SIG"):
                child.send_signal(getattr(signal, how))
            if how != "life":
                child.wait(timeout=60)
            self.wait_until_gone(how, line, started)
            child.kill()
            child.wait()

    def wait_until_gone(self, how, line, started):
        """Waits until the folder and the processes of a CHILD that printed `line` are gone. `started` are the processes."""
        folder, *pids = line.split()
        self.assertGreater(len(pids), 3)
        until = time.monotonic() + 60
        while os.path.exists(folder) or any(start is not None and started_at(pid) == start for pid, start in started.items()):
            self.assertLess(time.monotonic(), until, f"after {how} something is left: {line}")
            time.sleep(0.05)

    def test_nothing_is_left_after_an_exception(self):
        self.end("raise")

    def test_nothing_is_left_after_an_exception_while_a_node_is_frozen(self):
        self.end("frozen")

    def test_nothing_is_left_after_sigterm(self):
        self.end("SIGTERM")

    def test_nothing_is_left_after_sigkill(self):
        self.end("SIGKILL")

    def test_nothing_is_left_when_its_life_is_over(self):
        self.end("life")

    @unittest.skipUnless(shutil.which("ctest"), "ctest is missing")
    def test_nothing_is_left_after_a_timeout_of_ctest(self):
        with tempfile.TemporaryDirectory() as folder:
            told = os.path.join(folder, "told")
            with open(os.path.join(folder, "child.py"), "w", encoding="utf-8") as file:
                file.write(CHILD.replace("import sys, time", f"import sys, time\nsys.stdout = open({told!r}, 'w')"))
            with open(os.path.join(folder, "CTestTestfile.cmake"), "w", encoding="utf-8") as file:
                file.write(f"add_test(child {sys.executable} -B {folder}/child.py {LIFE_SECONDS} ctest)\n"
                           f"set_tests_properties(child PROPERTIES TIMEOUT {self.seconds_to_start() + 3})\n")
            result = subprocess.run(["ctest"], cwd=folder, stdout=subprocess.PIPE, text=True, timeout=300, check=False)
            self.assertIn("Timeout", result.stdout)
            with open(told, encoding="utf-8") as file:
                line = file.read()
            self.wait_until_gone("a timeout of ctest", line, {pid: started_at(pid) for pid in line.split()[1:]})

    @staticmethod
    def seconds_to_start():
        """Returns how long an engine takes to start here, rounded up."""
        start = time.monotonic()
        Engine(life_seconds=LIFE_SECONDS).close()
        return math.ceil(time.monotonic() - start)


if __name__ == "__main__":
    if unavailable():
        print("skipped: " + unavailable())
        sys.exit(SKIPPED)
    end_in_order()
    unittest.main(verbosity=2)
