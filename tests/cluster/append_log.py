"""Log of scenes in PostgreSQL, written as a leader of a cluster writes it: each append is fenced by token and expected number,
an unknown outcome is resolved by a locking read at the next host, and a takeover raises the token.

It is what the test of the engine writes while nodes fail. Each append is recorded as an update of a history, whose revision is
the record's number, so that checker.py judges it; each takeover reads the log, which is recorded as a read.
"""
import dataclasses
import random
import threading
import time

from history import FAILED, OK, READ, UNKNOWN, UPDATE
from sql import Session, Unknown

APPEND_SECONDS = 3    # without an answer for so long, the outcome is unknown
PAUSE_SECONDS = 0.05  # between attempts to reach a host
EPOCH = 1
OBJECTS = 8
TABLES = """
CREATE TABLE scene (key text PRIMARY KEY, leader text NOT NULL, token bigint NOT NULL, last bigint NOT NULL);
CREATE TABLE record (scene text NOT NULL, sequence bigint NOT NULL, bytes text NOT NULL, PRIMARY KEY (scene, sequence));
"""
APPEND = """
WITH moved AS (UPDATE scene SET last = last + 1 WHERE key = %s AND token = %s AND last = %s RETURNING key, last)
INSERT INTO record (scene, sequence, bytes) SELECT key, last, %s FROM moved
"""
UNFENCED_APPEND = APPEND.replace(" AND token = %s", " AND token >= %s")  # a planted fault: newer tokens are ignored
LOCKED = "SELECT token, last FROM scene WHERE key = %s FOR UPDATE"
TAKE_OVER = "UPDATE scene SET leader = %s, token = token + 1 WHERE key = %s AND token = %s"
RECORDS = "SELECT sequence, bytes FROM record WHERE scene = %s ORDER BY sequence"


def create_tables(engine, scenes):
    """Makes the tables, with empty scenes."""
    engine.ask(engine.primary, TABLES + "".join(f"INSERT INTO scene VALUES ('{scene}', '', 0, 0);" for scene in scenes))


def encode(item, value):
    return f"{item}={value}"


def replay(rows):
    """Returns the objects after the records (sequence, bytes)."""
    state = {item: None for item in range(OBJECTS)}
    for _, text in rows:
        item, _, value = text.partition("=")
        state[int(item)] = value
    return state


@dataclasses.dataclass
class Lead:
    """A scene that a writer leads."""

    scene: str
    token: int
    last: int


