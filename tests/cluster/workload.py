"""Clients for tests of daemons: threads that update and read scenes through faults, and record each call in a history.

A client sends updates to the daemon that it takes for the scene's leader. It follows REASON_ELSEWHERE to the address with the
newest token, and after every other failure tries another daemon. Numbered batches are sent again until they are acknowledged
or refused for good. Each update writes positions that no other one writes.
"""
import contextlib
import random
import threading
import time

import calls
from calls import Caller, double_column, has_field, id_column, ids_of, points_of, request_of
from history import AT_LEAST, EXACTLY, FAILED, LATEST, OK, READ, TOKEN, UNKNOWN, UPDATE, outcome_of_update

OBJECTS = list(range(1, 25))
INSTANCES = [1001, 1002, 1003]
MESH = "tetrahedron"
VERTICES = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
TRIANGLES = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]
SETUP_SECONDS = 60
READ_SECONDS = 2
PAUSE_SECONDS = 0.002     # between the calls of a client
RETRY_SECONDS = (0.02, 1)  # least and greatest pause after a failure
AGAIN = 0.03              # share of the acknowledged batches that are sent once more, as if the ack had been lost
HASTY = 0.04              # share of the updates whose deadline is so short that their outcome is often unknown
HASTY_SECONDS = 0.003
RECENT = 10               # revisions before the newest one that a client asks for by `exactly`
SERIALS = 1_000_000       # updates of a client; times the clients they are exact as floats
MEMORY = {"durability": 1}  # SceneSpec of a scene without a log


class Group:
    """What the clients of a test share: the daemons, by name, and the recorder."""

    def __init__(self, daemons, recorder, clustered):
        self.addresses, self.names = daemons.addresses(), daemons.names()
        self.recorder, self.clustered = recorder, clustered
        self.stopped = threading.Event()

    def set_up(self, scenes):
        """Uploads a mesh, and creates scenes: names with fields of their SceneSpec. Where the daemons serve no followers, scenes
        have none.
        """
        with contextlib.closing(Caller(self.addresses)) as caller:
            self.until_done(self.upload)
            for scene, spec in scenes.items():
                self.until_done(lambda name, scene=scene, spec=spec: self.create(caller, name, scene, spec))

    @staticmethod
    def create(caller, daemon, scene, spec):
        answer = caller.call(daemon, "Scene", "CreateScene", seconds=10, name=scene, if_absent=True, spec=spec)
        if answer.reason == "REASON_NOT_SERVED" and "followers" in spec:
            rest = {name: value for name, value in spec.items() if name != "followers"}
            return Group.create(caller, daemon, scene, rest)
        return "" if answer.answered else answer.error

    def upload(self, name):
        try:
            with calls.locus.connect(self.addresses[name]) as client:
                client.upload_mesh(MESH, VERTICES, TRIANGLES)
        except calls.locus.LocusError as error:
            return str(error)
        return ""

    def until_done(self, act):
        """Calls `act` with one daemon after the other until it returns no error."""
        until = time.monotonic() + SETUP_SECONDS
        while True:
            for name in self.addresses:
                problem = act(name)
                if not problem:
                    return
            if time.monotonic() > until:
                raise AssertionError(f"the daemons cannot be set up: {problem}")
            time.sleep(0.1)


class Batch:
    """A batch of updates, as a request and as it is recorded."""

    def __init__(self, scene):
        self.request = request_of("Update", "ApplyUpdates", scene=scene)
        self.batch = self.request.batch
        self.changes, self.conditional = {}, False

    def asked(self):
        values = {"writer": self.batch.writer, "batch": self.batch.batch, "changes": self.changes,
                  "conditional": self.conditional}
        return {**values, "asked_tick": self.batch.tick} if self.batch.HasField("tick") else values

    def insert(self, items):
        """Inserts objects, or replaces them: this is never refused."""
        entry = self.batch.inserts.add(ids=id_column(list(items)), positions_f64=double_column(items.values()))
        entry.ball.radii = calls.struct.pack("<f", 0.5)
        self.batch.upsert = True
        self.changes.update(items)

    def move(self, items):
        """Moves objects; those that are not there are refused."""
        self.batch.moves.add(ids=id_column(list(items)), positions_f64=double_column(items.values()))
        self.changes.update(items)
        self.conditional = True

    def remove(self, items):
        """Removes objects; those that are not there are refused."""
        self.batch.remove_ids += id_column(items)
        self.changes.update(dict.fromkeys(items))
        self.conditional = True


