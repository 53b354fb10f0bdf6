"""Checker of histories: decides in n log n whether the answers that clients got are possible in a cluster that keeps its
promises. That is cheap because revisions witness the order of updates: no order has to be searched.

Each broken promise is a Violation with the name of one of RULES, a text, and the calls that show it. Updates of unknown
outcome may have been applied or not. So that a correct history never fails, every doubt counts for the cluster: a read
may show an update of unknown outcome wherever its bounds allow a missing revision.
"""
import collections
import dataclasses
import itertools

from history import AT_LEAST, EXACTLY, FAILED, NEVER, OK, READ, TOKEN, UNKNOWN, UPDATE
from updates import (ANYTHING, MAYBE, NO, YES, Model, PrefixMaximum, bound_by_numbers, first_unfilled, first_without_place,
                     join_attempts, keeps_ack)

RULES = {
    "unique": "two updates never have the same revision",
    "dense": "each revision of an epoch was made by an update",
    "committed": "a read shows only revisions that an update made before the read ended",
    "real_time": "an update that was acknowledged before another one was sent has the lower revision",
    "epoch": "a takeover keeps the epoch, and without a log an old epoch ends when the next one begins",
    "once": "an update is applied at most once, however often it is sent",
    "same_ack": "a numbered batch that is sent again gets the ack of the first time",
    "writers": "the batches of a writer are applied in the order of their numbers, without a gap",
    "failed": "an update that was refused is not applied",
    "model": "a read equals the result of all updates up to its revision",
    "equal": "all daemons answer alike at one revision",
    "tick": "a scene's tick never goes down, and each revision has one tick",
    "fresh": "a read with leader_only sees every update that was acknowledged before it was asked",
    "at_least": "a read with at_least is answered from that revision or a later one",
    "exactly": "a read with exactly is answered from that revision",
    "age": "age_ms never says younger than true",
    "max_age": "no answer is older than max_age_ms",
    "session": "reads through one client never go back",
    "token": "tokens never go back, and each has one leader",
}
MAX_SHOWN = 5  # violations of one rule that are kept; the others are counted
NANOSECONDS_PER_MS = 1_000_000


@dataclasses.dataclass
class Violation:
    """A broken rule. `calls` are the indices of the calls that show it."""

    rule: str
    text: str
    calls: list

    def __str__(self):
        return f"{self.rule}: {RULES[self.rule]}; but {self.text}"


class Findings:
    """Violations found so far."""

    def __init__(self):
        self.kept, self.counts = [], collections.Counter()

    def add(self, rule, text, *calls):
        self.counts[rule] += 1
        if self.counts[rule] <= MAX_SHOWN:
            self.kept.append(Violation(rule, text, sorted(set(calls))))


def check(history, hidden=frozenset()):
    """Returns the Violations of a history, at most MAX_SHOWN of each rule and scene.

    Calls whose index is in `hidden` break no rule: reads are left out, and updates only hold their revision. So hiding calls
    never makes a new violation, and shrink.py can search for the calls that matter.
    """
    scenes = collections.defaultdict(list)
    for number, call in enumerate(history.calls):
        scenes[call.scene].append(number)
    found = []
    for scene, numbers in scenes.items():
        findings = Findings()
        SceneCheck(history.calls, numbers, hidden, findings).run(scene in history.memory_scenes, history.partitions)
        found += findings.kept
    return found


