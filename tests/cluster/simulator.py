"""Simulated cluster with its clients, which makes correct histories from a seed: a leader, followers that lag, takeovers,
updates of unknown outcome (also such that are applied long after their caller gave up), batches that are sent again, also
after the ack was dropped, batches of which items are refused, and batches that change nothing but perhaps the tick.

Time is simulated. Every update and every read takes effect at one moment between its begin and its end; the moments are
drawn in advance and run in their order, so that the log of committed updates is the truth that all answers come from.
"""
import bisect
import heapq
import math
import random

from history import AT_LEAST, EXACTLY, FAILED, LATEST, NEVER, OK, READ, UNKNOWN, UPDATE, Call, History

MS = 1_000_000
OBJECTS = 40
EPOCH = 77
RECENT = 50  # revisions that a daemon can still answer by `exactly`


def tick_of(revision):
    """Returns the tick of a revision: several batches of a tick follow one another."""
    return revision // 3


class Scene:
    """The log of a scene: what is committed, when, and by which leader."""

    def __init__(self, name, daemons):
        self.name, self.leader, self.token = name, daemons[0], 1
        self.commits = [0]                                    # time of each revision
        self.numbers, self.values = {}, {}                    # object -> its revisions, and its positions
        self.writers = {}                                     # (writer, batch) -> (revision, applied, refused items)
        self.applied_by_follower = {daemon: (0, 0) for daemon in daemons}  # (revision, time up to which it knows all)

    @property
    def revision(self):
        return len(self.commits) - 1

    def commit(self, now, changes):
        self.commits.append(now)
        for item, value in changes.items():
            self.numbers.setdefault(item, []).append(self.revision)
            self.values.setdefault(item, []).append(value)

    def at(self, item, revision):
        index = bisect.bisect_right(self.numbers.get(item, ()), revision)
        return self.values[item][index - 1] if index else None

    def follow(self, daemon, now, lag, least):
        """Lets a follower catch up to what was committed `lag` ago, and at least to the revision `least`. Returns its
        revision, and how long ago it knew that it had all.
        """
        if daemon == self.leader:
            self.applied_by_follower[daemon] = (self.revision, now)
            return self.revision, 0
        revision, known = self.applied_by_follower[daemon]
        caught_up = bisect.bisect_right(self.commits, now - lag) - 1
        revision, known = max(revision, caught_up, least), max(known, now - lag, self.commits[least])
        self.applied_by_follower[daemon] = (revision, known)
        return revision, now - known


