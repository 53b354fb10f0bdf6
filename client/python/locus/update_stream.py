"""Pipelined stream of update batches to one scene, for game servers that send one batch per tick. Each batch is applied
exactly once, even if connections break.
"""
from __future__ import annotations

from concurrent.futures import Future
from typing import Any, Optional, Sequence, Tuple

import grpc

from . import schema, wire
from .connection import Retry
from .errors import LocusError, from_error, neither, parsed
from .pipelined_stream import AnyConnection, Item, PipelinedStream
from .updates import UpdateBatch
from .values import Ack, Revision

_METHOD = schema.method("locus.v1.UpdateService", "StreamUpdates")
_BATCH = _METHOD.request.DESCRIPTOR.fields_by_name["batch"].number


class UpdateStream(PipelinedStream[Ack]):
    """Stream returned by Client.update_stream(). Thread-safe.

    Each batch carries the stream's random writer id, `writer`, and a batch number that counts up from 1 without gaps.
    After a broken connection every batch without an ack is sent again, in order; the ack of a batch that the server had
    already applied has `duplicate` set. A refused batch does not consume its number: the batches after it are
    renumbered and sent again. If a batch is refused when it is sent again, it may have been applied before: its error
    then has no reason and says so. The stream ends if the server refuses the whole stream, if the server no longer knows
    the writer (the scene has a new epoch), if a batch fails with an error without a reason, or if reconnecting fails as
    often as `reconnect` allows. The future of every unanswered batch then raises the LocusError with which the stream
    ended; the outcome of these batches is unknown.

    In a cluster, the stream goes to the server that leads the scene, and to the next leader if that server is lost or hands
    the scene over; no batch is lost or applied twice.

    With `lease_ms`, the server removes the objects that the stream inserted when no batch of the stream has arrived for
    that long. The lease begins with the first batch. While the caller sends nothing, the stream renews the lease by empty
    batches, a third of the lease apart, so the objects stay as long as the stream is open, however silent the caller is.
    The lease runs out after the stream or its process has ended, and while the server cannot be reached.
    """

    def __init__(self, connection: AnyConnection, scene: str, max_in_flight: int, retry: Retry, lease_ms: int) -> None:
        super().__init__(connection, _METHOD.path, scene, max_in_flight, retry, lease_ms)
        self._last_ack: Optional[Ack] = None

    def send(self, batch: UpdateBatch) -> "Future[Ack]":
        """Sends a batch. Blocks while `max_in_flight` batches are unanswered, which slows a caller down to the rate of
        the server.

        The future receives the Ack, or the LocusError of this batch. The batch is copied, so the caller can use it
        again. The stream replaces the `writer` and `number` of the copy. Raises LocusError if the stream has ended.
        """
        return self._send(batch.message.SerializeToString(), is_update=True)

    def send_together(self, batches: Sequence[UpdateBatch]) -> "Future[Ack]":
        """Sends several batches that become one revision: nothing of them is visible before the last is applied, and
        none is applied if one is refused. For changes that are too large for one message.

        The batches are applied in the order given. Only the last may have a `tick`, `all_or_nothing` or `lease_ms`,
        which then hold for all. Counts as one batch: there is one Ack, whose ItemError.message is an index into
        `batches`, and after a broken connection all are sent again. Otherwise like send(). Raises ValueError if
        `batches` is empty.
        """
        if not batches:
            raise ValueError("send_together: give at least one batch")
        *held, last = [batch.message.SerializeToString() for batch in batches]
        return self._send(last, is_update=True, held=held)

    @property
    def last_ack(self) -> Optional[Revision]:
        """Revision of the latest ack; None before the first ack. A query with `at_least=last_ack` sees every batch
        acked so far.
        """
        with self._changed:
            return self._last_ack

    def _request_of(self, item: Item[Ack]) -> bytes:
        # Write the field `batch` twice: first with the columns, then with writer and batch number. Protobuf parsers
        # merge two occurrences of a field that is a message.
        numbers = _METHOD.request(scene=self._scene, sequence=item.sequence)
        self._set_numbers(numbers.batch, item)
        return b"".join((wire.head(_BATCH, len(item.batch)), item.batch, numbers.SerializeToString()))

    def _held_request(self, batch: bytes, sequence: int) -> bytes:
        settings = _METHOD.request(scene=self._scene, sequence=sequence)
        settings.batch.continues = True
        return b"".join((wire.head(_BATCH, len(batch)), batch, settings.SerializeToString()))

    def _held_answer(self, outcome: Any) -> Optional[LocusError]:
        if isinstance(outcome, LocusError):
            return outcome
        return None if outcome.pending else LocusError(
            grpc.StatusCode.UNIMPLEMENTED, "the server does not hold messages (`continues`): it applied one that is a "
                                           "part of a batch")

    def _answer_in(self, response: bytes) -> Tuple[int, Any]:
        message = parsed(_METHOD.response, response)
        kind = message.WhichOneof("outcome")
        if kind == "ack":
            return message.sequence, Ack.of(message.ack)
        return message.sequence, from_error(message.error) if kind else neither()

    def _answered(self, item: Item[Ack], result: Any) -> None:
        self._last_ack = result
        self._connection.saw(self._scene, result)