class SceneCheck:
    """Check of one scene."""

    def __init__(self, calls, numbers, hidden, findings):
        self.calls, self.add = calls, findings.add
        shown = [number for number in numbers if number not in hidden]
        self.reads = [number for number in shown if calls[number].kind == READ and calls[number].outcome == OK]
        self.acks = [number for number in shown if calls[number].kind == UPDATE and calls[number].outcome == OK]
        self.tokens = [number for number in shown if calls[number].kind == TOKEN and calls[number].outcome == OK]
        self.updates = join_attempts(calls, numbers, hidden)

    def run(self, may_restart, partitions):
        # Two daemons may lead a scene without a log during these.
        self.partitions = partitions if may_restart else []
        epochs = sorted({self.calls[number].epoch for number in self.reads + self.acks} |
                        {update.epoch for update in self.updates if update.epoch is not None},
                        key=lambda epoch: min(self.calls[number].begin for number in self.of_epoch(epoch)))
        if len(epochs) > 1 and not may_restart:
            first, second = (self.of_epoch(epoch)[0] for epoch in epochs[:2])
            self.add("epoch", f"the epochs {epochs[0]} and {epochs[1]} were both answered", first, second)
        self.check_views()
        self.check_repeats()
        self.check_tokens()
        self.check_equal_answers()
        if may_restart:
            self.check_epochs(epochs)
        for position, epoch in enumerate(epochs):
            EpochCheck(self, epoch, first=position == 0, only=len(epochs) == 1).run()

    def of_epoch(self, epoch):
        found = [number for number in self.reads + self.acks if self.calls[number].epoch == epoch]
        return found or [number for update in self.updates if update.epoch == epoch for number in update.attempts]

    def check_views(self):
        for number in self.reads:
            call = self.calls[number]
            if call.view == AT_LEAST and call.revision < call.asked:
                self.add("at_least", f"#{number} asked for {call.asked} and got {call.revision}", number)
            if call.view == EXACTLY and call.revision != call.asked:
                self.add("exactly", f"#{number} asked for {call.asked} and got {call.revision}", number)
            if call.max_age_ms and call.age_ms is not None and call.age_ms > call.max_age_ms:
                self.add("max_age", f"#{number} is {call.age_ms} ms old, and allowed {call.max_age_ms}", number)

    def check_repeats(self):
        """Compares the acks of the attempts of one batch."""
        shown = set(self.acks)
        for update in self.updates:
            acks = [number for number in update.attempts if number in shown]
            firsts = [number for number in acks if not self.calls[number].duplicate]
            if len(firsts) > 1:
                self.add("once", f"writer {update.writer}, batch {update.batch} was acknowledged as new by " +
                         " and ".join(f"#{number}" for number in firsts), *firsts)
            whole = [number for number in acks if keeps_ack(self.calls[number])]
            kept = {number: (self.calls[number].epoch, self.calls[number].revision, self.calls[number].tick,
                             self.calls[number].applied, self.calls[number].refused) for number in whole}
            for number in whole[1:]:
                if kept[number] != kept[whole[0]]:
                    self.add("same_ack", f"the acks of #{whole[0]} and #{number} (epoch, revision, tick, applied, refused) are "
                             f"{kept[whole[0]]} and {kept[number]}", whole[0], number)

    def check_tokens(self):
        named = [number for number in self.reads + self.acks + self.tokens if self.calls[number].token is not None]
        led = [number for number in named if self.calls[number].kind == UPDATE or self.calls[number].leader_only]
        sources = collections.defaultdict(list)
        for number in named:
            sources[self.calls[number].daemon].append(number)
        sources.pop("", None)
        for daemon, numbers in sources.items():
            self.check_tokens_of(f"daemon {daemon} named", numbers, numbers)
        self.check_tokens_of("the scene had", named, [number for number in led if self.needs_leader(number) and
                                                      not self.in_partition(number)])
        leaders = {}
        for number in led:
            call = self.calls[number]
            other = leaders.setdefault(call.token, number)
            if call.daemon != self.calls[other].daemon:
                self.add("token", f"{self.calls[other].daemon} in #{other} and {call.daemon} in #{number} both led "
                         f"with token {call.token}", other, number)
        self.check_tokens_of_acks(sorted((self.calls[number].epoch, self.calls[number].revision, number) for number in led
                                         if self.calls[number].kind == UPDATE and self.changes_something(number)))

    def check_tokens_of(self, source, witnesses, numbers):
        """Checks that calls name no lower token than one that a witness had named before they were sent."""
        seen = PrefixMaximum((self.calls[number].end, self.calls[number].token, number) for number in witnesses)
        for number in numbers:
            best = seen.before(self.calls[number].begin)
            if best and best[0] > self.calls[number].token:
                self.add("token", f"{source} token {best[0]} in #{best[1]}, and later #{number} has "
                         f"{self.calls[number].token}", best[1], number)

    def changes_something(self, number):
        call = self.calls[number]
        return bool(call.changes) and not call.duplicate and call.applied != 0

    def needs_leader(self, number):
        """Returns whether only the present leader can have given an answer. A leader that was deposed without knowing it may
        tell of a batch that had been applied before, but commits nothing more.
        """
        return self.calls[number].kind == READ or self.changes_something(number)

    def in_partition(self, number):
        call = self.calls[number]
        return any(call.begin < end and call.end > begin for begin, end in self.partitions)

    def check_epochs(self, epochs):
        """Checks that a scene without a log is not answered in an old epoch after a newer one: at no time by one daemon or to
        one client, and after an ack by no daemon, if none was cut off.
        """
        tokens = collections.defaultdict(list)
        first, last = collections.defaultdict(dict), collections.defaultdict(dict)  # source -> epoch -> (time, call)
        for number in self.reads + self.acks:
            call = self.calls[number]
            if call.kind == UPDATE or call.leader_only:
                tokens[call.epoch].append(call.token)
            if call.kind == READ and call.view == EXACTLY:
                continue
            age = (call.age_ms or 0) * NANOSECONDS_PER_MS if call.kind == READ else 0
            # Whether an answer shows that the epoch had begun, and whether it is wrong after a newer one.
            for source, shows, wrong, begin in (
                    (f"daemon {call.daemon}", bool(call.daemon), bool(call.daemon), call.begin),
                    (f"client {call.process}", call.session, call.session and call.kind == READ, call.begin),
                    ("the scene", call.kind == UPDATE, not self.in_partition(number), call.begin - age)):
                if shows:
                    first[source][call.epoch] = min(first[source].get(call.epoch, (NEVER, None)), (call.end, number))
                if wrong:
                    last[source][call.epoch] = max(last[source].get(call.epoch, (-NEVER, None)), (begin, number))
        ordered = {(old, new) for old in epochs for new in epochs if old != new and tokens[old] and tokens[new] and
                   None not in tokens[old] + tokens[new] and max(tokens[old]) < min(tokens[new])}
        for one, two in itertools.permutations(epochs, 2):
            self.check_two_epochs(first, last, one, two, (one, two) in ordered, (two, one) in ordered)

    def check_two_epochs(self, first, last, old, new, is_older, is_newer):
        """Adds a violation if `old` was answered after `new`. If no tokens say which of the two is older, only both orders
        together are wrong.
        """
        if is_newer:
            return
        for source in first:
            shown, answered = first[source].get(new), last[source].get(old)
            if not shown or not answered or shown[0] >= answered[0]:
                continue
            calls = [shown[1], answered[1]]
            if not is_older:
                shown, answered = first[source].get(old), last[source].get(new)
                if old > new or not shown or not answered or shown[0] >= answered[0]:
                    continue
                calls += [shown[1], answered[1]]
            self.add("epoch", f"{source} was answered in epoch {new} by #{calls[0]}, and later in epoch {old} by #{calls[1]}",
                     *calls)
            return

    def check_tokens_of_acks(self, acks):
        for (epoch, _, before), (next_epoch, _, after) in zip(acks, acks[1:]):
            if epoch == next_epoch and self.calls[after].token < self.calls[before].token:
                self.add("token", f"revision {self.calls[before].revision} was made with token "
                         f"{self.calls[before].token} (#{before}), and revision {self.calls[after].revision} with token "
                         f"{self.calls[after].token} (#{after})", before, after)

    def check_equal_answers(self):
        """Compares what reads at one revision show of one object, and the digests of equal questions."""
        first = {}
        for number in self.reads:
            call = self.calls[number]
            entries = [((call.epoch, call.revision, item), value) for item, value in call.answer.items()]
            if call.question:
                entries.append(((call.epoch, call.revision, call.question), call.digest))
            for key, value in entries:
                other, seen = first.setdefault(key, (number, value))
                if seen != value:
                    self.add("equal", f"at revision {call.revision} {key[2]!r} is {seen!r} for "
                             f"{self.calls[other].daemon or 'one read'} (#{other}) and {value!r} for "
                             f"{call.daemon or 'another'} (#{number})", other, number)


