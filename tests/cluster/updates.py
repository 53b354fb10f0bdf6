"""Updates of one scene, prepared for checking: attempts joined by writer and batch number, the model of the objects, and the
revisions that updates of unknown outcome may have.
"""
import bisect
import collections
import heapq

from history import FAILED, NEVER, OK, UNKNOWN, UPDATE

ANYTHING = object()  # the value of an object after an update that is not shown, or before the first known update


NO, MAYBE, YES = "no", "maybe", "yes"  # whether an update makes a revision if it is applied


def keeps_ack(call):
    """Returns whether the ack is the one of the first time: of a repeated batch the server may have no ack any more. Its
    counts are 0 then, and its revision and tick are the present ones.
    """
    return not (call.duplicate and call.applied == 0 and not call.refused)


class Update:
    """One batch, with all attempts to send it: calls with the same writer and batch number.

    `low` and `high` bound the revision. If an ack tells the revision, both are that revision and the outcome is OK. If all
    acks are those of a repeated batch that do not tell it, the outcome is UNKNOWN, and `latest` is the revision that had
    contained the update by then. `seen` says that the update must have been applied, `certain` also that it has a revision of
    its own. `changes` are without the items that the ack lists as refused, which are in `refused`.
    """

    __slots__ = ("attempts", "shown", "outcome", "epoch", "begin", "acked", "low", "high", "latest", "seen", "certain", "changes",
                 "refused", "unlisted", "conditional", "makes", "writer", "batch")

    def __init__(self, calls, attempts, hidden, epoch=None):
        acks = [number for number in attempts if calls[number].outcome == OK and epoch in (None, calls[number].epoch)]
        shown_acks = [number for number in acks if number not in hidden]
        self.attempts = attempts
        # An update all of whose acks are hidden only holds its place.
        self.shown = any(number not in hidden for number in attempts) and bool(shown_acks or not acks)
        kept = [number for number in shown_acks + acks if keeps_ack(calls[number])]
        first = calls[min(kept, key=lambda number: calls[number].duplicate) if kept else (shown_acks or acks or attempts)[0]]
        outcomes = {calls[number].outcome for number in attempts}
        self.outcome = OK if kept else UNKNOWN if acks or UNKNOWN in outcomes else FAILED
        self.epoch = first.epoch if acks else None
        self.begin = min(calls[number].begin for number in attempts)
        self.acked = min((calls[number].end for number in shown_acks or acks), default=NEVER)
        self.low = self.high = first.revision if kept else None
        self.latest = min((calls[number].revision for number in acks), default=NEVER)
        self.seen = bool(acks)
        self.writer, self.batch, self.conditional = first.writer, first.batch, first.conditional
        refused = (first.refused or 0) if kept else 0
        self.refused = {item: first.changes[item] for item in first.refused_items if kept and item in first.changes}
        self.unlisted = max(0, refused - len(first.refused_items))  # refused items that the history does not name
        self.changes = {item: value for item, value in first.changes.items() if item not in self.refused}
        if kept and self.unlisted >= len(self.changes):
            self.changes, self.unlisted = {}, 0
        if self.changes:
            self.makes = MAYBE if self.outcome == UNKNOWN and self.conditional else YES
        else:  # only a new tick makes a revision without changes
            self.makes = NO if first.asked_tick is None else MAYBE
        self.certain = self.seen and self.makes == YES

    def value(self, item):
        """Returns the position of an object after this update, which changes it."""
        return self.changes[item] if self.shown and not self.unlisted else ANYTHING


def join_attempts(calls, numbers, hidden):
    """Returns the Updates of a scene. `numbers` are the indices of its calls in `calls`.

    A batch that was acknowledged in several epochs, which only scenes without a log have, is one update in each.
    """
    groups = collections.defaultdict(list)
    for number in numbers:
        call = calls[number]
        if call.kind == UPDATE:
            groups[(call.writer, call.batch) if call.writer else ("single", number)].append(number)
    updates = []
    for attempts in groups.values():
        epochs = sorted({calls[number].epoch for number in attempts if calls[number].outcome == OK})
        for epoch in epochs or [None]:
            own = [number for number in attempts if calls[number].outcome != OK or calls[number].epoch == epoch or not epochs]
            updates.append(Update(calls, own, hidden, epoch))
    return updates


