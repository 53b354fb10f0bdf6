"""The table of all attacks, the groups of attacks for quick runs, and the rows that locusd still fails."""
import functools
import multiprocessing
import time

import wire
from job import SHIELDED, Attack, Job, Lost, one
from rows import calls, connections, frames, messages, replies

# Rows that locusd fails at present, each with the observed effect. Quick runs skip these rows, unless a front
# shields locusd. Remove a row's name once the row passes.
NOT_YET = {
}

# Rows that the attack `union` runs at the same time: the rows that cost the daemon most. The daemon withstands each of
# them alone.
TOGETHER = ("reset-queries", "settings", "ping", "garbage", "slow-bodies", "wrong-bytes", "honest", "unread", "continuation",
            "gzip", "amplify", "history", "hpack")


# Source addresses of those parts of the union whose calls must all be answered. The other parts share another address,
# from which locusd may refuse connections.
OWN_ADDRESSES = {"honest": "127.0.0.3", "wrong-bytes": "127.0.0.4", "gzip": "127.0.0.5", "amplify": "127.0.0.6",
                 "history": "127.0.0.7"}


class Ended:
    """Replacement for the pipe of an attack that is part of the union. Forwards codes and wrong results, and drops all
    other reports, such as the start of a step.
    """

    def __init__(self, name, pipe, lock):
        self.name, self.pipe, self.lock = name, pipe, lock

    def send(self, event):
        if event[0] in ("codes", "wrong"):
            with self.lock:
                self.pipe.send(event if event[0] == "codes" else ("wrong", f"{self.name}: {event[1]}"))


def run_again(attack, job):
    """Repeats the steps of an attack until the time is over."""
    steps, at = attack.steps(job), 0
    while time.monotonic() < job.end:
        job.until = job.end
        try:
            steps[at % len(steps)][1](job)
        except Lost:
            return
        except (OSError, EOFError, wire.Closed):
            pass
        at += 1


def not_yet(front):
    """Returns the names of the rows that locusd fails when it is attacked through this front."""
    return () if front in SHIELDED else tuple(NOT_YET)


def together(job):
    """Runs the attacks of the union at the same time, each in its own process, until all have ended."""
    context, processes = multiprocessing.get_context("fork"), []
    lock = context.Lock()
    for attack in ROWS:
        if attack.name in TOGETHER and attack.name not in not_yet(job.front):
            target = job.target._replace(source=OWN_ADDRESSES.get(attack.name, job.target.source))
            part = Job(target, job.seconds, True, Ended(attack.name, job.pipe, lock), job.front)
            processes.append(context.Process(target=run_again, args=(attack, part), daemon=True))
            processes[-1].start()
    for process in processes:
        process.join(job.seconds + 60)
        if process.is_alive():
            process.kill()
            process.join()


UNION = Attack("union", "union", one(together), "several attacks at the same time: " + ", ".join(TOGETHER),
               "one process each", 50)
ROWS = [*messages.ROWS, *replies.ROWS, *frames.ROWS, *connections.ROWS, *calls.ROWS, UNION]
GROUPS = tuple(dict.fromkeys(attack.group for attack in ROWS))


@functools.lru_cache(maxsize=None)
def by_name():
    return {attack.name: attack for attack in ROWS}


def chosen(word, front="plain"):
    """Returns (attacks, whether the run is quick, names of the attacks left out). `word` is `all`, `quick`,
    `quick:GROUP`, or names separated by commas.
    """
    head, _, group = word.partition(":")
    if head == "quick":
        rows = [attack for attack in ROWS if not group or attack.group == group]
        if not rows:
            raise ValueError(f"there is no group {group}; the groups are {', '.join(GROUPS)}")
        fails = not_yet(front)
        return [row for row in rows if row.name not in fails], True, [row.name for row in rows if row.name in fails]
    if word == "all":
        return ROWS, False, []
    unknown = [name for name in word.split(",") if name not in by_name()]
    if unknown:
        raise ValueError(f"there is no attack {', '.join(unknown)}; see --list")
    return [by_name()[name] for name in word.split(",")], False, []
