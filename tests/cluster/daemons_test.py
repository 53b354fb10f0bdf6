"""Tests of daemons with clients and faults: one daemon alone, its history made wrong in ways that the checker must find, and a
cluster of three daemons on a replicated engine.

    LOCUS_CLUSTER_SEED=7 LOCUS_CLUSTER_SECONDS=300 python3 daemons_test.py ClusterTest
    LOCUS_CLUSTER_PLAN=plan.txt LOCUS_CLUSTER_HISTORY=history.jsonl python3 daemons_test.py ClusterTest

LOCUS_PACKAGE and LOCUS_BIN are the folders of the Python package and of locusd. Exits 77, which counts as skipped, if one of
them, PostgreSQL or an option of locusd is missing for the tests that were asked for.
"""
import copy
import os
import random
import shutil
import sys
import time
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import calls  # noqa: E402
import engine as engine_module  # noqa: E402
from checker import check  # noqa: E402
from daemon_faults import STORED_ROWS, DaemonFaults  # noqa: E402
from daemons import RUNNING, Daemons, knows_cluster  # noqa: E402
from engine import Engine  # noqa: E402
from engine_faults import EngineFaults  # noqa: E402
from fault_plan import DAEMONS, Fault, Plan, names, run  # noqa: E402
from history import FAILED, OK, READ, UNKNOWN, UPDATE, Recorder  # noqa: E402
from keeper import end_in_order  # noqa: E402
from shrink import report  # noqa: E402
from workload import MEMORY, Workload  # noqa: E402

SKIPPED = 77
SEED = int(os.environ.get("LOCUS_CLUSTER_SEED", "1"))
SECONDS = float(os.environ.get("LOCUS_CLUSTER_SECONDS", "0"))  # 0 = SHORT_PLAN
LIFE_SECONDS = 400 + 2 * SECONDS
MAX_FAULT_SECONDS = 12
ACKS = 200  # between two faults of a test
# A leader is killed, another one is frozen for longer than its lease, and the primary is lost.
SHORT_PLAN = "1 kill-leader 3 {0}\n10 freeze-leader 10 {1}\n27 kill-primary 2 {2}\n"
# A record of the first scene is damaged while another daemon takes the scene over.
DAMAGE_PLAN = "2 kill-leader 1 0\n3.5 flip-record 10 20\n"
SCENES = ["arena", "maze"]
# Columns of the tables that are damaged, without their last one: bytes.
COLUMNS = {"record": ("scene", "sequence", "epoch", "writer", "batch", "chain"),
           "snapshot_chunk": ("scene", "snapshot", "number", "checksum"), "mesh_chunk": ("content", "number", "checksum")}
LOST_RECORDS = 20
# Deletes the last records of each scene, and makes the log end before them as if they had never been written.
LOSE_RECORDS = """
WITH cut AS (UPDATE locus.scene_log log SET last = record.sequence, chain = record.chain FROM locus.record
             WHERE record.scene = log.scene AND record.sequence = log.last - %s RETURNING log.scene, log.last),
     lost AS (DELETE FROM locus.record USING cut WHERE record.scene = cut.scene AND record.sequence > cut.last RETURNING 1)
SELECT count(*) FROM lost
"""


def say(text):
    print(text, file=sys.stderr, flush=True)


def rules(history):
    return {violation.rule for violation in check(history)}


