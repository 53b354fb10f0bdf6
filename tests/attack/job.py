"""Job: the arguments of an attack, and its connection to the runner. Attacks run in a process of their own."""
import collections
import resource
import time

import wire

MEMORY = 1 << 30  # memory limit of the attacking process, so that the suite itself stays small
MAX_WRONG = 20
DYING_SECONDS = 0.3
MIN_STEP_SECONDS = 0.25
STRANGER = "mtls-stranger"  # front name: TLS requires a client certificate, and the attacker has none
# Fronts that must protect locusd from every attack: no row is left out, and the victim's p99 may grow only by
# MAX_SHIELDED_SLOWER.
SHIELDED = (STRANGER, "edge")
MAX_SLOWER, MAX_SHIELDED_SLOWER = 10, 5  # factors by which the victim's p99 may grow: default, SHIELDED fronts
# Status codes that give the caller no information, or that no request of a client may cause.
NEVER = ("INTERNAL", "UNKNOWN", "CLOSED", "TIMEOUT", "RESET", "DATA_LOSS", "ABORTED")

# HAProxy 2.6 sometimes refuses a call before the client has sent the whole message. It then sends a reset
# (REFUSED_STREAM) and no headers. gRPC reports such a reset as UNAVAILABLE.
REFUSED_STREAM = ("RESET", "HTTP status none")

# One row of the table. `steps(job)` returns (name, function of job) pairs, which run one after another. `what`
# describes the attack and `bound` its amount, each in a few words. `slower` is the factor by which the victim's p99 may
# grow. `flags` are options with which the daemon is started; they have no effect on a daemon that was already running.
Attack = collections.namedtuple("Attack", "name group steps what bound slower flags", defaults=(MAX_SLOWER, ()))


class Lost(Exception):
    """The daemon accepts no more connections."""


def one(function):
    """Returns the `steps` of an attack that has a single step."""
    return lambda job: [("", function)]


class Job:
    """One run of an attack. In a quick run (`quick`) the steps share `seconds`, and some steps may be skipped. In any
    other run each step lasts `seconds`.
    """

    def __init__(self, target, seconds, quick, pipe, front="plain"):
        self.target, self.seconds, self.quick, self.pipe, self.front = target, seconds, quick, pipe, front
        self.until = time.monotonic() + seconds
        self.end = self.until + seconds  # time after which a quick run begins no step
        self.wrongs = set()

    def never_ends(self, path):
        """Returns options of call(). A call such as Watch may stay open forever, so it gets a short timeout, and
        TIMEOUT is allowed.
        """
        return {"allowed": (*(code for code in wire.CODES if code not in NEVER), "TIMEOUT"), "timeout": 2} \
            if path.endswith("/Watch") else {"timeout": 30}

    def begin(self, index, name):
        self.until = time.monotonic() + self.seconds
        self.pipe.send(("step", index, name))

    def over(self):
        return time.monotonic() >= self.until

    def connect(self, **options):
        """Returns a new connection; raises Lost if the daemon refuses it."""
        try:
            return wire.Connection(self.target, **options)
        except ConnectionRefusedError as error:
            raise Lost() from error

    def count(self, code, number=1):
        self.pipe.send(("codes", code, number))

    def wrong(self, text):
        if text not in self.wrongs and len(self.wrongs) < MAX_WRONG:
            self.wrongs.add(text)
            self.pipe.send(("wrong", text))

    def skip(self, text):
        self.pipe.send(("skip", text))

    def check(self, reply, what, allowed=None, text=True):
        """Counts a Reply. Reports it as wrong if its code is not allowed or, with `text`, if an error has no text.

        A client without the required certificate (the front STRANGER) must get no reply at all.
        """
        self.count(reply.code)
        if self.front == STRANGER:
            if reply.code not in ("CLOSED", "TIMEOUT"):
                self.wrong(f"{what}: a stranger got {reply.code} {reply.text[:80]}".rstrip())
            return
        if self.front == "edge" and (reply.code, reply.text) == REFUSED_STREAM:
            return
        if reply.code in ("CLOSED", "TIMEOUT") and not self.accepts():
            raise Lost()
        if reply.code not in allowed if allowed else reply.code in NEVER:
            self.wrong(f"{what}: {reply.code} {reply.text[:80]}".rstrip())
        elif text and reply.code not in ("OK", "TIMEOUT") and not reply.text:
            self.wrong(f"{what}: {reply.code} without a text")

    def accepts(self):
        """Returns whether the daemon accepts connections. Waits before the check, since a dying daemon accepts
        connections for another moment.
        """
        time.sleep(DYING_SECONDS)
        try:
            wire.open_socket(self.target, 5).close()
            return True
        except ConnectionRefusedError:
            return False
        except (OSError, wire.Closed):
            return True

    def call(self, path, body, what, allowed=None, **options):
        """Makes a call on a new connection and checks its reply."""
        try:
            with self.connect() as connection:
                self.check(connection.call(path, body, **options), what, allowed)
        except (wire.Closed, OSError) as error:
            self.check(wire.Reply("CLOSED", str(error), b""), what, allowed)


def work(attack, job, first):
    """Runs the steps of an attack, beginning with index `first`. This is the main function of the attacking process."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    steps = attack.steps(job)
    job.pipe.send(("steps", len(steps)))
    if job.quick:
        job.seconds = max(job.seconds / len(steps), MIN_STEP_SECONDS)
    for index in range(first, len(steps)):
        if job.quick and index > 0 and time.monotonic() > job.end:
            job.skip(f"{len(steps) - index} of {len(steps)} steps for lack of time")
            break
        job.begin(index, steps[index][0])
        try:
            steps[index][1](job)
        except Lost:
            break
        except (wire.Closed, ConnectionError, TimeoutError):
            job.count("ENDED")
            if not job.accepts():
                break
        except Exception as error:  # an attack that fails itself must not count as passed
            job.wrong(f"the attack itself failed: {type(error).__name__}: {error}")
    job.pipe.send(("end",))
