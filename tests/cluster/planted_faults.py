"""Faults planted in correct histories: each function makes the answers of a run wrong in one way, as a cluster with that
fault would, and names the rule of checker.py that must find it.

A function takes the Simulator of the run, which knows what is true, and its history, which it changes. It chooses at random
among the places where the fault would show, and returns whether there was one.
"""
import dataclasses

from history import AT_LEAST, EXACTLY, FAILED, LATEST, OK, READ, UNKNOWN, UPDATE
from simulator import EPOCH, MS, tick_of

FAULTS = {}  # name -> (rule, options of the simulation, function)


def fault(rule, **options):
    """Registers a planted fault that the rule must find."""
    def register(function):
        FAULTS[function.__name__] = (rule, options, function)
        return function
    return register


def reads(history, **wanted):
    return [call for call in history.calls if call.kind == READ and call.outcome == OK and
            all(getattr(call, name) == value for name, value in wanted.items())]


def acks(history):
    return [call for call in history.calls if call.kind == UPDATE and call.outcome == OK and not call.duplicate]


def scene_of(run, call):
    return next(scene for scene in run.scenes if scene.name == call.scene)


def shift(history, scene, first, distance):
    """Renumbers the revisions of a scene from `first` on."""
    for call in history.calls:
        if call.scene == scene and call.outcome == OK:
            call.revision += distance if call.revision >= first else 0
            call.asked += distance if call.asked >= first else 0
            call.tick = tick_of(call.revision)


def answer_from(run, call, revision):
    """Answers a read from another revision, correctly."""
    call.revision, call.tick = revision, tick_of(revision)
    call.answer = {item: scene_of(run, call).at(item, revision) for item in call.answer}


def choose(run, places):
    places = list(places)
    return run.random.choice(places) if places else None


@fault("model")
def acknowledged_update_is_lost(run, history):
    """All reads show an object as it was before an acknowledged update."""
    makers = {(call.scene, item, value): call for call in acks(history) for item, value in call.changes.items() if value}
    place = choose(run, ((makers[call.scene, item, value], item) for call in reads(history) for item, value in call.answer.items()
                         if (call.scene, item, value) in makers))
    if not place:
        return False
    update, item = place
    for call in reads(history, scene=update.scene):
        if call.answer.get(item) == update.changes[item]:
            call.answer[item] = scene_of(run, update).at(item, update.revision - 1)
    return True


@fault("once")
def numbered_batch_is_acknowledged_twice(run, history):
    update = choose(run, (call for call in acks(history) if call.writer))
    shift(history, update.scene, update.revision + 1, 1)
    again = dataclasses.replace(update, begin=update.end + MS, end=update.end + 2 * MS, revision=update.revision + 1)
    history.calls.append(again)
    return True


@fault("dense", unknown=0)
def update_is_applied_twice_and_acknowledged_once(run, history):
    update = choose(run, acks(history))
    shift(history, update.scene, update.revision, 1)
    return True


@fault("once", unknown=0.2)
def update_of_unknown_outcome_is_applied_twice(run, history):
    """A read shows it, then an acknowledged update changes the object, then a read shows the first one again."""
    doubtful = {(call.scene, item, value) for call in history.calls if call.kind == UPDATE and not call.writer and
                call.outcome == UNKNOWN for item, value in call.changes.items() if value}
    known = {(call.scene, item, value): call for call in acks(history) for item, value in call.changes.items() if value}
    seen = [(call, item, value) for call in reads(history) for item, value in call.answer.items()
            if (call.scene, item, value) in doubtful]
    place = choose(run, ((call, item, value) for first, item, value in seen for call in reads(history, scene=first.scene)
                         if item in call.answer and (call.scene, item, call.answer[item]) in known and
                         known[call.scene, item, call.answer[item]].revision > first.revision))
    if place:
        place[0].answer[place[1]] = place[2]
    return bool(place)


@fault("same_ack")
def repeated_batch_gets_another_ack(run, history):
    update = choose(run, (call for call in acks(history) if call.writer))
    history.calls.append(dataclasses.replace(update, begin=update.end + MS, end=update.end + 2 * MS, duplicate=True,
                                             revision=update.revision + 1))
    return True


@fault("writers")
def batch_is_applied_without_the_one_before(run, history):
    update = choose(run, (call for call in acks(history) if call.batch > 1))
    history.calls[:] = [call for call in history.calls if (call.writer, call.batch) != (update.writer, update.batch - 1)]
    return True


@fault("writers")
def batches_of_a_writer_change_places(run, history):
    by_number = {(call.writer, call.batch): call for call in acks(history) if call.writer}
    first = choose(run, (call for (writer, batch), call in by_number.items() if (writer, batch + 1) in by_number))
    second = by_number[first.writer, first.batch + 1]
    first.revision, second.revision = second.revision, first.revision
    return True


@fault("fresh")
def leader_answers_from_an_old_revision(run, history):
    ended = {(call.scene, call.revision): call.end for call in acks(history)}
    call = choose(run, (call for call in reads(history, leader_only=True)
                        if ended.get((call.scene, call.revision), call.begin) < call.begin))
    if call:
        answer_from(run, call, call.revision - 1)
    return bool(call)


@fault("unique")
def revision_is_used_twice(run, history):
    made = {(call.scene, call.revision): call for call in acks(history)}
    first = choose(run, (call for (scene, revision), call in made.items() if (scene, revision + 1) in made))
    made[first.scene, first.revision + 1].revision = first.revision
    shift(history, first.scene, first.revision + 2, -1)
    return True


