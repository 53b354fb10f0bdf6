"""Fault plans: which fault begins when, made from a seed and printed as text that can be given back.

    python3 fault_plan.py --seed 7 --seconds 120 [--only engine] > plan.txt
    plan = Plan.parse(open("plan.txt").read())
    run(plan, Actions(...))

A line of a plan is `TIME NAME SECONDS CHOICE`: seconds after the start at which the fault begins, its name in FAULTS, how
long it lasts, and a number that chooses among the nodes, daemons or scenes that it may hit (modulo their number).
"""
import argparse
import dataclasses
import random
import sys
import time

ENGINE, DAEMONS, STORED, HOOKS = "engine", "daemons", "stored", "hooks"


@dataclasses.dataclass(frozen=True)
class Kind:
    """A kind of fault. `needs` says who must be there for it: ENGINE the PostgreSQL nodes, DAEMONS also locusd, STORED also
    write access to the tables, HOOKS also a daemon with test hooks. `seconds` are the least and the greatest duration.
    """

    needs: str
    seconds: tuple
    what: str


# Power cuts and a full disk are not here: they need loop devices.
FAULTS = {
    "kill-primary": Kind(ENGINE, (1, 3),
        "SIGKILL to all processes of the primary; another node is promoted at once, and the old primary joins again at "
        "the end"),
    "restart-primary": Kind(ENGINE, (0.5, 2),
        "SIGKILL to all processes of the primary, which is started again as the primary: it may show commits that no "
        "standby has"),
    "kill-standby": Kind(ENGINE, (1, 4),
        "SIGKILL to all processes of a standby, which is started again at the end; the other one makes the quorum"),
    "freeze-primary": Kind(ENGINE, (3, 15),
        "SIGSTOP to the primary while another node is promoted; at the end the old one wakes, still takes itself for the "
        "primary for a second, and then joins again"),
    "freeze-standby": Kind(ENGINE, (2, 8),
        "SIGSTOP to a standby, then SIGCONT"),
    "isolate-primary": Kind(ENGINE, (3, 10),
        "the primary is cut from the other nodes and hangs for all clients, while another node is promoted: who stays "
        "with the old one never gets an ack"),
    "cut-standbys": Kind(ENGINE, (2, 5),
        "both standbys are cut from the primary: no commit gets a quorum, nothing is promoted"),
    "cut-clients": Kind(ENGINE, (0.5, 3),
        "all connections of clients to all nodes are reset and refused"),
    "hang-engine": Kind(ENGINE, (3, 8),
        "all connections of clients stay open and are accepted, but never answered"),
    "no-engine": Kind(ENGINE, (2, 30),
        "SIGKILL to all nodes; started again at the end, with the same primary"),
    "kill-leader": Kind(DAEMONS, (1, 10),
        "SIGKILL to the daemon that leads a scene; started again at the end"),
    "kill-follower": Kind(DAEMONS, (1, 10),
        "SIGKILL to a daemon that follows a scene; started again at the end"),
    "kill-leader-and-primary": Kind(DAEMONS, (3, 10),
        "SIGKILL to a leader and to the primary at the same moment"),
    "freeze-leader": Kind(DAEMONS, (10, 15),
        "SIGSTOP to a leader for longer than its lease: when it wakes it is fenced"),
    "cut-leader": Kind(DAEMONS, (4, 12),
        "a leader is cut from all nodes of the engine, and answers queries on"),
    "leave-leader-with-old-primary": Kind(DAEMONS, (4, 12),
        "as isolate-primary, but the connections of one leader to the old primary stay, so that it may be stuck there"),
    "cut-followers": Kind(DAEMONS, (2, 10),
        "the followers of a scene are cut from its leader: their ages grow"),
    "drain-daemon": Kind(DAEMONS, (1, 5),
        "SIGTERM to a daemon, which hands over its scenes; started again at the end"),
    "upgrade-daemon": Kind(DAEMONS, (1, 5),
        "as drain-daemon, started again with another apply_version"),
    "flip-record": Kind(STORED, (1, 5),
        "one byte of a stored record is flipped; restored at the end"),
    "flip-chunk": Kind(STORED, (1, 5),
        "one byte of a chunk of a snapshot is flipped; restored at the end"),
    "flip-mesh": Kind(STORED, (1, 5),
        "one byte of a stored mesh is flipped; restored at the end"),
    "delete-record": Kind(STORED, (1, 5),
        "a record that is not the last is deleted; restored at the end"),
    "damage-follower": Kind(HOOKS, (1, 5),
        "an object in the memory of a follower is moved without a record"),
    "skip-record": Kind(HOOKS, (1, 5),
        "a follower leaves out the next record that it gets"),
}
ORDER = (ENGINE, DAEMONS, STORED, HOOKS)


