"""The machinery under UpdateStream and QueryStream: a bidirectional call whose messages are answered under their
sequence numbers, with a bounded number under way, that comes back after a broken connection and sends again what was not
answered. Internal to the package.

One thread of its own per stream opens call after call and reads the answers; messages are written by gRPC's thread.
Invariants: `_items` holds what was accepted and not answered, in the order of sending; after `_ended` is set there are
none, and never will be.
"""
from __future__ import annotations

import threading
from concurrent.futures import Future
from typing import Any, Generic, Iterator, List, Optional, Tuple, TypeVar

import grpc

from .connection import Connection, Retry, scene_metadata
from .errors import LocusError, from_call

Result = TypeVar("Result")
_AGAIN = (grpc.StatusCode.CANCELLED, grpc.StatusCode.INTERNAL)  # ends of a call after which a new one may do better


class Item(Generic[Result]):
    """A message that was accepted and not answered."""

    def __init__(self, batch: bytes) -> None:
        self.batch = batch
        self.sequence = 0
        self.number = 0  # of the writer's batch
        self.future: "Future[Result]" = Future()
        self.written = False  # on the current call
        self.future.set_running_or_notify_cancel()


class PipelinedStream(Generic[Result]):
    """What both kinds of stream have in common; every method may be called from any thread.

    Use as a context manager: leaving it waits for all answers, or breaks off after an exception.
    """

    def __init__(self, connection: Connection, path: str, scene: str, max_in_flight: int, retry: Retry) -> None:
        if max_in_flight < 1:
            raise ValueError(f"max_in_flight is {max_in_flight}: give 1 or more")
        self._connection = connection
        self._path = path
        self._scene = scene
        self._max_in_flight = max_in_flight
        self._retry = retry
        self._changed = threading.Condition()
        self._items: List[Item[Result]] = []
        self._call: Any = None
        self._last_sequence = 0
        self._failures = 0
        self._handing_over = 0
        self._closing = False
        self._broken_off = False
        self._fatal: Optional[LocusError] = None
        self._ended = False
        self._end: Optional[LocusError] = None
        self._thread: Optional[threading.Thread] = None

    # How one kind of stream differs from another; called with the lock held.

    def _number(self, item: Item[Result]) -> None:
        """Gives a new item its sequence and other numbers."""
        self._last_sequence += 1
        item.sequence = self._last_sequence

    def _request_of(self, item: Item[Result]) -> bytes:
        """The message to send."""
        raise NotImplementedError

    def _answer_in(self, response: bytes) -> Tuple[int, Any]:
        """The sequence of a response, and its result or LocusError."""
        raise NotImplementedError

    def _answered(self, outcome: Any, position: int) -> None:
        """Called after the item at `position` was answered, by a result or a LocusError, and taken out."""

    def _send(self, batch: bytes) -> "Future[Result]":
        item: Item[Result] = Item(batch)
        with self._changed:
            self._changed.wait_for(
                lambda: self._ended or self._closing or len(self._items) < self._max_in_flight)
            if self._ended or self._closing:
                raise self._end or (_broken_off() if self._broken_off else LocusError(
                    grpc.StatusCode.FAILED_PRECONDITION, "the stream was closed: open a new one"))
            self._number(item)
            self._items.append(item)
            if self._thread is None:
                self._thread = threading.Thread(target=self._supervise, name="locus stream", daemon=True)
                self._thread.start()
            self._changed.notify_all()
        return item.future

    def sync(self, timeout: Optional[float] = None) -> None:
        """Blocks until all that was sent has been answered; refusals of single batches are in their futures.

        LocusError if the stream ended instead; TimeoutError after `timeout` seconds.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: not self._items and not self._handing_over, timeout):
                raise TimeoutError(f"{len(self._items)} batches were not answered within {timeout} s")
            if self._end is not None:
                raise self._end

    def close(self, timeout: Optional[float] = None) -> None:
        """sync(), then ends the stream. Later sends fail."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self.sync(timeout)
        if self._thread is not None:
            self._thread.join(timeout)

    def cancel(self) -> None:
        """Breaks the stream off at once; unanswered batches get CANCELLED, and their outcome is unknown."""
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
        """Waits until there is something to send after the call that ended so; False once the stream has ended."""
        with self._changed:
            wait = self._wait_before_next(end) if end is not None else 0.0
            if wait is not None:
                self._changed.wait_for(lambda: self._broken_off, wait)
                self._changed.wait_for(lambda: self._items or self._closing)
            if self._broken_off:
                end = _broken_off()
            elif wait is not None and self._items:
                return True
            self._ended = True
            self._end = self._fatal or (end if wait is None or self._broken_off else None)
            return False

    def _run_call(self) -> Optional[LocusError]:
        """Opens a call and reads its answers until it is over; how it ended, None in peace."""
        over = threading.Event()
        method = self._connection.channel.stream_stream(self._path)
        try:
            with self._changed:
                for item in self._items:
                    item.written = False
                self._call = call = method(self._requests(over), metadata=scene_metadata(self._scene))
                if self._broken_off:
                    call.cancel()
            for response in call:
                self._receive(response)
            return self._cut_short()
        except LocusError as unreadable:
            call.cancel()
            return unreadable
        except grpc.RpcError as failure:
            return from_call(failure)
        except ValueError as failure:  # what gRPC says of a closed channel
            return LocusError(grpc.StatusCode.FAILED_PRECONDITION, f"the client was closed: open a new one ({failure})")
        finally:
            with self._changed:
                over.set()
                self._call = None
                self._changed.notify_all()

    def _requests(self, over: threading.Event) -> Iterator[bytes]:
        """What one call writes, drawn by gRPC's thread."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: over.is_set() or self._unwritten() is not None
                                       or (self._closing and not self._items))
                item = self._unwritten()
                if over.is_set() or item is None:
                    return
                item.written = True
                message = self._request_of(item)
            yield message

    def _unwritten(self) -> Optional[Item[Result]]:
        return next((item for item in self._items if not item.written), None)

    def _receive(self, response: bytes) -> None:
        """Answers that nobody waits for belong to items that were numbered anew since."""
        sequence, outcome = self._answer_in(response)
        with self._changed:
            position = next((place for place, item in enumerate(self._items) if item.sequence == sequence), None)
            if position is None:
                return
            item = self._items.pop(position)
            self._failures = 0
            self._answered(outcome, position)
            self._handing_over += 1
            self._changed.notify_all()
            if self._fatal is not None:
                self._call.cancel()
        _resolve(item, outcome)
        with self._changed:
            self._handing_over -= 1
            self._changed.notify_all()

    def _cut_short(self) -> Optional[LocusError]:
        with self._changed:
            if not self._items:
                return None
            return LocusError(grpc.StatusCode.UNAVAILABLE, "the server ended the stream before it had answered everything")

    def _wait_before_next(self, end: LocusError) -> Optional[float]:
        """None: the stream has ended. An idle stream may lose its connection as often as it likes."""
        if self._broken_off or self._fatal is not None:
            return None
        if not (end.worth_repeating or (end.code in _AGAIN and not end.refused)):
            return None
        if not self._items:
            return 0.0
        self._failures += 1
        return self._retry.wait_after(self._failures, end)

    def _abandon(self) -> None:
        """Ends for good: everything that was not answered gets the stream's error."""
        with self._changed:
            items, end = list(self._items), self._end
        for item in items:
            _resolve(item, end)
        with self._changed:
            self._items.clear()
            self._changed.notify_all()


def _broken_off() -> LocusError:
    return LocusError(grpc.StatusCode.CANCELLED, "the stream was broken off")


def neither() -> LocusError:
    """For a response that holds nothing."""
    return LocusError(grpc.StatusCode.DATA_LOSS, "the server answered a batch with neither a result nor an error")


def _resolve(item: Item[Any], outcome: Any) -> None:
    if isinstance(outcome, LocusError):
        item.future.set_exception(outcome)
    else:
        item.future.set_result(outcome)