class Simulator:
    """One run. `unknown` and `failed` are shares of the updates; `odd` is the share of those that move objects that may be
    gone, and of those without changes.
    """

    def __init__(self, seed, calls, scenes=3, clients=12, unknown=0.05, failed=0.06, takeovers=8, odd=0.06):
        self.random, self.seed, self.target = random.Random(seed), seed, calls
        self.daemons = ["d0", "d1", "d2"]
        self.scenes = [Scene(f"scene{number}", self.daemons) for number in range(scenes)]
        self.clients = clients
        self.unknown, self.failed, self.takeovers, self.odd = unknown, failed, takeovers, odd
        self.calls, self.events, self.order, self.serial = [], [], 0, 0
        self.batches = {}        # client -> number of its last batch
        self.seen = {}           # (client, scene) -> highest revision

    def at(self, time, action, *arguments):
        self.order += 1
        heapq.heappush(self.events, (time, self.order, action, arguments))

    def run(self):
        for client in range(self.clients):
            self.at(self.random.randrange(MS), self.act, client)
        for number in range(self.takeovers):
            self.at(int(self.target * MS / self.clients * (number + 0.5) / max(1, self.takeovers)), self.take_over)
        while self.events:
            time, _, action, arguments = heapq.heappop(self.events)
            action(time, *arguments)
        return History(self.calls, self.seed)

    def take_over(self, _now):
        scene = self.random.choice(self.scenes)
        scene.leader = self.random.choice([daemon for daemon in self.daemons if daemon != scene.leader])
        scene.token += 1

    def act(self, now, client):
        """Begins the next call of a client; it ends with another act()."""
        if len(self.calls) >= self.target:
            return
        scene = self.random.choice(self.scenes)
        if self.random.random() < 0.5:
            self.begin_update(now, client, scene)
        else:
            self.begin_read(now, client, scene)

    def duration(self):
        return int(self.random.expovariate(1 / (0.4 * MS))) + 1000

    def record(self, call):
        self.calls.append(call)
        return call

    def begin_update(self, now, client, scene):
        self.serial += 1
        items = self.random.sample(range(1, OBJECTS + 1), self.random.choice((1, 1, 2, 4)))
        changes = {item: (float(self.serial), float(item), 0.5) for item in items}
        if self.random.random() < 0.05:
            changes[items[0]] = None
        asked = {"changes": changes}
        draw = self.random.random()
        if draw < self.odd:
            asked["conditional"] = True
        elif draw < 2 * self.odd:
            asked["changes"], asked["asked_tick"] = {}, self.random.choice((None, 7))
        numbered = self.random.random() < 0.7
        key = (client, scene.name)
        if numbered:
            self.batches[key] = self.batches.get(key, 0) + 1
        writer = 1 + client * len(self.scenes) + self.scenes.index(scene) if numbered else 0
        self.attempt(now, client, scene, asked, writer, self.batches[key] if numbered else 0)

    def attempt(self, now, client, scene, asked, writer, batch):
        call = self.record(Call(UPDATE, scene.name, f"p{client}", now, writer=writer, batch=batch, **asked))
        end = now + self.duration()
        draw = self.random.random()
        if draw < self.failed and not writer:
            call.outcome, call.end, call.error = FAILED, end, "UNAVAILABLE REASON_NO_LEADER"
            self.at(end + self.duration(), self.act, client)
        elif draw < self.failed + self.unknown:
            # Applied before the caller gives up, long after, or never.
            call.end, call.error = (end, "UNAVAILABLE") if self.random.random() < 0.8 else (NEVER, "")
            fate = self.random.random()
            if fate < 0.7:
                moment = self.random.randrange(now, end) if fate < 0.4 else end + self.random.randrange(20 * MS)
                self.at(moment, self.apply, scene, call)
            if writer:  # a client library sends it again until it has an answer
                self.at(end + self.duration(), self.attempt, client, scene, asked, writer, batch)
            else:
                self.at(end + self.duration(), self.act, client)
        else:
            self.at(self.random.randrange(now, end), self.acknowledge, client, scene, call, end)

    def apply(self, now, scene, call):
        """Applies an update, unless it was applied before. Returns (revision, number of applied items, refused items, whether it
        is a duplicate).
        """
        key = (call.writer, call.batch)
        if call.writer and key in scene.writers:
            dropped = self.random.random() < 0.3
            return (scene.revision, 0, [], True) if dropped else (*scene.writers[key], True)
        refused = [item for item in call.changes if call.conditional and scene.at(item, scene.revision) is None]
        changes = {item: value for item, value in call.changes.items() if item not in refused}
        if changes or call.asked_tick is not None and self.random.random() < 0.5:
            scene.commit(now, changes)
        result = (scene.revision, len(changes), refused)
        if call.writer:
            scene.writers[key] = result
        return *result, False

    def acknowledge(self, now, client, scene, call, end):
        call.revision, call.applied, refused, call.duplicate = self.apply(now, scene, call)
        call.refused, call.refused_items = len(refused), [item for item in refused if self.random.random() < 0.8]
        call.epoch, call.daemon, call.token, call.tick = EPOCH, scene.leader, scene.token, tick_of(call.revision)
        call.outcome, call.end = OK, end
        key = (client, scene.name)
        self.seen[key] = max(self.seen.get(key, 0), call.revision)
        self.at(end + self.duration(), self.act, client)

    def begin_read(self, now, client, scene):
        call = self.record(Call(READ, scene.name, f"p{client}", now))
        draw = self.random.random()
        if draw < 0.35:
            call.leader_only = True
        elif draw < 0.45:
            call.view = EXACTLY
        else:
            call.view = AT_LEAST if draw < 0.9 else LATEST
            call.asked = self.seen.get((client, scene.name), 0) if call.view == AT_LEAST else 0
            call.session = call.view == AT_LEAST
        end = now + self.duration()
        self.at(self.random.randrange(now, end), self.answer, client, scene, call, end)

    def answer(self, now, client, scene, call, end):
        daemon = scene.leader if call.leader_only else self.random.choice(self.daemons)
        lag = self.random.randrange(5 * MS)
        revision, age = scene.follow(daemon, now, lag, call.asked if call.view == AT_LEAST else 0)
        if call.view == EXACTLY:
            revision = self.random.randint(max(0, revision - RECENT), revision)
            call.asked = revision
        call.age_ms = math.ceil(age / MS) + self.random.choice((0, 0, 3)) if daemon != scene.leader else 0
        call.outcome, call.end, call.daemon, call.epoch, call.revision = OK, end, daemon, EPOCH, revision
        call.token, call.tick = scene.token if call.leader_only else None, tick_of(revision)
        for item in self.random.sample(range(1, OBJECTS + 1), 6):
            call.answer[item] = scene.at(item, revision)
        key = (client, scene.name)
        self.seen[key] = max(self.seen.get(key, 0), revision)
        self.at(end + self.duration(), self.act, client)


def simulate(seed, calls, **options):
    """Returns a correct history of about so many calls."""
    return Simulator(seed, calls, **options).run()
