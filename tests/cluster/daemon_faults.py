"""Faults of daemons: the actions of the faults of fault_plan.py that need locusd, or write access to the tables of the engine.

Not here are the faults that need hooks in a daemon, since locusd has none, and `upgrade-daemon` if there is no second locusd with
another apply_version.
"""
import random
import time

from engine import CUT, HUNG, OPEN
from engine_faults import AWAKE_SECONDS, DETECTION_SECONDS
from fault_plan import DAEMONS, ENGINE, names

SPLIT_SECONDS = 10  # after a daemon was cut off or frozen it may lead a scene without a log for so long on
STATEMENT_SECONDS = 5
# Tables whose rows are damaged: name, columns of the key, further condition. The row is chosen by its rank.
STORED_ROWS = {
    "flip-record": ("record", ("scene", "sequence"), "true"),
    "flip-chunk": ("snapshot_chunk", ("scene", "snapshot", "number"), "true"),
    "flip-mesh": ("mesh_chunk", ("content", "number"), "true"),
    "delete-record": ("record", ("scene", "sequence"),
                      "sequence < (SELECT max(sequence) FROM locus.record other WHERE other.scene = record.scene)"),
}


class DaemonFaults:
    """Actions on Daemons that are a cluster on an engine. `scenes` are those whose leaders and followers are hit. With
    `recorder`, times in which a scene without a log may be led twice are recorded. `upgraded` is the path of another locusd.
    """

    def __init__(self, daemons, scenes, recorder=None, upgraded=""):
        self.daemons, self.scenes, self.recorder, self.upgraded = daemons, list(scenes), recorder, upgraded
        self.engine = daemons.engine if daemons else None
        self.hits = 0     # faults of STORED that found a row
        self.damaged = 0  # daemons that noticed one of those, and were started again

    def actions(self):
        """Returns the actions for fault_plan.run(), by the name of the fault."""
        found = {name: getattr(self, name.replace("-", "_")) for name in names(DAEMONS) if name not in names(ENGINE)}
        found.update({name: getattr(self, name.replace("-", "_")) for name in STORED_ROWS})
        if not self.upgraded:
            del found["upgrade-daemon"]
        return found

    def scene(self, fault):
        return fault.among(self.scenes)

    def leader(self, fault):
        return self.daemons.leader(self.scene(fault))

    def follower(self, fault):
        """Returns a daemon that follows the scene, or any other than its leader if nobody follows it."""
        leader = self.leader(fault)
        others = self.daemons.followers(self.scene(fault)) or self.daemons.running()
        return fault.among([daemon for daemon in others if daemon is not leader])

    def split(self, begin):
        """Records the time since `begin` as one in which a scene without a log may be led twice."""
        if self.recorder:
            self.recorder.partition(begin, time.monotonic_ns() + int(SPLIT_SECONDS * 1e9))

    # Processes.

    def kill_leader(self, fault):
        return self.down(self.leader(fault))

    def kill_follower(self, fault):
        return self.down(self.follower(fault))

    def down(self, daemon):
        self.daemons.kill(daemon)
        return lambda: self.daemons.start(daemon)

    def kill_leader_and_primary(self, fault):
        daemon = self.leader(fault)
        self.daemons.kill(daemon)
        self.engine.kill(self.engine.primary)
        time.sleep(DETECTION_SECONDS)
        self.engine.fail_over()

        def end():
            self.engine.repair()
            self.daemons.start(daemon)
        return end

    def freeze_leader(self, fault):
        daemon, begin = self.leader(fault), time.monotonic_ns()
        self.daemons.freeze(daemon)

        def wake():
            self.daemons.thaw(daemon)
            self.split(begin)
        return wake

    def drain_daemon(self, fault):
        daemon = fault.among(self.daemons.running())
        self.daemons.drain(daemon)
        return lambda: self.daemons.start(daemon)

    def upgrade_daemon(self, fault):
        daemon = fault.among(self.daemons.running())
        self.daemons.drain(daemon)

        def start():
            program, self.daemons.program = self.daemons.program, self.upgraded
            try:
                self.daemons.start(daemon)
            finally:
                self.daemons.program = program
        return start

    # Links.

    def cut_leader(self, fault):
        daemon, begin = self.leader(fault), time.monotonic_ns()
        self.daemons.cut_from_engine(daemon, HUNG if fault.choice % 2 else CUT)

        def heal():
            self.daemons.cut_from_engine(daemon, OPEN)
            self.split(begin)
        return heal

    def leave_leader_with_old_primary(self, fault):
        daemon, begin, old = self.leader(fault), time.monotonic_ns(), self.engine.primary
        self.engine.isolate(old)
        self.engine.set_links(HUNG, sources=[other.name for other in self.daemons.daemons if other is not daemon], nodes=[old])
        self.engine.set_links(OPEN, sources=[daemon.name], nodes=[old])
        time.sleep(DETECTION_SECONDS)
        self.engine.fail_over()

        def heal():
            self.engine.heal()
            time.sleep(AWAKE_SECONDS)
            self.engine.repair()
            self.split(begin)
        return heal

    def cut_followers(self, fault):
        daemon = self.leader(fault)
        self.daemons.cut_from_peers(daemon, HUNG if fault.choice % 2 else CUT)
        return lambda: self.daemons.cut_from_peers(daemon, OPEN)

    # Stored rows.

    def flip_record(self, fault):
        return self.flip(fault)

    def flip_chunk(self, fault):
        return self.flip(fault)

    def flip_mesh(self, fault):
        return self.flip(fault)

    def choose_row(self, fault, columns):
        """Returns (table, condition for the row, values of its key, values of `columns`), or None if the table is empty."""
        table, key, condition = STORED_ROWS[fault.name]
        count = self.ask(f"SELECT count(*) FROM locus.{table} WHERE {condition}")[0][0]
        rows = self.ask(f"SELECT {', '.join((*key, *columns))} FROM locus.{table} WHERE {condition} ORDER BY {', '.join(key)} "
                        "OFFSET %s LIMIT 1", fault.choice % count) if count else []
        if not rows:  # the table is empty, or was pruned meanwhile
            return None
        self.hits += 1
        values = rows[0][:len(key)]
        return table, " AND ".join(f"{name} = %s" for name in key), values, rows[0][len(key):]

    def ask(self, text, *arguments):
        return self.engine.ask(self.engine.primary, text, *arguments, seconds=STATEMENT_SECONDS)

    def flip(self, fault):
        """Flips one bit of a stored value; at the end it is flipped back, if it is still there."""
        row = self.choose_row(fault, ["length(bytes)"])
        if not row or not row[3][0]:
            return None
        table, condition, key, (length,) = row
        position = random.Random(fault.choice).randrange(length)

        def act():
            self.ask(f"UPDATE locus.{table} SET bytes = set_byte(bytes, {position}, get_byte(bytes, {position}) # 1) "
                     f"WHERE {condition}", *key)
        act()
        return self.restored(act)

    def restored(self, restore):
        """Returns a function that restores a row, and then starts the daemons again that took over a scene while it was damaged,
        as an operator does: they serve it no more.
        """
        def end():
            restore()
            for daemon in self.daemons.running():
                if any(self.daemons.is_damaged(daemon, scene) for scene in self.scenes):
                    self.damaged += 1
                    self.daemons.drain(daemon)
                    self.daemons.start(daemon)
        return end

    def delete_record(self, fault):
        columns = ("epoch", "writer", "batch", "chain", "bytes")
        row = self.choose_row(fault, columns)
        if not row:
            return None
        table, condition, key, values = row
        self.ask(f"DELETE FROM locus.{table} WHERE {condition}", *key)
        names_of_columns = (*STORED_ROWS[fault.name][1], *columns)
        marks = ", ".join(["%s"] * len(names_of_columns))
        return self.restored(lambda: self.ask(
            f"INSERT INTO locus.{table} ({', '.join(names_of_columns)}) VALUES ({marks})", *key, *values))

    # The end.

    def repair(self):
        """Opens all links, and makes all nodes and daemons run."""
        self.engine.repair()
        self.daemons.repair()
