"""Runner of one row: starts the daemon and the victim, attacks, waits, and measures the effects."""
import collections
import multiprocessing
import os
import time

import protobuf
import victim
import wire
from daemon import Daemon, OtherDaemon
from edge import EdgedDaemon
from job import MAX_SHIELDED_SLOWER, MAX_SLOWER, SHIELDED, STRANGER, Job, work

IDLE_SECONDS = {True: 0.3, False: 1.0}
RETURN_SECONDS = 10.0
RETURN_SHARE = 1.3
SERVED_SECONDS = 20.0
QUIET_SECONDS = 90.0  # time without a message from an attack after which the attack counts as stuck
SPARE_DESCRIPTORS = 8
LOOK_SECONDS = 0.05
MAX_DEATHS = 20
WORLD_OBJECTS = 20000
MIN_SLOW_MS = 50.0  # a p99 below this may be caused by the machine rather than by the daemon
MIN_ANSWERED = 0.5  # share of the victim's calls that must be answered during the attack

Options = collections.namedtuple("Options", "program limit front seconds quick address pid authority",
                                 defaults=(None, None, None))


class Row:
    """Measurements of one attack. Sizes are in bytes. `served` is whether the victim still got answers after the
    attack.
    """

    def __init__(self, attack, limit, front="plain"):
        self.attack, self.limit = attack, limit
        shielded = front in SHIELDED and attack.slower == MAX_SLOWER
        self.max_slower = MAX_SHIELDED_SLOWER if shielded else attack.slower
        self.codes, self.wrong, self.skipped, self.deaths = collections.Counter(), [], [], []
        self.before = self.peak = self.after = self.threads = 0
        self.descriptors = self.most_descriptors = self.descriptors_after = 0
        self.steps = 0
        self.kind, self.served, self.stuck = "nobody here", True, False
        # `began` has (name, time) of each step; `worst` is the step in which the victim waited longest.
        self.began, self.worst = [], ""
        self.idle, self.during = {}, {}
        self.load = os.getloadavg()[0]

    def kept_allowed(self):
        """Returns the number of bytes by which the daemon's memory may be larger after the attack, because the
        allocator retains some memory.
        """
        return max(64 << 20, self.limit // 3)

    def returned(self):
        return self.after <= self.before + self.kept_allowed() and \
            self.descriptors_after <= self.descriptors + SPARE_DESCRIPTORS

    def slower(self):
        """Returns the factor by which the victim's p99 grew."""
        return self.during.get("p99_ms", 0) / max(self.idle.get("p99_ms", 0), 1.0)

    def slower_connections(self):
        """Returns the factor by which the p99 of the victim's new connections grew. The time of a connection includes
        its first call.
        """
        return self.during.get("connect_p99_ms", 0) / max(self.idle.get("connect_p99_ms", 0), 1.0)

    def answered(self):
        """Returns how many of the victim's calls during the attack were answered, and how many calls there were."""
        calls = self.during.get("calls", 0)
        return calls - sum(self.during.get("errors", {}).values()), calls

    def failures(self, quick):
        """Returns the failures of the row, each in a few words. Checks durations only if the run is not quick."""
        found = [f"{how} in {step}" if step else how for step, how in self.deaths]
        if not self.served:
            found.append("the victim is not served afterwards")
        answered, calls = self.answered()
        if not self.deaths and answered < max(1, MIN_ANSWERED * calls):
            found.append(f"only {answered} of the victim's {calls} calls were answered")
        if self.stuck:
            found.append("the attack did not end")
        if not self.deaths and self.after > self.before + self.kept_allowed():
            found.append(f"holds {(self.after - self.before) >> 20} MiB more than before")
        if not self.deaths and self.descriptors_after > self.descriptors + SPARE_DESCRIPTORS:
            found.append(f"holds {self.descriptors_after - self.descriptors} descriptors more than before")
        if not quick and self.slower() > self.max_slower and self.during["p99_ms"] > MIN_SLOW_MS:
            found.append(f"slow: p99 {self.slower():.0f} times as long, at most {self.max_slower} are allowed; "
                         f"longest in {self.worst or 'the only step'}")
        if not quick and self.slower_connections() > self.max_slower and self.during["connect_p99_ms"] > MIN_SLOW_MS:
            found.append(f"slow: p99 of new connections {self.slower_connections():.0f} times as long, at most "
                         f"{self.max_slower} are allowed")
        return found + self.wrong


def start(options, flags=()):
    """Returns a daemon with the scenes that the victim and the attacks use. `flags` are options for a daemon that is
    started here; a daemon that already runs is used as it is.
    """
    if options.address:
        daemon = OtherDaemon(options.address, options.pid, options.authority)
    elif options.front == "edge":
        daemon = EdgedDaemon(options.program, options.limit, flags)
    elif options.front == STRANGER:
        daemon = Daemon(options.program, options.limit, "mtls", flags)
        daemon.attacker = daemon.attacker._replace(context=daemon.front.stranger)
    else:
        daemon = Daemon(options.program, options.limit, options.front, flags)
    try:
        replies = [victim.prepare(daemon.target)]
        with wire.Connection(daemon.target, window=1 << 20) as connection:
            replies.append(connection.call("/locus.v1.SceneService/CreateScene", protobuf.create_scene(b"world")))
            replies.append(connection.call("/locus.v1.UpdateService/ApplyUpdates",
                                           protobuf.apply(b"world", protobuf.insert_balls(1, WORLD_OBJECTS))))
        for reply in replies:
            if reply.code != "OK":
                raise RuntimeError(f"no scene to attack: {reply.code} {reply.text}")
        return daemon
    except BaseException:
        daemon.stop()
        raise


class Assault:
    """The process of an attack: stores the reports of the attack in a Row, and watches the daemon."""

    def __init__(self, row, daemon, options, first):
        context = multiprocessing.get_context("fork")
        self.row, self.daemon, self.options = row, daemon, options
        self.pipe, inner = context.Pipe(duplex=False)
        job = Job(daemon.attacker, options.seconds, options.quick, inner, options.front)
        self.process = context.Process(target=work, args=(row.attack, job, first))
        self.process.start()
        inner.close()
        self.at, self.name, self.ended = first, "", False

    def take(self, event):
        kind = event[0]
        if kind == "step":
            self.at, self.name = event[1], event[2]
            self.row.began.append((self.name, time.monotonic()))
        elif kind == "codes":
            self.row.codes[event[1]] += event[2]
        elif kind == "wrong":
            self.row.wrong.append(event[1])
        elif kind == "skip":
            self.row.skipped.append(event[1])
        elif kind == "steps":
            self.row.steps = event[1]
        elif kind == "end":
            self.ended = True

    def listen(self):
        """Reads the pending reports of the attack. Returns whether there were any. If the pipe has ended, the attack
        has ended.
        """
        heard = False
        try:
            while self.pipe.poll(0 if heard else LOOK_SECONDS):
                self.take(self.pipe.recv())
                heard = True
        except EOFError:
            self.ended = True
        return heard

    def watch(self):
        """Watches the attack and the daemon until one of them has ended. Returns whether the daemon still runs."""
        heard = time.monotonic()
        while not self.ended and self.daemon.alive():
            if self.listen():
                heard = time.monotonic()
            sample(self.row, self.daemon)
            if time.monotonic() - heard > QUIET_SECONDS + self.options.seconds:
                self.row.stuck = True
                break
        self.end()
        return self.daemon.alive()

    def end(self):
        """Ends the attacking process."""
        self.process.join(1.0 if self.ended else 0.5)
        if self.process.is_alive():
            self.process.terminate()
            self.process.join(5)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        while not self.ended and self.listen():
            pass


def sample(row, daemon):
    row.peak = max(row.peak, daemon.resident())
    row.most_descriptors = max(row.most_descriptors, daemon.descriptors())
    row.threads = max(row.threads, daemon.threads())


def worst_step(began, samples):
    """Returns the step that ran in the middle of the slowest call of the victim."""
    slowest = max(samples, key=lambda sample: sample.seconds, default=None)
    names = [name for name, at in began if slowest and at <= slowest.at - slowest.seconds / 2]
    return names[-1] if names else ""


def settle(row, daemon, quick):
    """Waits until the daemon has returned descriptors and memory, but at most RETURN_SECONDS. If the run is not quick,
    also waits until memory has shrunk to RETURN_SHARE times the memory before the attack. Returns whether the daemon
    still runs.
    """
    until = time.monotonic() + RETURN_SECONDS
    while daemon.alive():
        sample(row, daemon)
        row.after, row.descriptors_after = daemon.resident(), daemon.descriptors()
        if row.returned() and (quick or row.after <= RETURN_SHARE * row.before) or time.monotonic() > until:
            return True
        time.sleep(LOOK_SECONDS)
    return False


def is_served_soon(daemon):
    until = time.monotonic() + SERVED_SECONDS
    while time.monotonic() < until and daemon.alive():
        if victim.is_served(daemon.target):
            return True
        time.sleep(0.2)
    return False


def run_life(row, options, first):
    """Starts a new daemon and runs the steps from index `first` on it. Returns the index of the next step if the daemon
    died, else None.
    """
    daemon = start(options, row.attack.flags)
    watcher = victim.Victim(daemon.target)
    try:
        began = time.monotonic()
        time.sleep(IDLE_SECONDS[options.quick or first > 0])
        attacked = time.monotonic()
        if isinstance(daemon, Daemon):
            row.kind = daemon.group.kind
        row.before, row.descriptors = daemon.resident(), daemon.descriptors()
        assault = Assault(row, daemon, options, first)
        alive = assault.watch()
        ended = time.monotonic()
        alive = alive and settle(row, daemon, options.quick)
        served = alive and is_served_soon(daemon)
        row.peak = max(row.peak, daemon.peak())
        alive = not daemon.death()
        if alive:
            row.served = row.served and served
        else:
            row.deaths.append((assault.name, daemon.death()))
        samples = watcher.stop()
        if first == 0:
            row.idle, row.during = victim.summary(samples, began, attacked), victim.summary(samples, attacked, ended)
            row.worst = worst_step(row.began, samples)
        return None if alive else assault.at + 1
    finally:
        if watcher.process.is_alive():
            watcher.stop()
        daemon.stop()


def run(attack, options):
    """Runs one row and returns it. If the daemon dies, starts a new daemon for the remaining steps, except in three
    cases: the run is quick, the daemon runs at a given address, or daemons have died MAX_DEATHS times.
    """
    row, step = Row(attack, options.limit, options.front), 0
    while step is not None:
        step = run_life(row, options, step)
        if step is None or step >= row.steps or options.address:
            break
        if len(row.deaths) >= MAX_DEATHS or options.quick:
            row.skipped.append(f"{row.steps - step} of {row.steps} steps after {len(row.deaths)} deaths")
            break
    return row
