"""History of the calls that clients made to a cluster: who asked what and when, and what was answered.

A test records each call when it is sent and when it ends; checker.py then decides whether the answers keep the promises.
All times are nanoseconds of the monotonic clock, which all processes of a machine share, so that histories of several
processes can be joined. A call ends in one of three ways:

    ok        answered; for an update: acknowledged
    failed    refused by an error that says that nothing was changed
    unknown   no answer, or an error that does not say whether the update was applied; also calls that never ended

The updates of a test should write positions that are unique to the update: then each read says which updates it saw.
"""
import dataclasses
import json
import math
import threading
import time

OK, FAILED, UNKNOWN = "ok", "failed", "unknown"
UPDATE, READ, TOKEN = "update", "read", "token"
LATEST, AT_LEAST, EXACTLY = "latest", "at_least", "exactly"
NEVER = math.inf

# Codes after which an update may or may not have been applied, unless the error has a reason: errors with a reason are
# refusals, which change nothing (update_service.proto).
UNKNOWN_CODES = ("UNAVAILABLE", "DEADLINE_EXCEEDED", "CANCELLED", "INTERNAL", "UNKNOWN", "ABORTED")


def outcome_of_update(code, reason=""):
    """Returns the outcome of an update that ended with a gRPC status code and, if the error had one, a reason."""
    if code == OK.upper():
        return OK
    return UNKNOWN if code in UNKNOWN_CODES and not reason else FAILED


@dataclasses.dataclass(slots=True)
class Call:
    """One call of a client, or one attempt of it: a batch that is sent again is another call with the same numbers.

    A call without end has the outcome `unknown`. Of the answer, fields that the server did not send keep their defaults.
    """

    kind: str                   # UPDATE, READ, or TOKEN: a token that a daemon or the engine named
    scene: str                  # a scene that was deleted and created anew needs a name of its own here, such as `arena#2`
    process: str                # the client: its calls share one client library, whose reads never go back
    begin: int
    end: float = NEVER
    outcome: str = UNKNOWN
    daemon: str = ""            # the daemon that answered
    error: str = ""             # code and reason of a call that was not answered
    epoch: int = 0
    revision: int = 0
    tick: int | None = None
    token: int | None = None    # the fence of the scene's leader, if the answer named it
    writer: int = 0             # updates: number of the writer, 0 without
    batch: int = 0              # updates: the writer's number of the batch
    changes: dict = dataclasses.field(default_factory=dict)  # updates: object id -> position, None removes the object
    conditional: bool = False   # updates: items may be refused: moves and removes of objects that may be gone, for example
    asked_tick: int | None = None  # updates: the tick that the batch named; with it also a batch without changes may count
    duplicate: bool = False     # updates: the ack said that the batch had been applied before
    applied: int | None = None  # updates: number of applied items in the ack
    refused: int | None = None  # updates: number of refused items in the ack
    refused_items: list = dataclasses.field(default_factory=list)  # updates: ids of the refused items that the ack lists
    view: str = LATEST          # reads
    asked: int = 0              # reads: revision of the views AT_LEAST and EXACTLY
    leader_only: bool = False   # reads
    max_age_ms: int = 0         # reads: 0 = any age
    age_ms: int | None = None   # reads
    answer: dict = dataclasses.field(default_factory=dict)   # reads: object id -> position, None: there is no such object
    question: str = ""          # reads: text of the query, if the digest of the answer is to be compared
    digest: str = ""            # reads: digest of the answer's bytes
    session: bool = True        # reads: asked through a client library that promises that reads never go back


DEFAULTS = {field.name: field.default_factory() if field.default is dataclasses.MISSING and
            field.default_factory is not dataclasses.MISSING else field.default for field in dataclasses.fields(Call)}
ASKED = ("kind", "scene", "process", "writer", "batch", "changes", "conditional", "asked_tick", "view", "asked", "leader_only",
         "max_age_ms", "question", "session")
COLUMNS = ("changes", "answer")


def to_json(values):
    """Returns fields of a call as values of JSON: object ids become texts."""
    return {name: {str(key): item for key, item in value.items()} if name in COLUMNS else value
            for name, value in values.items() if value != DEFAULTS[name]}


def from_json(values):
    """Inverse of to_json()."""
    for name in COLUMNS:
        if name in values:
            values[name] = {int(key): tuple(item) if isinstance(item, list) else item for key, item in values[name].items()}
    return values