class OneDaemonTest(unittest.TestCase):
    """One daemon, without a cluster: what the clients record through its faults is correct."""

    def record(self, act, rest=ACKS, **options):
        """Runs clients before `act(daemons, workload)`, and for `rest` acks after it. Returns their history."""
        recorder = Recorder(SEED)
        with Daemons(1, life_seconds=LIFE_SECONDS, **options) as daemons:
            with Workload(daemons, dict.fromkeys(SCENES, {}), recorder) as workload:
                workload.wait_for("acks", ACKS)
                act(daemons, workload)
                workload.wait_for("acks", rest)
                workload.finish()
                daemons.check_running()
                say(workload.summary())
        return recorder.history

    @staticmethod
    def kill_freeze_and_drain(daemons, workload):
        daemon = daemons.daemons[0]
        for end in (daemons.kill, daemons.drain):
            end(daemon)
            time.sleep(0.3)
            daemons.start(daemon)
            workload.wait_for("acks", ACKS)
        daemons.freeze(daemon)
        time.sleep(4)  # longer than a call of a client may take
        daemons.thaw(daemon)

    def test_a_daemon_that_is_killed_drained_and_frozen_keeps_its_promises(self):
        history = self.record(self.kill_freeze_and_drain)
        violations = check(history)
        self.assertFalse(violations, report(history, violations))
        self.assertTrue([call for call in history.calls if call.kind == UPDATE and call.outcome == UNKNOWN], "all was answered")
        self.assertTrue([call for call in history.calls if call.duplicate], "no batch was repeated")
        self.assertTrue([call for call in history.calls if call.refused], "no item was refused")

    def test_acknowledged_updates_that_a_disk_loses_are_found(self):
        def roll_back(daemons, workload):
            daemon = daemons.daemons[0]
            daemons.kill(daemon)
            shutil.copytree(daemon.data, daemon.data + ".old")
            daemons.start(daemon)
            workload.wait_for("acks", ACKS)
            daemons.kill(daemon)
            shutil.rmtree(daemon.data)
            os.rename(daemon.data + ".old", daemon.data)
            daemons.start(daemon)
        found = rules(self.record(roll_back, rest=50))  # few, since reads wait for revisions that are lost
        self.assertIn("fresh", found)
        self.assertLessEqual({"unique", "model"}, found)

    def test_a_daemon_without_a_data_directory_is_found_by_its_new_epoch(self):
        def restart(daemons, workload):
            daemons.kill(daemons.daemons[0])
            daemons.start(daemons.daemons[0])
            workload.group.set_up(dict.fromkeys(SCENES, {}))
        self.assertIn("epoch", rules(self.record(restart, stored=False)))

    def test_answers_that_are_changed_are_found(self):
        history = self.record(lambda daemons, workload: None)
        self.assertEqual(check(history), [])
        chance = random.Random(SEED)
        for rule, change in (("dense", self.lose_update), ("model", self.change_answer), ("failed", self.refuse),
                             ("fresh", self.answer_late)):
            changed = copy.deepcopy(history)
            change(changed, chance)
            self.assertIn(rule, rules(changed))

    @staticmethod
    def shown_updates(history):
        """Returns acknowledged updates of which a read shows a position."""
        shown = {(call.scene, item, value) for call in history.calls if call.kind == READ for item, value in call.answer.items()}
        return [call for call in history.calls if call.kind == UPDATE and call.outcome == OK and not call.duplicate and
                any(value and (call.scene, item, value) in shown for item, value in call.changes.items())]

    def lose_update(self, history, chance):
        history.calls.remove(chance.choice([call for call in self.shown_updates(history) if not call.writer]))

    def refuse(self, history, chance):
        call = chance.choice([call for call in self.shown_updates(history) if not call.writer])
        call.outcome, call.epoch, call.revision, call.tick = FAILED, 0, 0, None

    @staticmethod
    def reads(history):
        return [call for call in history.calls if call.kind == READ and call.outcome == OK]

    def change_answer(self, history, chance):
        call = chance.choice(self.reads(history))
        call.answer[next(iter(call.answer))] = (-1.0, 0.0, 0.0)

    def answer_late(self, history, chance):
        call = chance.choice([call for call in self.reads(history) if call.leader_only and call.revision > 50])
        call.begin = call.end = history.calls[-1].end