def names(needs):
    """Returns the faults that can be made with what `needs` says, and with less."""
    return [name for name, kind in FAULTS.items() if ORDER.index(kind.needs) <= ORDER.index(needs)]


@dataclasses.dataclass(frozen=True)
class Fault:
    """One fault of a plan."""

    at: float
    name: str
    seconds: float
    choice: int

    def __str__(self):
        return f"{self.at:g} {self.name} {self.seconds:g} {self.choice}"

    def among(self, targets):
        """Returns the target that this fault hits."""
        return targets[self.choice % len(targets)]


@dataclasses.dataclass
class Plan:
    """Faults in the order of time, none of which overlap."""

    seed: int
    faults: list

    @classmethod
    def make(cls, seed, seconds, allowed, max_duration=15, pause=(0.5, 3)):
        """Makes a plan of about so many seconds. Each of the allowed faults comes once before one comes again; between two
        faults is a pause, so that the cluster mends some of them wholly, and others not.
        """
        chance = random.Random(seed)
        now, faults, waiting = chance.uniform(0.5, 2), [], []
        while True:
            if not waiting:
                waiting = list(allowed)
                chance.shuffle(waiting)
            name = waiting.pop()
            low, high = FAULTS[name].seconds
            duration = round(min(chance.uniform(low, high), max(low, max_duration)), 2)
            if now + duration > seconds:
                return cls(seed, faults)
            faults.append(Fault(round(now, 2), name, duration, chance.randrange(1 << 16)))
            now += duration + chance.uniform(*pause)

    def __str__(self):
        return "\n".join([f"# fault plan of seed {self.seed}: TIME NAME SECONDS CHOICE", *map(str, self.faults)]) + "\n"

    @classmethod
    def parse(cls, text):
        """Inverse of str(). Refuses unknown names and faults that overlap by a ValueError."""
        seed, faults = 0, []
        for number, line in enumerate(text.split("\n"), 1):
            if line.startswith("# fault plan of seed "):
                seed = int(line.split()[5].rstrip(":"))
            if not line.strip() or line.startswith("#"):
                continue
            fields = line.split()
            if len(fields) != 4 or fields[1] not in FAULTS:
                raise ValueError(f"line {number} of the fault plan is no `TIME NAME SECONDS CHOICE`: {line}")
            faults.append(Fault(float(fields[0]), fields[1], float(fields[2]), int(fields[3])))
            if len(faults) > 1 and faults[-1].at < faults[-2].at + faults[-2].seconds:
                raise ValueError(f"line {number} of the fault plan begins before the fault before it ends: {line}")
        return cls(seed, faults)


def run(plan, actions, say=lambda text: None):
    """Makes the faults of a plan happen. `actions` maps each name to a function that takes the Fault, begins it, and returns a
    function that ends it, or None. A fault is never early, but late if the end of the one before took long.
    """
    unknown = sorted({fault.name for fault in plan.faults} - set(actions))
    if unknown:
        raise ValueError(f"there are no actions for {', '.join(unknown)}")
    start = time.monotonic()
    for fault in plan.faults:
        time.sleep(max(0.0, start + fault.at - time.monotonic()))
        say(f"{time.monotonic() - start:.2f} s: {fault} begins")
        end = actions[fault.name](fault)
        time.sleep(fault.seconds)
        if end:
            end()
        say(f"{time.monotonic() - start:.2f} s: {fault.name} has ended")


def main():
    parser = argparse.ArgumentParser(description="Prints a fault plan, or what each fault does.")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=60)
    parser.add_argument("--only", choices=ORDER, default=HOOKS, help="faults that need this, or less")
    parser.add_argument("--list", action="store_true", help="print what each fault does")
    options = parser.parse_args()
    if options.list:
        for name in names(options.only):
            print(f"{name} ({FAULTS[name].needs}): {FAULTS[name].what}")
    else:
        sys.stdout.write(str(Plan.make(options.seed, options.seconds, names(options.only))))


if __name__ == "__main__":
    main()
