"""Base class of UpdateStream and QueryStream: a bidirectional call with a bounded number of messages in flight. A
response is matched to its message by sequence number. After a broken connection the stream opens a new call and sends
the unanswered messages again. Internal to the package.

One thread per stream opens the calls, one after another, and reads the responses; gRPC's thread writes the messages.
Invariants: `_items` contains the messages that were accepted and not answered, in the order of sending. After `_ended`
is set no message is accepted, and `_abandon()` empties `_items`. No other message is sent between the messages of one
item. At most one renewal is unanswered.
"""
from __future__ import annotations

import secrets
import threading
import time
from concurrent.futures import Future
from typing import Any, Callable, Generic, Iterator, List, Optional, Sequence, Tuple, TypeVar, Union

import grpc

from .cluster import ClusterConnection, Reading
from .connection import Connection, Retry
from .enums import Reason
from .errors import LocusError, from_call, outcome_unknown

Result = TypeVar("Result")
AnyConnection = Union[Connection, ClusterConnection]
_MAX_HOPS = 8  # servers of a cluster that are tried in a row without a wait
# Status codes after which a new call may succeed, in addition to the codes that worth_repeating covers.
_AGAIN = (grpc.StatusCode.CANCELLED, grpc.StatusCode.INTERNAL)


class Item(Generic[Result]):
    """Message that was accepted and is not yet answered."""

    def __init__(self, batch: bytes, is_update: bool, held: Sequence[bytes] = (), is_renewal: bool = False,
                 reading: Optional[Reading] = None) -> None:
        self.reading = reading  # settings of the view of a query; None for updates, and outside of clusters
        self.batch = batch  # the encoded message without the numbers
        self.held = held  # encoded messages that are sent before `batch` and are applied with it
        self.held_sequences = range(0)
        self.held_written = 0  # number of messages of `held` that were sent on the current call
        self.refusal: Optional[LocusError] = None  # first error among the answers to `held` on the current call
        self.is_renewal = is_renewal
        self.is_update = is_update
        self.sequence = 0
        self.number = 0  # batch number of the stream's writer, if the message has an update
        self.future: "Future[Result]" = Future()
        self.written = False  # True if sent on the current call
        self.sent_before = False  # True if sent on an earlier call with the same number
        self.future.set_running_or_notify_cancel()

    def begin_again(self) -> None:
        """Marks every message as not written."""
        self.written = False
        self.held_written = 0
        self.refusal = None