class PlainDaemons(Daemons):
    """Daemons with an engine that do not know of it: each has a data directory, and one is said to lead every scene. They show
    that the faults do what they say, without a cluster.
    """

    def command(self, daemon, port_file):
        engine, self.engine = self.engine, None
        try:
            return super().command(daemon, port_file)
        finally:
            self.engine = engine

    def leader(self, _scene, _seconds=0):
        return self.daemons[1]

    def followers(self, _scene):
        return []


class FaultsTest(unittest.TestCase):
    """The faults of daemons, on daemons that are no cluster, and on rows of the tables of the engine."""

    def test_each_fault_of_daemons_can_be_made_and_is_mended_at_its_end(self):
        recorder = Recorder(SEED)
        with Engine(life_seconds=LIFE_SECONDS) as engine, PlainDaemons(3, engine) as daemons:
            faults = DaemonFaults(daemons, SCENES, recorder)
            made = {name: act for name, act in faults.actions().items() if name in names(DAEMONS)}
            for name, act in made.items():
                end = act(Fault(0, name, 1, SEED))
                self.assertTrue(self.broken(daemons, engine), f"{name} does nothing")
                end()
                daemons.check_running()
                self.assertFalse(self.broken(daemons, engine), f"{name} is not mended at its end")
            engine.wait_until_writable()
        self.assertEqual(len(recorder.history.partitions), 3)

    @staticmethod
    def broken(daemons, engine):
        """Returns what is not as at the start: daemons and nodes that do not run, and links that are not open."""
        states = daemons.keeper.command(do="states")["states"]
        return ([process for process in daemons.daemons + engine.nodes if process.state != RUNNING] +
                [name for name, state in states.items() if state != engine_module.OPEN])

    def test_stored_rows_are_damaged_and_restored(self):
        with Engine(life_seconds=LIFE_SECONDS) as engine, PlainDaemons(1, engine) as daemons:
            faults = DaemonFaults(daemons, SCENES)
            engine.ask(engine.primary, "CREATE SCHEMA locus; " + "; ".join(
                f"CREATE TABLE locus.{table} ({', '.join(f'{column} bigint' for column in columns)}, bytes bytea)"
                for table, columns in COLUMNS.items()))
            for name, (table, key, _) in STORED_ROWS.items():
                fault, act = Fault(0, name, 1, SEED), faults.actions()[name]
                engine.ask(engine.primary, f"DELETE FROM locus.{table}")
                self.assertIsNone(act(fault), "a table without rows was damaged")
                for number in (1, 2, 3):
                    values = [number if column == key[-1] else 7 for column in COLUMNS[table]]
                    engine.ask(engine.primary, f"INSERT INTO locus.{table} VALUES ({str(values)[1:-1]}, 'bytes {number}')")
                before = self.rows(engine, table)
                mend = act(fault)
                after = self.rows(engine, table)
                self.assertEqual(len(set(before) - set(after)), 1, name)
                self.assertEqual(len(set(after) - set(before)), 1 if name.startswith("flip") else 0, name)
                if name == "delete-record":
                    self.assertEqual(after[-1], before[-1], "the last record was deleted")
                mend()
                self.assertEqual(self.rows(engine, table), before, name)
        self.assertEqual(faults.hits, len(STORED_ROWS))

    @staticmethod
    def rows(engine, table):
        return sorted(tuple(bytes(value) if isinstance(value, memoryview) else value for value in row)
                      for row in engine.ask(engine.primary, f"SELECT * FROM locus.{table}"))


def plan_of_this_run():
    path = os.environ.get("LOCUS_CLUSTER_PLAN")
    if path:
        with open(path, encoding="utf-8") as file:
            return Plan.parse(file.read())
    if SECONDS:
        allowed = [name for name in names(DAEMONS) if name != "upgrade-daemon"]  # which needs a second locusd
        return Plan.make(SEED, SECONDS, allowed, MAX_FAULT_SECONDS, pause=(2, 10))
    chance = random.Random(SEED)
    plan = Plan.parse(SHORT_PLAN.format(*(chance.randrange(1 << 16) for _ in range(3))))
    plan.seed = SEED
    return plan