@fault("dense", unknown=0)
def revision_is_left_out(run, history):
    update = choose(run, (call for call in acks(history) if call.revision > 1))
    shift(history, update.scene, update.revision, 1)
    return True


@fault("committed", unknown=0)
def read_shows_a_revision_that_never_came(run, history):
    call = max(reads(history), key=lambda call: call.revision)
    call.revision = scene_of(run, call).revision + 1
    return True


@fault("committed")
def read_shows_an_update_before_it_was_sent(run, history):
    place = choose(run, ((call, update) for update in run.random.sample(acks(history), 40) if not update.writer
                         for call in reads(history, scene=update.scene)
                         if call.end < update.begin and call.view != EXACTLY and call.revision < update.revision))
    if place:
        answer_from(run, place[0], place[1].revision)
    return bool(place)


@fault("age")
def follower_says_a_younger_age(run, history):
    late = {}
    for update in acks(history):
        late.setdefault(update.scene, []).append(update)
    call = choose(run, (call for call in reads(history) if call.view != EXACTLY and call.age_ms and any(
        update.end < call.begin and update.revision > call.revision for update in late[call.scene])))
    if call:
        call.age_ms = 0
    return bool(call)


@fault("max_age")
def answer_is_older_than_allowed(run, history):
    call = choose(run, (call for call in reads(history) if (call.age_ms or 0) > 1))
    call.max_age_ms = call.age_ms - 1
    return True


@fault("real_time")
def two_updates_change_places(run, history):
    made = {(call.scene, call.revision): call for call in acks(history)}
    pairs = ((first, made.get((scene, revision + 1))) for (scene, revision), first in made.items())
    pair = choose(run, ((first, second) for first, second in pairs
                        if second and first.end < second.begin and not set(first.changes) & set(second.changes)
                        and not any(call.batch > 1 for call in (first, second))))
    if pair:
        pair[0].revision, pair[1].revision = pair[1].revision, pair[0].revision
    return bool(pair)


@fault("token")
def token_goes_back(run, history):
    made = {(call.scene, call.revision): call for call in acks(history)}
    call = choose(run, (call for (scene, revision), call in made.items()
                        if (scene, revision - 1) in made and made[scene, revision - 1].token == call.token > 1))
    if call:
        call.token -= 1
    return bool(call)


@fault("token")
def two_daemons_lead_with_one_token(run, history):
    call = choose(run, reads(history, leader_only=True))
    call.daemon = next(daemon for daemon in run.daemons if daemon != call.daemon)
    return True


@fault("model")
def read_shows_a_wrong_value(run, history):
    call = choose(run, reads(history))
    call.answer[next(iter(call.answer))] = (-1.0, -1.0, -1.0)
    return True


@fault("failed")
def refused_update_appears(run, history):
    shown = {(call.scene, item, value) for call in reads(history) for item, value in call.answer.items() if value}
    update = choose(run, (call for call in acks(history) if not call.writer and
                          any((call.scene, item, value) in shown for item, value in call.changes.items())))
    update.outcome, update.revision, update.error = FAILED, 0, "RESOURCE_EXHAUSTED REASON_LIMIT"
    return True


@fault("at_least")
def follower_does_not_wait(run, history):
    call = choose(run, (call for call in reads(history, view=AT_LEAST) if call.asked > 0))
    answer_from(run, call, call.asked - 1)
    return True


@fault("exactly")
def exact_read_is_answered_from_another_revision(run, history):
    call = choose(run, (call for call in reads(history, view=EXACTLY) if call.asked > 0))
    answer_from(run, call, call.asked - 1)
    return True


@fault("session")
def read_goes_back(run, history):
    highest = {}
    places = []
    for call in history.calls:
        key = (call.process, call.scene)
        if call.kind == READ and call.view == AT_LEAST and highest.get(key, 0) > 1:
            places.append((call, highest[key]))
        if call.kind == READ and call.outcome == OK:
            highest[key] = max(highest.get(key, 0), call.revision)
    call, seen = choose(run, places)
    call.view, call.asked = LATEST, 0
    answer_from(run, call, seen - 1)
    return True


@fault("equal")
def follower_differs_from_the_leader(run, history):
    first = {}
    places = []
    for call in reads(history):
        for item in call.answer:
            other = first.setdefault((call.scene, call.revision, item), call)
            if other is not call and other.daemon != call.daemon:
                places.append((call, item))
    place = choose(run, places)
    if place:
        place[0].answer[place[1]] = (-2.0, 0.0, 0.0)
    return bool(place)


@fault("tick")
def tick_goes_down(run, history):
    call = choose(run, (call for call in acks(history) if call.tick > 1))
    call.tick -= 2
    return True


@fault("tick")
def daemons_name_two_ticks_of_one_revision(run, history):
    made = {(call.scene, call.revision) for call in acks(history)}
    call = choose(run, (call for call in reads(history) if (call.scene, call.revision) in made))
    call.tick += 1
    return True


@fault("equal")
def digests_differ(run, history):
    by_revision = {}
    for call in reads(history):
        by_revision.setdefault((call.scene, call.revision), []).append(call)
        call.question, call.digest = "everything", f"digest of {call.revision}"
    several = choose(run, (calls for calls in by_revision.values() if len(calls) > 1))
    several[0].digest = "another"
    return True


@fault("epoch")
def takeover_begins_another_epoch(run, history):
    scene = run.random.choice(run.scenes).name
    moment = history.calls[len(history.calls) // 2].begin
    for call in history.calls:
        if call.scene == scene and call.begin > moment and call.epoch:
            call.epoch = EPOCH + 1
    return True