class PipelinedStream(Generic[Result]):
    """Common part of UpdateStream and QueryStream. Thread-safe.

    Each message with an update carries the stream's random writer id, `writer`, and a batch number that counts up from
    1 without gaps, so that the server applies it only once. A refused update does not consume its number: the messages
    after it are numbered and sent again. If an update is refused when it is sent again after a broken connection, it may
    have been applied before: its number is uncertain, its error has no reason, and the later updates keep their numbers
    until the server answers one of them with BATCH_GAP, which shows that the uncertain number was not used.

    An item may have several messages, which the server applies as one. Its outcome is the answer to the last message, or
    the error of the first refused message. After a broken connection all of them are sent again, since the server has
    applied none.

    In a cluster, a message that a server refuses because another one leads the scene is not answered: the stream opens a
    call to that server and sends all unanswered messages again.

    Use as a context manager: the end of the `with` block waits for all answers, or cancels the stream after an
    exception.
    """

    def __init__(self, connection: AnyConnection, path: str, scene: str, max_in_flight: int, retry: Retry,
                 lease_ms: int) -> None:
        if not 0 <= lease_ms < 2**32:
            raise ValueError(f"lease_ms is {lease_ms}: give milliseconds, at most one day, or 0 for no lease")
        if max_in_flight < 1:
            raise ValueError(f"max_in_flight is {max_in_flight}: give 1 or more")
        self._connection = connection
        self._path = path
        self._scene = scene
        self._max_in_flight = max_in_flight
        self._retry = retry
        self._lease_ms = lease_ms
        self._renew_at: Optional[float] = None  # time.monotonic() at which the lease must be renewed; None = never
        # Message that ends an item of which some messages were sent when it was numbered again.
        self._group_end: Optional[bytes] = None
        self._changed = threading.Condition()
        self._items: List[Item[Result]] = []
        self._call: Any = None
        self.writer = secrets.randbelow(2**64 - 1) + 1
        self._next_batch = 1
        self._uncertain = 0  # lowest uncertain batch number; 0 = none
        self._reused_end = 0  # end of the uncertain numbers that were used again
        self._last_sequence = 0
        self._failures = 0
        self._hops = 0
        self._may_follow = False  # True if another server may answer at once
        self._moved: Optional[LocusError] = None  # error that moves the stream to another server
        self._needs_leader = True  # False if only queries are sent
        self._handing_over = 0
        self._closing = False
        self._broken_off = False
        self._fatal: Optional[LocusError] = None
        self._ended = False
        self._end: Optional[LocusError] = None
        self._thread: Optional[threading.Thread] = None

    _renewal = b""  # encoded message without numbers that renews the lease

    # Methods that a kind of stream overrides; called with the lock held, except _answer_in().

    def _number(self, item: Item[Result]) -> None:
        """Assigns the item its sequence numbers and, if it has an update, its batch number."""
        first = self._last_sequence + 1
        self._last_sequence += len(item.held) + 1
        item.held_sequences = range(first, self._last_sequence)
        item.sequence = self._last_sequence
        if item.is_update:
            item.number = self._next_batch
            self._next_batch += 1

    def _request_of(self, item: Item[Result]) -> bytes:
        """Returns the encoded request of an item."""
        raise NotImplementedError

    def _held_request(self, batch: bytes, sequence: int) -> bytes:
        """Returns the encoded request of a message of Item.held."""
        raise NotImplementedError

    def _held_answer(self, outcome: Any) -> Optional[LocusError]:
        """Returns the error if the answer to a message of Item.held shows that the server does not hold the message."""
        raise NotImplementedError

    def _set_numbers(self, batch: Any, item: Item[Result]) -> None:
        """Sets the numbers of an item with an update, and the lease, in the protocol's UpdateBatch."""
        batch.writer, batch.batch = self.writer, item.number
        if self._lease_ms:
            batch.lease_ms = self._lease_ms

    def _answer_in(self, response: bytes) -> Tuple[int, Any]:
        """Returns the sequence number of a response, and the result or LocusError that the response contains."""
        raise NotImplementedError

    def _is_duplicate(self, result: Any) -> bool:
        """Returns whether the ack in the result of an item with an update is marked as duplicate."""
        return bool(result.duplicate)

    def _answered(self, item: Item[Result], result: Any) -> None:
        """Handles the result of an item."""

    def _asks_again(self, item: Item[Result], error: LocusError) -> bool:
        """Returns True if a query must be sent again, to the leader of the scene."""
        return item.reading is not None and item.reading.turns_to_leader(error)

    def _closes_gap(self, item: Item[Result], error: LocusError) -> bool:
        """Returns True if the error of an item shows that uncertain numbers before it were not used. Such numbers are
        then used again, from the item on.
        """
        if not item.is_update or error.reason != Reason.BATCH_GAP or self._uncertain == 0:
            return False
        if not self._uncertain <= error.limit_value < item.number:
            return False
        self._reused_end = item.number
        self._next_batch = int(error.limit_value)
        self._uncertain = 0
        return True

    def _number_again(self, position: int) -> None:
        """Numbers the items from index `position` on, and sends them again."""
        for item in self._items[position:]:
            if item.held_written and not item.written:
                # End the messages that the server holds, before others are sent. The server refuses this request,
                # because its number is higher than the number of an item that is sent again.
                self._group_end = self._request_of(item)
            item.begin_again()
            item.sent_before = False
            self._number(item)

    def _update_refused(self, item: Item[Result], error: LocusError, position: int) -> LocusError:
        """Handles the error of an item with an update, and returns the error for its future. Called after the item was
        removed from index `position` of `_items`.
        """
        if not error.changed_nothing:
            # End the stream, because continuing could lose a batch: either it is unknown whether the server used the
            # batch number, or the server no longer has a record of the writer.
            self._fatal = error
            return error
        if item.sent_before:
            self._uncertain = min(self._uncertain or item.number, item.number)
            return outcome_unknown(error)
        self._next_batch = item.number
        self._number_again(position)
        return error

    def _update_applied(self, item: Item[Result], duplicate: bool) -> Optional[LocusError]:
        """Handles the ack of an item with an update. Returns an error if another batch took a number that seemed unused,
        so that the update of this item was not applied.
        """
        if duplicate and not item.sent_before and item.number < self._reused_end:
            self._fatal = LocusError(grpc.StatusCode.DATA_LOSS, "the batch was not applied: a batch that was sent before "
                                                                "took its number")
            return self._fatal
        if item.number > self._uncertain:
            self._uncertain = 0
        return None

    def _send(self, batch: bytes, is_update: bool, held: Sequence[bytes] = (),
              reading: Optional[Reading] = None) -> "Future[Any]":
        item: Item[Any] = Item(batch, is_update, held, reading=reading)
        with self._changed:
            self._changed.wait_for(
                lambda: self._ended or self._closing or len(self._items) < self._max_in_flight)
            if self._ended or self._closing:
                raise self._end or (_broken_off() if self._broken_off else LocusError(
                    grpc.StatusCode.FAILED_PRECONDITION, "the stream was closed: open a new one"))
            self._append(item)
            if self._thread is None:
                self._thread = threading.Thread(target=self._supervise, name="locus stream", daemon=True)
                self._thread.start()
        return item.future

    def _append(self, item: Item[Any]) -> None:
        self._number(item)
        self._items.append(item)
        if item.is_update:
            self._plan_renewal()
        self._changed.notify_all()

    def _plan_renewal(self) -> None:
        """Plans the next renewal of the lease, a third of the lease from now, so that it may be late or lost."""
        if self._lease_ms:
            self._renew_at = time.monotonic() + self._lease_ms / 3000

    def _wait_or_renew(self, done: Callable[[], Any]) -> None:
        """Waits until done() is true. Meanwhile renews the lease when it is due, unless the stream is closing. Called
        with the lock held.
        """
        while not done():
            planned = None if self._closing or self._ended else self._renew_at
            wait = None if planned is None else planned - time.monotonic()
            if wait is None or wait > 0:
                self._changed.wait(wait)
            else:
                self._plan_renewal()
                if self._fatal is None and not any(item.is_renewal for item in self._items):
                    self._append(Item(self._renewal, is_update=True, is_renewal=True))

    def sync(self, timeout: Optional[float] = None) -> None:
        """Blocks until every sent batch has been answered. Raises LocusError if the stream ended with an error, and
        TimeoutError after `timeout` seconds.

        An error of a single batch is not raised here, but by the future of this batch.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: not self._items and not self._handing_over, timeout):
                raise TimeoutError(f"{len(self._items)} batches were not answered within {timeout} s")
            if self._end is not None:
                raise self._end

    def close(self, timeout: Optional[float] = None) -> None:
        """Calls sync() and ends the stream. Later sends fail."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self.sync(timeout)
        if self._thread is not None:
            self._thread.join(timeout)

    def cancel(self) -> None:
        """Cancels the stream. Unanswered batches get CANCELLED, and their outcome is unknown."""
        with self._changed:
            self._closing = self._broken_off = True
            if self._call is not None:
                self._call.cancel()
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()

    def __enter__(self) -> Any:
        return self

    def __exit__(self, kind: Any, *unused: Any) -> None:
        if kind is None:
            self.close()
        else:
            self.cancel()

    def _supervise(self) -> None:
        end = None
        while self._another_call(end):
            end = self._run_call()
        self._abandon()

    def _another_call(self, end: Optional[LocusError]) -> bool:
        """Waits until a new call may be opened and there is a message to send, then returns True. Returns False if the
        stream ends before that. `end` is the error of the previous call, if any.
        """
        with self._changed:
            wait = self._wait_before_next(end) if end is not None else 0.0
            if wait is not None:
                self._changed.wait_for(lambda: self._broken_off, wait)
                self._wait_or_renew(lambda: self._items or self._closing)
            if self._broken_off:
                end = _broken_off()
            elif wait is not None and self._items:
                return True
            self._ended = True
            self._end = self._fatal or (end if wait is None or self._broken_off else None)
            if self._end is not None and not self._broken_off:
                self._end = self._connection.gave_up(self._end)
            return False

    def _run_call(self) -> Optional[LocusError]:
        """Opens a call and reads its responses to the end. Returns the error that ended the call, or None."""
        try:
            with self._connection.use(self._scene, not self._needs_leader) as connection:
                error = self._run_call_on(connection)
                error, self._moved = self._moved or error, None
                self._may_follow = error is not None and self._connection.note_end(connection, self._scene, error)
                return error
        except LocusError as unconnected:
            return unconnected

    def _run_call_on(self, connection: Connection) -> Optional[LocusError]:
        over = threading.Event()
        method = connection.channel.stream_stream(self._path)
        connection.continue_connecting()
        try:
            with self._changed:
                for item in self._items:
                    item.sent_before = item.sent_before or item.written
                    item.begin_again()
                self._group_end = None
                used, metadata = connection.metadata(self._scene)
                self._call = call = method(self._requests(over), metadata=metadata)
                if self._broken_off:
                    call.cancel()
            for response in call:
                self._receive(response)
            return self._cut_short()
        except LocusError as unreadable:
            call.cancel()
            return unreadable
        except grpc.RpcError as failure:
            error = from_call(failure)
            connection.note_failure(error)
            if error.code == grpc.StatusCode.UNAUTHENTICATED and connection.token.has_newer(used):
                return LocusError(grpc.StatusCode.UNAVAILABLE, f"the token has changed: {error.message}")
            return error
        except ValueError as failure:  # raised by gRPC for a closed channel
            return LocusError(grpc.StatusCode.FAILED_PRECONDITION, f"the client was closed: open a new one ({failure})")
        finally:
            with self._changed:
                over.set()
                self._call = None
                self._changed.notify_all()

    def _requests(self, over: threading.Event) -> Iterator[bytes]:
        """Yields the messages to send on one call, until `over` is set, or until the stream is closing and all messages
        are answered. gRPC runs this iterator in a thread of its own.
        """
        while True:
            with self._changed:
                self._wait_or_renew(lambda: over.is_set() or self._moved is not None or self._group_end is not None
                                    or self._unwritten() is not None or (self._closing and not self._items))
                message = None if over.is_set() or self._moved is not None else self._next_message()
            if message is None:
                return
            yield message

    def _next_message(self) -> Optional[bytes]:
        """Returns the next message to send on the current call, and marks it as written."""
        if self._group_end is not None:
            message, self._group_end = self._group_end, None
            return message
        item = self._unwritten()
        if item is None:
            return None
        if item.held_written < len(item.held):
            index = item.held_written
            item.held_written += 1
            return self._held_request(item.held[index], item.held_sequences[index])
        item.written = True
        return self._request_of(item)

    def _unwritten(self) -> Optional[Item[Result]]:
        return next((item for item in self._items if not item.written), None)

    def _receive(self, response: bytes) -> None:
        """Resolves the item that a response answers. A response whose sequence number no item has is ignored: its item
        was renumbered in the meantime and is sent again.
        """
        sequence, outcome = self._answer_in(response)
        with self._changed:
            position = next((index for index, item in enumerate(self._items)
                             if item.sequence == sequence or sequence in item.held_sequences), None)
            if position is None:
                return
            item = self._items[position]
            if item.sequence != sequence:
                item.refusal = item.refusal or self._held_answer(outcome)
                return
            outcome = item.refusal or outcome
            if self._moved is not None:
                return
            if isinstance(outcome, LocusError) and self._connection.moves(outcome):
                self._move(position, outcome)
                return
            self._failures = self._hops = 0
            if isinstance(outcome, LocusError) and self._asks_again(item, outcome):
                item.begin_again()
                self._changed.notify_all()
                return
            if isinstance(outcome, LocusError) and self._closes_gap(item, outcome):
                self._number_again(position)
                self._changed.notify_all()
                return
            del self._items[position]
            if isinstance(outcome, LocusError):
                if item.is_update:
                    outcome = self._update_refused(item, outcome, position)
            else:
                if item.is_update:
                    outcome = self._update_applied(item, self._is_duplicate(outcome)) or outcome
                if not isinstance(outcome, LocusError):
                    self._answered(item, outcome)
            self._handing_over += 1
            self._changed.notify_all()
            if self._fatal is not None:
                self._call.cancel()
        _resolve(item, outcome)
        with self._changed:
            self._handing_over -= 1
            self._changed.notify_all()

    def _move(self, position: int, error: LocusError) -> None:
        """Ends the call, to continue at another server, since the item at index `position` was refused with `error`."""
        self._moved = error
        refused = self._items[position]
        if refused.is_update and error.refused and not refused.sent_before:
            # The server applied neither this update nor a later one, whose number would have left a gap.
            for item in self._items[position:]:
                item.written = item.written and not item.is_update
        if refused.reading is not None and error.reason == Reason.ELSEWHERE:
            refused.reading.leader = True  # a follower that is older than the view admits
            self._needs_leader = True
        self._call.cancel()
        self._changed.notify_all()

    def _cut_short(self) -> Optional[LocusError]:
        with self._changed:
            if not self._items:
                return None
            return LocusError(grpc.StatusCode.UNAVAILABLE, "the server ended the stream before it had answered everything")

    def _wait_before_next(self, end: LocusError) -> Optional[float]:
        """Returns the seconds to wait before the next call, or None if the stream ends instead. A call that fails while
        all messages are answered does not count as a failure.
        """
        if self._broken_off or self._fatal is not None:
            return None
        if not (end.worth_repeating or (end.code in _AGAIN and not end.refused) or self._connection.moves(end)):
            return None
        if not self._items:
            return 0.0
        if self._may_follow and self._hops < _MAX_HOPS:
            self._hops += 1
            return 0.0
        self._hops = 0
        self._failures += 1
        return self._retry.wait_after(self._failures, end)

    def _abandon(self) -> None:
        """Resolves every unanswered item with the stream's error."""
        with self._changed:
            items, end = list(self._items), self._end
        for item in items:
            was_sent = item.is_update and (item.written or item.sent_before)
            if end is not None and was_sent and end.changed_nothing and self._connection.moves(end):
                _resolve(item, outcome_unknown(end))  # the server that ended the stream may not be the one it was sent to
            else:
                _resolve(item, end)
        with self._changed:
            self._items.clear()
            self._changed.notify_all()


def _broken_off() -> LocusError:
    return LocusError(grpc.StatusCode.CANCELLED, "the stream was broken off")


def _resolve(item: Item[Any], outcome: Any) -> None:
    if isinstance(outcome, LocusError):
        item.future.set_exception(outcome)
    else:
        item.future.set_result(outcome)