class EpochCheck:
    """Check of one epoch of a scene."""

    def __init__(self, scene, epoch, first, only):
        self.calls, self.add, self.epoch = scene.calls, scene.add, epoch
        self.reads = [number for number in scene.reads if self.calls[number].epoch == epoch]
        self.acks = [number for number in scene.acks if self.calls[number].epoch == epoch]
        self.known = [update for update in scene.updates if update.epoch == epoch and update.outcome == OK]
        self.applied, self.ticked = {}, []
        for update in self.known:
            self.apply(update)
        # Later epochs begin with a state and a revision that the history does not know.
        self.first, self.only = first, only
        self.model = Model(self.applied, empty=first)
        self.unknown = [update for update in scene.updates if update.outcome == UNKNOWN and update.epoch in (None, epoch)]
        self.doubtful = [update for update in self.unknown if update.makes != NO]
        self.refused = [update for update in scene.updates if update.outcome == FAILED]

    def apply(self, update):
        """Enters an acknowledged update under its revision, if it made one."""
        if update.makes == MAYBE:
            self.ticked.append(update)
        if update.makes != YES:
            return
        other = self.applied.setdefault(update.low, update)
        if other is not update and other.shown and update.shown:
            self.add("unique", f"#{other.attempts[0]} and #{update.attempts[0]} both have revision {update.low}",
                     *other.attempts, *update.attempts)

    def run(self):
        self.bound_doubtful()
        self.index_values()
        shown = self.check_reads()
        self.exclude(shown)
        self.check_revisions()
        self.check_real_time()
        self.check_writers()
        self.check_ticks()
        self.check_freshness()
        self.check_sessions()

    def bound_doubtful(self):
        """Gives updates of unknown outcome their first bounds: they are later than everything that was answered before
        they were sent.
        """
        answered = PrefixMaximum((self.calls[number].end, self.calls[number].revision, number)
                                 for number in self.reads + self.acks)
        for update in self.unknown:
            best = answered.before(update.begin)
            update.low, update.high = (best[0] if best else 0) + 1, update.latest
            update.seen, update.certain = update.epoch is not None, update.epoch is not None and update.makes == YES
        if self.only:
            bound_by_numbers(self.known + self.unknown)

    def index_values(self):
        """Finds updates by object and written position, so that a read says which update it saw."""
        self.makers = collections.defaultdict(list)
        for update in self.doubtful + self.refused + self.known:
            for item, value in (*update.changes.items(), *update.refused.items()):
                self.makers[item, value].append(update)

    def check_reads(self):
        """Compares each read with the model. Returns object -> list of (read's revision, revision of the acknowledged
        update that it shows, read).
        """
        shown = collections.defaultdict(list)
        for number in sorted(self.reads, key=lambda number: self.calls[number].revision):
            call = self.calls[number]
            for item, value in call.answer.items():
                expected, since, maker = self.model.at(item, call.revision)
                if expected is ANYTHING:
                    continue
                fitting = [update for update in self.makers.get((item, value), ()) if update.outcome == UNKNOWN]
                if value == expected:
                    if not fitting:  # otherwise the read may show one of those, for example another removal
                        shown[item].append((call.revision, since, number))
                    continue
                if any(not update.shown for update in fitting):
                    continue
                if len(fitting) == 1:
                    self.see(fitting[0], item, since, number)
                elif not any(update.low <= call.revision and update.high > since for update in fitting):
                    self.report_wrong(number, item, value, expected, since, maker)
        return shown

    def see(self, update, item, since, number):
        """Notes that a read showed an update of unknown outcome, after the acknowledged one of revision `since`."""
        call = self.calls[number]
        high, low = min(update.high, call.revision), max(update.low, since + 1)
        if low > high:
            sent = update.attempts[0]
            if update.seen and since + 1 > update.high:
                self.add("once", f"#{sent}, of unknown outcome, had been applied by revision {update.high}, and #{number} "
                         f"shows it again at revision {call.revision}, after revision {since} had changed object {item}",
                         sent, number, *update.attempts, *self.applied[since].attempts)
            else:
                self.add("committed", f"#{number} shows object {item} at revision {call.revision} as #{sent} left it, "
                         f"which has revision {update.low} at the earliest", sent, number)
            return
        update.high, update.low, update.seen, update.certain = high, low, True, True

    def report_wrong(self, number, item, value, expected, since, maker):
        """Adds the violation of a read that shows what neither the model nor an update of unknown outcome says."""
        call = self.calls[number]
        text = f"#{number} shows object {item} at revision {call.revision} as {value!r}, and not as {expected!r}" + (
            f" of revision {since} (#{maker.attempts[-1]})" if maker else "")
        calls = [number, *(maker.attempts if maker else ())]
        for update in self.makers.get((item, value), ()):
            if update.outcome == FAILED or item in update.refused:
                self.add("failed", f"{text}: that is #{update.attempts[0]}, which was refused", *calls, *update.attempts)
                return
            if update.outcome == OK and update.shown and update.low > call.revision:
                rule = "once" if len(update.attempts) > 1 else "model"
                self.add(rule, f"{text}: that is #{update.attempts[-1]}, acknowledged at revision {update.low}",
                         *calls, *update.attempts)
                return
        self.add("model", text, *calls)

    def exclude(self, shown):
        """Narrows the bounds of updates of unknown outcome by reads that do not show them: such an update has not been
        applied up to that revision, unless a later update hides it.
        """
        for item in shown:
            shown[item].sort()
        revisions = {item: [since for _, since, _ in entries] for item, entries in shown.items()}
        for update in (update for update in self.doubtful if update.shown and not update.conditional):
            for item, value in update.changes.items():
                entries = shown.get(item, ())
                index = self.last_below(revisions.get(item, ()), update.low)
                if index < 0 or self.model.at(item, entries[index][0])[0] == value or entries[index][0] < update.low:
                    continue
                revision, since, number = entries[index]
                if revision >= update.high:
                    self.add("model", f"#{number} shows object {item} at revision {revision} as revision {since} left it, "
                             f"though #{update.attempts[0]} had been applied by revision {update.high}", number,
                             *update.attempts)
                else:
                    update.low = revision + 1

    @staticmethod
    def last_below(sorted_values, bound):
        """Returns the index of the last value below `bound`, -1 if there is none."""
        low, high = 0, len(sorted_values)
        while low < high:
            middle = (low + high) // 2
            low, high = (middle + 1, high) if sorted_values[middle] < bound else (low, middle)
        return low - 1

    def check_revisions(self):
        """Checks that an update can have made each revision, and that each update that was seen has one."""
        highest_read = max(((self.calls[number].revision, number) for number in self.reads), default=(0, None))
        acked = [update for update in self.known + self.unknown if update.epoch == self.epoch]
        last = max([highest_read[0], *(update.latest for update in acked)])
        # The first revision that is known of a later epoch may be the one that the epoch began with.
        start = 0 if self.first else min([*self.applied, *(self.calls[number].revision for number in self.reads)], default=0)
        gaps, previous, candidates = [], start, self.doubtful + self.ticked
        for revision in [*sorted(self.applied), last + 1]:
            # One more than there are candidates is enough to find that they do not suffice.
            room = len(candidates) + 1 - len(gaps)
            gaps += range(previous + 1, min(revision, previous + 1 + max(room, 0)))
            previous = max(previous, revision)
        gap = first_unfilled(gaps, candidates)
        if gap is not None:
            self.report_gap(gap, highest_read, acked)
            return
        lost = first_without_place(gaps, [update for update in self.doubtful if update.certain]) if self.only else None
        if lost:
            sent = lost.attempts[0]
            self.add("dense", f"#{sent} was applied with a revision of {lost.low} to {lost.high}, and other updates have "
                     "all of them", *lost.attempts)

    def report_gap(self, gap, highest_read, acked):
        if highest_read[0] >= gap > max(self.applied, default=0):
            self.add("committed", f"#{highest_read[1]} shows revision {highest_read[0]}, and no update can have made "
                     f"revision {gap}", highest_read[1])
            return
        if gap > max(self.applied, default=0):
            last = max(acked, key=lambda update: update.latest)
            self.add("dense", f"#{last.attempts[-1]} was answered at revision {last.latest}, and no update can have made "
                     f"revision {gap}", *last.attempts)
            return
        after = min(revision for revision in self.applied if revision > gap)
        before = max((revision for revision in self.applied if revision < gap), default=None)
        neighbours = self.applied[after].attempts + (self.applied[before].attempts if before is not None else [])
        repeated = [update.attempts[0] for update in self.known if len(update.attempts) > 1 and update.shown]
        hint = f" (sent several times: {', '.join(f'#{number}' for number in repeated[:MAX_SHOWN])})" if repeated else ""
        self.add("dense", f"no update can have made revision {gap} of epoch {self.epoch}{hint}", *neighbours)

    def check_real_time(self):
        """Sweeps revisions from the highest one, with the earliest end of what has a higher revision."""
        reads = sorted(((self.calls[number].revision, number) for number in self.reads), reverse=True)
        index, earliest = 0, (NEVER, None, 0)
        for revision in sorted(self.applied, reverse=True):
            update = self.applied[revision]
            while index < len(reads) and reads[index][0] >= revision:
                number = reads[index][1]
                earliest = min(earliest, (self.calls[number].end, number, reads[index][0]), key=lambda entry: entry[0])
                index += 1
            if not update.shown:
                continue
            sent = update.attempts[0]
            if earliest[0] < update.begin:
                rule = "committed" if self.calls[earliest[1]].kind == READ else "real_time"
                self.add(rule, f"#{earliest[1]} had ended with revision {earliest[2]} when #{sent}, which has revision "
                         f"{revision}, was sent", earliest[1], *update.attempts)
            ack = next(number for number in update.attempts if self.calls[number].end == update.acked)
            earliest = min(earliest, (update.acked, ack, revision), key=lambda entry: entry[0])

    def check_writers(self):
        writers = collections.defaultdict(dict)
        for update in self.known + self.unknown:
            if update.writer:
                writers[update.writer].setdefault(update.batch, update)
        for writer, batches in writers.items():
            acked = sorted(batch for batch, update in batches.items() if update.outcome == OK)
            for before, after in zip(acked, acked[1:]):
                low, high = batches[before], batches[after]
                if low.low >= high.low + (high.makes != YES) and low.shown and high.shown:
                    self.add("writers", f"writer {writer} has batch {before} at revision {low.low} (#{low.attempts[0]}) and "
                             f"batch {after} at revision {high.low} (#{high.attempts[0]})", *low.attempts, *high.attempts)
            last = acked[-1] if acked and self.only else 1
            missing = next((batch for batch in range(1, last) if batch not in batches), None)
            if missing:
                after = batches[min(batch for batch in acked if batch > missing)]
                if after.shown:
                    self.add("writers", f"batch {after.batch} of writer {writer} was applied (#{after.attempts[-1]}) without "
                             f"batch {missing}", *after.attempts)

    def check_ticks(self):
        """Compares ticks in the order of revisions. The tests of a cluster do not restart ticks."""
        told = sorted((self.calls[number].revision, self.calls[number].tick, number) for number in self.reads + self.acks
                      if self.calls[number].tick is not None)
        for (revision, tick, before), (next_revision, next_tick, after) in zip(told, told[1:]):
            if next_tick < tick or (revision == next_revision and next_tick != tick):
                self.add("tick", f"revision {revision} has tick {tick} (#{before}), and revision {next_revision} has tick "
                         f"{next_tick} (#{after})", before, after)

    def check_freshness(self):
        """Checks what reads must see because it was acknowledged before. `exactly` asks for the past, at any age."""
        acked = [(self.calls[number].end, self.calls[number].revision, number) for number in self.acks]
        led = [(self.calls[number].end, self.calls[number].revision, number) for number in self.reads
               if self.calls[number].leader_only]
        acks, leaders = PrefixMaximum(acked), PrefixMaximum(acked + led)
        for number in self.reads:
            call = self.calls[number]
            if call.view == EXACTLY:
                continue
            best = leaders.before(call.begin) if call.leader_only else None
            if best and best[0] > call.revision:
                self.add("fresh", f"#{number} with leader_only shows revision {call.revision}, and revision {best[0]} had "
                         f"been answered before by #{best[1]}", number, best[1])
                continue
            age = call.age_ms or 0  # an answer without age says that it is of now
            best = acks.before(call.begin - age * NANOSECONDS_PER_MS)
            if best and best[0] > call.revision:
                late = (call.begin - self.calls[best[1]].end) / NANOSECONDS_PER_MS
                self.add("age", f"#{number} shows revision {call.revision} and says age {age} ms, and revision "
                         f"{best[0]} had been acknowledged {late:.3f} ms before it was asked (#{best[1]})", number, best[1])

    def check_sessions(self):
        clients = collections.defaultdict(list)
        for number in self.reads + self.acks:
            if self.calls[number].session:
                clients[self.calls[number].process].append(number)
        for process, numbers in clients.items():
            seen = PrefixMaximum((self.calls[number].end, self.calls[number].revision, number) for number in numbers)
            for number in numbers:
                call = self.calls[number]
                best = seen.before(call.begin) if call.kind == READ and call.view != EXACTLY else None
                if best and best[0] > call.revision:
                    self.add("session", f"client {process} saw revision {best[0]} in #{best[1]} and then revision "
                             f"{call.revision} in #{number}", number, best[1])