class Client(threading.Thread):
    """One client. It runs until the group is stopped; an error of its own is raised by stop()."""

    def __init__(self, number, group, scene, seed):
        super().__init__(name=f"c{number}", daemon=True)
        self.group, self.scene, self.recorder = group, scene, group.recorder
        self.random = random.Random(f"{seed} {number}")
        self.caller = Caller(group.addresses)
        self.first_serial, self.serial = number * SERIALS, 0
        self.leaders, self.tokens = {}, {}   # scene -> name of the daemon, and newest token
        self.seen = {}                       # scene -> (epoch, highest revision)
        self.sessions = 1                    # reads go back only from one to the next
        self.writers = {}                    # scene -> (writer, number of its last batch)
        self.counts = dict.fromkeys(("acks", "reads", "unknown", "refused", "repeats", "gaps"), 0)
        self.start_time = time.monotonic()
        self.error = None

    def run(self):
        try:
            while not self.group.stopped.is_set():
                self.act(self.scene)
                time.sleep(PAUSE_SECONDS)
        except BaseException as error:  # raised again by stop()
            self.error = error
        finally:
            self.caller.close()

    @property
    def session(self):
        return f"{self.name}.{self.sessions}"

    def act(self, scene):
        draw = self.random.random()
        if draw < 0.4:
            self.update_numbered(scene)
        elif draw < 0.48:
            self.update_once(scene, self.make_batch(scene))
        elif draw < 0.52:
            self.change_instances(scene)
        elif draw < 0.54 and self.group.clustered:
            self.ask_token(scene)
        else:
            self.read(scene)

    # Where to send calls.

    def target(self, scene):
        """Returns the name of the daemon that leads a scene, as far as this client knows, or of any one."""
        return self.leaders.get(scene) or self.random.choice(list(self.group.addresses))

    def learn(self, scene, name, answer, begin):
        """Draws conclusions from a failed call, and pauses."""
        pause = max(RETRY_SECONDS[0], answer.retry_after)
        if answer.reason == "REASON_ELSEWHERE" and answer.addresses:
            self.note_token(scene, name, answer.token, begin)
            if answer.token >= self.tokens.get(scene, 0):
                self.tokens[scene] = answer.token
                self.leaders[scene] = self.group.names[answer.addresses[0]]
                pause = 0 if self.leaders[scene] != name else pause
        else:
            self.leaders.pop(scene, None)
        time.sleep(min(pause, RETRY_SECONDS[1]))

    def note_token(self, scene, name, token, begin):
        if token:
            call = self.recorder.invoke(TOKEN, scene, self.session, begin)
            self.recorder.end(call, OK, daemon=name, token=token)

    def ask_token(self, scene):
        name, begin = self.random.choice(list(self.group.addresses)), time.monotonic_ns()
        answer = self.caller.call(name, "Scene", "GetScene", name=scene)
        if answer.response is not None and has_field(answer.response.scene, "placement"):
            self.note_token(scene, name, answer.response.scene.placement.token, begin)

    # Updates.

    def value(self, item):
        """Returns a position that no other update writes."""
        return (float(self.first_serial + self.serial), float(item), 0.5)

    def make_batch(self, scene):
        self.serial += 1
        batch, draw = Batch(scene), self.random.random()
        items = self.random.sample(OBJECTS, self.random.choice((1, 1, 2, 4)))
        if draw < 0.6:
            batch.insert({item: self.value(item) for item in items})
        elif draw < 0.95:
            first, rest = items[:1], items[1:]
            if self.random.random() < 0.3:
                batch.remove(first)
            else:
                batch.move({item: self.value(item) for item in first})
            if rest:
                batch.insert({item: self.value(item) for item in rest})
        if self.random.random() < 0.3:
            batch.batch.tick = int((time.monotonic() - self.start_time) * 10)
        return batch

    def update_numbered(self, scene):
        """Sends the next batch of this client's writer until it is answered for good."""
        writer, last = self.writers.get(scene) or (self.random.randrange(1, 1 << 62), 0)
        batch = self.make_batch(scene)
        batch.batch.writer, batch.batch.batch = writer, last + 1
        attempts = 0
        while not self.group.stopped.is_set():
            attempts += 1
            answer = self.update_once(scene, batch)
            if answer.answered:
                self.writers[scene] = (writer, last + 1)
                self.counts["repeats"] += attempts > 1
                if self.random.random() < AGAIN:
                    self.update_once(scene, batch)
                return
            if answer.reason == "REASON_BATCH_GAP":  # a scene without a log forgot the writer
                self.counts["gaps"] += 1
                self.writers.pop(scene, None)
                return
            if answer.code == "INVALID_ARGUMENT":
                raise AssertionError(f"a batch is refused: {answer.error}")

    def update_once(self, scene, batch):
        def decode(response):
            ack = response.ack
            self.see(scene, ack.epoch, ack.revision)
            return {"epoch": ack.epoch, "revision": ack.revision, "tick": ack.tick, "applied": ack.applied,
                    "refused": ack.refused, "refused_items": sorted({error.id for error in ack.errors}),
                    "duplicate": ack.duplicate}
        return self.update(scene, batch.asked(), "Update", "ApplyUpdates", batch.request, decode)

    def change_instances(self, scene):
        """Replaces an instance, or places it if it is not there, by a change without a number."""
        self.serial += 1
        item = self.random.choice(INSTANCES)
        value = self.value(item)

        def decode(response):
            self.see(scene, response.epoch, response.revision)
            return {"epoch": response.epoch, "revision": response.revision}
        for remove in ([item], []):
            request = request_of("Scene", "ChangeInstances", scene=scene, remove_ids=id_column(remove))
            request.place.add(mesh=MESH, ids=id_column([item]), translations=double_column([value]))
            answer = self.update(scene, {"changes": {item: value}}, "Scene", "ChangeInstances", request, decode)
            if answer.reason != "REASON_UNKNOWN_ID":
                return

    def update(self, scene, asked, service, rpc, request, decode):
        """Sends an update once, and records the attempt."""
        name = self.target(scene)
        call = self.recorder.invoke(UPDATE, scene, self.session, **asked)
        hasty = self.random.random() < HASTY
        answer = self.caller.send(name, service, rpc, request, HASTY_SECONDS if hasty else calls.CALL_SECONDS)
        if answer.answered:
            self.leaders[scene] = name
            self.counts["acks"] += 1
            self.recorder.end(call, OK, daemon=name, **decode(answer.response))
            return answer
        outcome = FAILED if answer.unsent else outcome_of_update(answer.code, answer.reason)
        self.counts["unknown" if outcome == UNKNOWN else "refused"] += 1
        self.recorder.end(call, outcome, daemon=name, error=answer.error)
        self.learn(scene, name, answer, call.begin)
        return answer

    # Reads.

    def see(self, scene, epoch, revision):
        known = self.seen.get(scene, (epoch, 0))
        self.seen[scene] = (epoch, max(revision, known[1]) if known[0] == epoch else revision)

    def read(self, scene, items=None):
        """Reads some objects in one of four ways."""
        draw, (epoch, highest) = self.random.random(), self.seen.get(scene, (0, 0))
        asked = {"view": LATEST, "session": False}
        if draw < 0.35:
            asked = {"leader_only": True}
        elif draw < 0.45 and highest > 0:
            asked = {"view": EXACTLY, "asked": self.random.randint(max(1, highest - RECENT), highest)}
        elif draw < 0.85:
            asked = {"view": AT_LEAST, "asked": highest}
        return self.ask(scene, items or self.random.sample(OBJECTS + INSTANCES, 8), epoch, **asked)

    def ask(self, scene, items, epoch=0, **asked):
        """Sends a read once, and records it. Returns whether it was answered."""
        request = request_of("Query", "Query", scene=scene)
        request.batch.blocks.add().lookup.ids = id_column(items)
        view = request.batch.view
        view.epoch = epoch
        if asked.get("view") == AT_LEAST:
            view.at_least = asked["asked"]
        elif asked.get("view") == EXACTLY:
            view.exactly = asked["asked"]
        leader_only = asked.get("leader_only", False)
        if leader_only and has_field(view, "leader_only"):
            view.leader_only = True
        name = self.target(scene) if leader_only else self.random.choice(list(self.group.addresses))
        call = self.recorder.invoke(READ, scene, self.session, **asked)
        answer = self.caller.send(name, "Query", "Query", request, READ_SECONDS)
        if not answer.answered:
            self.recorder.end(call, FAILED, daemon=name, error=answer.error)
            if answer.reason == "REASON_SCENE_RESTARTED":  # a client starts over with the scene
                self.seen.pop(scene, None)
                self.sessions += 1
            if answer.code != "OUT_OF_RANGE":
                self.learn(scene, name, answer, call.begin)
            return False
        result = answer.response.result
        block = result.blocks[0]
        found = zip(items, ids_of(block.ids), points_of(block.positions))
        age = {"age_ms": result.age_ms} if self.group.clustered and has_field(result, "age_ms") else {}
        self.counts["reads"] += 1
        if asked.get("view") != EXACTLY:
            self.see(scene, result.epoch, result.revision)
        self.recorder.end(call, OK, daemon=name, epoch=result.epoch, revision=result.revision, tick=result.tick,
                          answer={item: point if there else None for item, there, point in found}, **age)
        return True


