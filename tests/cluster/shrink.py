"""Makes a failing history small: hides calls while the same rule stays broken, and prints those that are left.

    python3 shrink.py FILE...    joins the histories in the files and judges them; exits 1 if a rule is broken
"""
import itertools
import sys

from checker import check
from history import AT_LEAST, EXACTLY, NEVER, OK, READ, TOKEN, UPDATE, History

MAX_CHECKS = 400  # bounds the time to shrink a history


def restrict(history, violation):
    """Returns the part of a history that matters to a violation, and the new index of each of its calls: the scene, without
    the reads that do not show the violation.
    """
    involved = set(violation.calls)
    scene = history.calls[violation.calls[0]].scene
    kept = [number for number, call in enumerate(history.calls)
            if call.scene == scene and (number in involved or call.kind == UPDATE)]
    part = History([history.calls[number] for number in kept], history.seed, history.memory_scenes)
    return part, kept


class Budget:
    """Number of checks that are left."""

    def __init__(self, checks=MAX_CHECKS):
        self.left = checks

    def breaks(self, history, rule, visible):
        """Returns whether the rule is broken if only the calls of `visible` are shown."""
        self.left -= 1
        hidden = set(range(len(history.calls))) - set(visible)
        return any(violation.rule == rule for violation in check(history, hidden))


def drop_while_broken(history, rule, visible, budget):
    """Returns a subset of the calls `visible`, which break the rule, that breaks it too: halves are dropped first, then
    ever smaller parts (Zeller, Hildebrandt: Simplifying and isolating failure-inducing input, 2002).
    """
    size = max(1, len(visible) // 2)
    while budget.left > 0:
        dropped = False
        for start in range(0, len(visible), size):
            rest = visible[:start] + visible[start + size:]
            if rest and budget.left > 0 and budget.breaks(history, rule, rest):
                visible, dropped = rest, True
                break
        if not dropped:
            if size == 1:
                break
            size = max(1, size // 2)
    return visible


def shrink(history, violation, checks=MAX_CHECKS):
    """Returns the indices of few calls of `history` that still break the rule of the violation."""
    budget = Budget(checks)
    part, kept = restrict(history, violation)
    visible = [index for index, number in enumerate(kept) if number in set(violation.calls)]
    if not budget.breaks(part, violation.rule, visible):
        scene = history.calls[violation.calls[0]].scene
        kept = [number for number, call in enumerate(history.calls) if call.scene == scene]
        part = History([history.calls[number] for number in kept], history.seed, history.memory_scenes)
        visible = list(range(len(kept)))
    return [kept[index] for index in drop_while_broken(part, violation.rule, visible, budget)]


def describe_question(call):
    """Returns what a call asked for, in words."""
    if call.kind == UPDATE:
        numbered = f"writer {call.writer} batch {call.batch}: " if call.writer else ""
        return f"update {numbered}{call.changes}"
    if call.kind == TOKEN:
        return "token"
    view = f" {call.view} {call.asked}" if call.view in (AT_LEAST, EXACTLY) else " latest"
    limit = f", at most {call.max_age_ms} ms old" if call.max_age_ms else ""
    return f"read{view}{', leader_only' if call.leader_only else ''}{limit}"


def describe_answer(call):
    """Returns how a call ended, in words."""
    if call.outcome != OK:
        return f"{call.outcome}{' ' + call.error if call.error else ''}"
    parts = [f"epoch {call.epoch} revision {call.revision}"] if call.kind != TOKEN else []
    parts += [f"token {call.token}"] if call.token is not None else []
    parts += [f"age {call.age_ms} ms"] if call.kind == READ and call.age_ms is not None else []
    parts += ["duplicate"] if call.duplicate else []
    parts += [str(call.answer)] if call.answer else []
    return ", ".join(parts) + (f" from {call.daemon}" if call.daemon else "")


def describe(history, numbers):
    """Returns one line for each call of `numbers`, in the order of time. Times are milliseconds after the first of them."""
    calls = sorted(((number, history.calls[number]) for number in numbers), key=lambda entry: entry[1].begin)
    start = calls[0][1].begin
    lines = []
    for number, call in calls:
        end = "never" if call.end == NEVER else f"{(call.end - start) / 1e6:.3f}"
        lines.append(f"  #{number} {(call.begin - start) / 1e6:.3f} to {end} ms, {call.process} on {call.scene}: "
                     f"{describe_question(call)} -> {describe_answer(call)}")
    return lines


def report(history, violations, origin=""):
    """Returns a text of the violations of a history: each rule once, with its smallest calls. `origin` says how to run it
    again, for example the fault plan.
    """
    found = f"{len(violations)} violations in {len(history.calls)} calls"
    lines = [f"seed {history.seed}: {found}" + (f"; {origin}" if origin else "")]
    told = set()
    for violation in violations:
        if violation.rule in told:
            continue
        told.add(violation.rule)
        lines += [str(violation), *describe(history, shrink(history, violation))]
    return "\n".join(lines)


def main(paths):
    files = [open(path, encoding="utf-8") for path in paths]
    history = History.read(itertools.chain(*files))
    violations = check(history)
    print(report(history, violations))
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