class Writer(threading.Thread):
    """A leader: takes over scenes, now and then one of another writer, and appends to them until it is stopped. Its
    connections go through links of its own. `statement` is the one that appends.
    """

    def __init__(self, engine, name, scenes, recorder, seed, steal=0.01, statement=APPEND):
        super().__init__(name=name, daemon=True)
        self.hosts = [engine.dsn(node, name) for node in engine.nodes]
        self.scenes, self.recorder, self.random, self.steal = scenes, recorder, random.Random(seed), steal
        self.statement = statement
        self.host, self.session, self.lead, self.serial, self.appended = 0, None, None, 0, 0
        self.ended, self.error = threading.Event(), None

    def stop(self):
        """Ends the writer at its next step and waits for it. An error of the writer is raised here."""
        self.ended.set()
        self.join(timeout=60)
        if self.is_alive():
            raise RuntimeError(f"{self.name} does not end")
        if self.error:
            raise self.error

    def run(self):
        try:
            while not self.ended.is_set():
                if self.lead is None or self.random.random() < self.steal:
                    self.take_over(self.random.choice(self.scenes))
                else:
                    self.append()
        except BaseException as error:  # raised again by stop()
            self.error = error
        finally:
            if self.session:
                self.session.close()

    def transaction(self, *statements):
        """Runs a transaction at the present host; after a loss of the connection the next one is tried next time."""
        try:
            if self.session is None:
                self.session = Session(self.hosts[self.host], APPEND_SECONDS)
            return self.session.run(APPEND_SECONDS, *statements)
        except Unknown:
            self.session = None
            self.host = (self.host + 1) % len(self.hosts)
            time.sleep(PAUSE_SECONDS)
            raise

    def until_answered(self, *statements):
        """Runs a transaction at one host after the other until one answers. Returns None if the writer is stopped."""
        while not self.ended.is_set():
            try:
                return self.transaction(*statements)
            except Unknown:
                continue
        return None

    def take_over(self, scene):
        """Raises the token of a scene, then reads its log and leads it."""
        self.lead = None
        call = self.recorder.invoke(READ, scene, self.name, leader_only=True)
        try:
            token, _ = self.transaction((LOCKED, (scene,)))[0][0]
            if self.transaction((TAKE_OVER, (self.name, scene, token)))[0] == 0:
                return
            results = self.transaction((LOCKED, (scene,)), (RECORDS, (scene,)))
        except Unknown:
            self.recorder.end(call, UNKNOWN)
            return
        (now, last), rows = results[0][0], results[1]
        if now != token + 1:
            self.recorder.end(call, FAILED, error="taken over by another writer")
            return
        self.recorder.end(call, OK, epoch=EPOCH, revision=last, token=now, daemon=self.name, answer=replay(rows))
        self.lead = Lead(scene, now, last)

    def append(self):
        lead = self.lead
        self.serial += 1
        item, value = self.random.randrange(OBJECTS), f"{self.name}.{self.serial}"
        call = self.recorder.invoke(UPDATE, lead.scene, self.name, changes={item: value})
        statement = (self.statement, (lead.scene, lead.token, lead.last, encode(item, value)))
        while True:
            try:
                written = self.transaction(statement)[0] == 1
                outcome = OK if written else FAILED
            except Unknown:
                outcome = self.resolve(lead)
            if outcome is not None:
                break
        if outcome == OK:
            lead.last += 1
            self.appended += 1
            self.recorder.end(call, OK, epoch=EPOCH, revision=lead.last, token=lead.token, daemon=self.name)
        else:
            self.lead = None
            self.recorder.end(call, outcome, error="fenced")

    def resolve(self, lead):
        """Finds out whether the append after `lead.last` was written. Returns OK, None if it must be sent again, or UNKNOWN if
        another writer leads by now or the writer is stopped.

        The read locks the scene: it comes after all appends in flight, and its commit waits for a standby, so that what it
        shows cannot be lost any more.
        """
        results = self.until_answered((LOCKED, (lead.scene,)))
        token, last = results[0][0] if results else (None, None)
        if token != lead.token or last not in (lead.last, lead.last + 1):  # the latter if the engine lost records
            return UNKNOWN
        return OK if last == lead.last + 1 else None


@dataclasses.dataclass
class Comparison:
    """What the engine has of the acknowledged records."""

    acknowledged: int
    lost: list      # calls whose record is missing, or is another one
    doubled: list   # records that are there more than once
    refused: list   # records of appends that were refused


def compare(engine, recorder, scenes):
    """Compares all appends with the records of the primary, and records the state of each scene as a last read."""
    calls = recorder.history.calls
    found = {}
    for scene in scenes:
        call = recorder.invoke(READ, scene, "end", leader_only=True)
        session = Session(engine.dsn(engine.primary))
        (_, last), rows = (result if index else result[0] for index, result in enumerate(
            session.run(APPEND_SECONDS, (LOCKED, (scene,)), (RECORDS, (scene,)))))
        session.close()
        recorder.end(call, OK, epoch=EPOCH, revision=last, answer=replay(rows))
        found[scene] = dict(rows)
        if sorted(found[scene]) != list(range(1, last + 1)):
            raise AssertionError(f"the records of {scene} are not numbered from 1 to {last}")
    texts = [(scene, text) for scene, rows in found.items() for text in rows.values()]
    acks = [call for call in calls if call.kind == UPDATE and call.outcome == OK]
    bodies = {id(call): encode(*next(iter(call.changes.items()))) for call in calls if call.kind == UPDATE}
    present = set(texts)
    return Comparison(
        len(acks), [call for call in acks if found[call.scene].get(call.revision) != bodies[id(call)]],
        sorted({entry for entry in texts if texts.count(entry) > 1}) if len(present) != len(texts) else [],
        [call for call in calls if call.kind == UPDATE and call.outcome == FAILED and (call.scene, bodies[id(call)]) in present])