class Workload:
    """Clients of one test: a context manager that runs them. At its end they are stopped. `scenes` are names with fields of their
    SceneSpec. Each client has one scene, so that a scene without a leader does not keep it from others.
    """

    def __init__(self, daemons, scenes, recorder, clients=6, clustered=False):
        self.group, self.scenes = Group(daemons, recorder, clustered), list(scenes)
        self.group.set_up(scenes)
        seed = recorder.history.seed
        self.clients = [Client(number, self.group, self.scenes[number % len(scenes)], seed) for number in range(clients)]
        self.last = Client(clients, self.group, self.scenes[0], seed)  # reads all at the end, in the calling thread

    def __enter__(self):
        for client in self.clients:
            client.start()
        return self

    def __exit__(self, *_):
        self.group.stopped.set()
        for client in self.clients:
            client.join(timeout=60)
        self.last.caller.close()

    def count(self, name):
        return sum(client.counts[name] for client in self.clients)

    def check(self):
        """Raises the error of a client that has ended by one."""
        for client in self.clients:
            if client.error:
                raise client.error

    def wait_for(self, name, more, seconds=60):
        """Waits until the clients have counted so many more calls of a kind, for example acks."""
        goal, until = self.count(name) + more, time.monotonic() + seconds
        while self.count(name) < goal:
            self.check()
            if time.monotonic() > until:
                raise AssertionError(f"the clients count {self.count(name)} {name}, and not {goal} within {seconds} s")
            time.sleep(0.01)

    def finish(self, seconds=60):
        """Stops the clients and reads all objects of each scene from its leader. Raises an error of a client."""
        self.group.stopped.set()
        for client in self.clients:
            client.join(timeout=60)
            if client.is_alive():
                raise AssertionError(f"{client.name} does not end")
        self.check()
        until = time.monotonic() + seconds
        for scene in self.scenes:
            while not self.last.ask(scene, OBJECTS + INSTANCES, leader_only=True):
                if time.monotonic() > until:
                    raise AssertionError(f"nobody answers for {scene}")

    def summary(self):
        return ", ".join(f"{self.count(name)} {name}" for name in self.clients[0].counts)