class ClusterTest(unittest.TestCase):
    """Three daemons on three nodes of PostgreSQL: through all faults, the answers are possible in a cluster that keeps its
    promises.
    """

    def test_a_cluster_keeps_its_promises_through_faults(self):
        self.run_plan(plan_of_this_run(), os.environ.get("LOCUS_CLUSTER_HISTORY"))

    def test_a_damaged_record_is_noticed_at_takeover_and_nothing_of_it_is_served(self):
        faults = self.run_plan(Plan.parse(DAMAGE_PLAN))
        self.assertEqual((faults.hits, faults.damaged), (1, 1))

    def run_plan(self, plan, file_name=None):
        """Runs clients through a plan, and judges their history, which can be written to a file. Returns the DaemonFaults."""
        recorder = Recorder(SEED, memory_scenes={"brawl"})
        say("\n" + str(plan))
        specs = {SCENES[0]: {"followers": 1}, SCENES[1]: {}, "brawl": MEMORY}
        with Engine(life_seconds=LIFE_SECONDS) as engine, Daemons(3, engine) as daemons:
            faults = DaemonFaults(daemons, specs, recorder)
            actions = {**EngineFaults(engine, list(daemons.addresses())).actions(), **faults.actions()}
            with Workload(daemons, specs, recorder, clustered=True) as workload:
                workload.wait_for("acks", ACKS)
                run(plan, actions, say)
                faults.repair()
                engine.wait_until_writable()
                workload.wait_for("acks", ACKS)
                workload.finish()
                daemons.check_running()
                say(f"{workload.summary()}; {longest_pauses(recorder.history, specs)}")
        if file_name:
            with open(file_name, "w", encoding="utf-8") as file:
                recorder.history.write(file)
        violations = check(recorder.history)
        self.assertFalse(violations, report(recorder.history, violations, origin=str(plan)))
        return faults

    def test_acknowledged_records_that_the_engine_loses_are_found(self):
        recorder = Recorder(SEED)
        with Engine(life_seconds=LIFE_SECONDS) as engine, Daemons(2, engine) as daemons:
            with Workload(daemons, dict.fromkeys(SCENES, {}), recorder, clustered=True) as workload:
                workload.wait_for("acks", ACKS)
                for daemon in daemons.daemons:
                    daemons.kill(daemon)
                lost = engine.ask(engine.primary, LOSE_RECORDS, LOST_RECORDS)
                self.assertEqual(lost, [(len(SCENES) * LOST_RECORDS,)])
                for daemon in daemons.daemons:
                    daemons.start(daemon)
                workload.wait_for("acks", 50)  # few, since reads wait for revisions that are lost
                workload.finish()
        self.assertLessEqual({"unique", "model"}, rules(recorder.history))


def longest_pauses(history, scenes):
    """Returns a text that says how long no update of a scene was acknowledged."""
    pauses = {}
    for scene in scenes:
        ends = sorted(call.end for call in history.calls if call.scene == scene and call.kind == UPDATE and call.outcome == OK)
        pauses[scene] = max((after - before for before, after in zip(ends, ends[1:])), default=0) / 1e9
    return "longest time without an ack: " + ", ".join(f"{scene} {seconds:.1f} s" for scene, seconds in pauses.items())


def missing(arguments):
    """Returns what the tests that are asked for need and is not there."""
    asked = " ".join(argument for argument in arguments if not argument.startswith("-")) or "all"
    return (calls.unavailable() or
            ("FaultsTest" in asked or "ClusterTest" in asked or asked == "all") and engine_module.unavailable() or
            "ClusterTest" in asked and not knows_cluster() and "this locusd has no --cluster" or "")


if __name__ == "__main__":
    if missing(sys.argv[1:]):
        print("skipped: " + missing(sys.argv[1:]))
        sys.exit(SKIPPED)
    end_in_order()
    unittest.main(verbosity=2)