class Model:
    """Positions of the objects of one epoch at each revision, as far as acknowledged updates say it."""

    def __init__(self, applied, empty):
        """`applied` are updates by revision. With `empty`, no object exists before the first of them."""
        self.start = None if empty else ANYTHING
        self.numbers, self.makers = collections.defaultdict(list), collections.defaultdict(list)
        for revision in sorted(applied):
            for item in applied[revision].changes:
                self.numbers[item].append(revision)
                self.makers[item].append(applied[revision])

    def at(self, item, revision):
        """Returns (value, revision of its update or 0, update or None) of an object at a revision."""
        index = bisect.bisect_right(self.numbers[item], revision) if item in self.numbers else 0
        if index == 0:
            return self.start, 0, None
        maker = self.makers[item][index - 1]
        return maker.value(item), self.numbers[item][index - 1], maker


class PrefixMaximum:
    """Highest value among all entries that ended before a time."""

    def __init__(self, entries):
        """`entries` are (end, value, mark)."""
        self.ends, self.best = [], []
        for end, value, mark in sorted(entries, key=lambda entry: entry[0]):
            self.ends.append(end)
            self.best.append(max(self.best[-1], (value, mark), key=lambda pair: pair[0]) if self.best else (value, mark))

    def before(self, time):
        """Returns (value, mark) of the highest entry that ended before `time`, or None."""
        index = bisect.bisect_left(self.ends, time)
        return self.best[index - 1] if index else None


def bound_by_numbers(updates):
    """Narrows the bounds of numbered updates of unknown outcome: a writer's batches are applied in the order of their
    numbers, and each only after all before it.
    """
    writers = collections.defaultdict(list)
    for update in updates:
        if update.writer and update.outcome != FAILED:
            writers[update.writer].append(update)
    for batches in writers.values():
        batches.sort(key=lambda update: update.batch)
        for before, after in zip(batches, batches[1:]):
            if after.outcome == UNKNOWN:
                own = 1 if before.outcome == OK or before.makes == YES else 0
                after.low = max(after.low, before.low + own)
        for before, after in reversed(list(zip(batches, batches[1:]))):
            if before.outcome == UNKNOWN and after.seen:
                own = 1 if after.makes == YES else 0  # a batch that changes nothing has the revision before it
                before.high, before.seen = min(before.high, after.high - own), True
                before.certain |= before.makes == YES


def first_unfilled(gaps, candidates):
    """Gives each missing revision to an update whose bounds allow it. Returns the first one that no update can have, or
    None.

    To take the one with the least upper bound is optimal (Glover, Maximum matching in a convex bipartite graph, 1967).
    """
    waiting, heap, index = sorted(candidates, key=lambda update: update.low), [], 0
    for gap in gaps:
        while index < len(waiting) and waiting[index].low <= gap:
            heapq.heappush(heap, (waiting[index].high, index))
            index += 1
        while heap and heap[0][0] < gap:
            heapq.heappop(heap)
        if not heap:
            return gap
        heapq.heappop(heap)
    return None


def first_without_place(gaps, candidates):
    """Gives each update that was seen a missing revision. Returns the first one for which none is left, or None."""
    waiting, heap, index = sorted(candidates, key=lambda update: update.low), [], 0
    for gap in gaps:
        while index < len(waiting) and waiting[index].low <= gap:
            heapq.heappush(heap, (waiting[index].high, index))
            index += 1
        if heap:
            high, chosen = heapq.heappop(heap)
            if high < gap:
                return waiting[chosen]
    rest = [waiting[entry[1]] for entry in heap] + waiting[index:]
    return rest[0] if rest else None