@dataclasses.dataclass
class History:
    """Calls of a run, with the seed that makes the run again."""

    calls: list = dataclasses.field(default_factory=list)
    seed: int = 0
    # Scenes whose epoch may change: those with DURABILITY_MEMORY. All other scenes keep their epoch.
    memory_scenes: set = dataclasses.field(default_factory=set)
    # Pairs (begin, end): while a daemon was cut off or frozen, and a while later, a scene with DURABILITY_MEMORY may be led by
    # two daemons, in two epochs.
    partitions: list = dataclasses.field(default_factory=list)

    def write(self, file):
        """Writes the history as lines of JSON: one with the seed, then for each call one line when it begins and one when
        it ends, in the order of time.
        """
        file.write(json.dumps({"seed": self.seed, "memory_scenes": sorted(self.memory_scenes)}) + "\n")
        for partition in self.partitions:
            file.write(json.dumps({"partition": partition}) + "\n")
        lines = []
        for number, call in enumerate(self.calls):
            values = dataclasses.asdict(call)
            asked = to_json({name: values[name] for name in ASKED})
            lines.append((call.begin, 0, {"invoke": number, "at": call.begin, **asked}))
            if call.end != NEVER:
                told = to_json({name: value for name, value in values.items()
                                if name not in (*ASKED, "begin", "end", "outcome")})
                lines.append((call.end, 1, {call.outcome: number, "at": call.end, **told}))
        for _, _, line in sorted(lines, key=lambda entry: entry[:2]):
            file.write(json.dumps(line) + "\n")

    @classmethod
    def read(cls, file):
        """Reads what write() or Recorders wrote, also the files of several Recorders one after another."""
        history, calls = cls(), {}
        for text in file:
            line = json.loads(text)
            if "seed" in line:
                history.seed = line["seed"]
                history.memory_scenes |= set(line["memory_scenes"])
                calls = {}
            elif "partition" in line:
                history.partitions.append(tuple(line["partition"]))
            elif "invoke" in line:
                number, begin = line.pop("invoke"), line.pop("at")
                calls[number] = Call(begin=begin, **from_json(line))
                history.calls.append(calls[number])
            else:
                outcome = next(name for name in (OK, FAILED, UNKNOWN) if name in line)
                call = calls[line.pop(outcome)]
                call.outcome, call.end = outcome, line.pop("at")
                for name, value in from_json(line).items():
                    setattr(call, name, value)
        history.calls.sort(key=lambda call: call.begin)
        return history


class Recorder:
    """Records calls while they run. Thread-safe. With a file, each line is written at once, so that the calls of a
    process that is killed are not lost.

        call = recorder.invoke(UPDATE, "arena", "p1", writer=7, batch=1, changes={5: (1.0, 0.0, 0.0)})
        ...
        recorder.end(call, OK, epoch=ack.epoch, revision=ack.revision)
    """

    def __init__(self, seed=0, memory_scenes=(), file=None):
        self.history = History(seed=seed, memory_scenes=set(memory_scenes))
        self._file, self._lock, self._numbers = file, threading.Lock(), {}
        self._write({"seed": seed, "memory_scenes": sorted(memory_scenes)})

    def _write(self, line):
        if self._file:
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()

    def invoke(self, kind, scene, process, begin=None, **asked):
        """Records that a call is about to be sent, or was sent at `begin`. Returns the call."""
        with self._lock:
            call = Call(kind, scene, process, time.monotonic_ns() if begin is None else begin, **asked)
            self._numbers[id(call)] = len(self.history.calls)
            self.history.calls.append(call)
            values = to_json({name: getattr(call, name) for name in ASKED})
            self._write({"invoke": self._numbers[id(call)], "at": call.begin, **values})
        return call

    def partition(self, begin, end):
        """Records that daemons were cut off or frozen from `begin` to `end`: see History.partitions."""
        with self._lock:
            self.history.partitions.append((begin, end))
            self._write({"partition": (begin, end)})

    def end(self, call, outcome, **answer):
        """Records the end of a call. Call it after the answer has come."""
        with self._lock:
            call.end, call.outcome = time.monotonic_ns(), outcome
            for name, value in answer.items():
                setattr(call, name, value)
            self._write({outcome: self._numbers[id(call)], "at": call.end, **to_json(answer)})
