"""Pipelined stream of update batches to one scene, for game servers that send one batch per tick. Each batch is applied
exactly once, even if connections break.
"""
from __future__ import annotations

from concurrent.futures import Future
from typing import Any, Optional, Tuple

from . import schema, wire
from .connection import Connection, Retry
from .errors import from_error, neither, parsed
from .pipelined_stream import Item, PipelinedStream
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
    """

    def __init__(self, connection: Connection, scene: str, max_in_flight: int, retry: Retry) -> None:
        super().__init__(connection, _METHOD.path, scene, max_in_flight, retry)
        self._last_ack: Optional[Ack] = None

    def send(self, batch: UpdateBatch) -> "Future[Ack]":
        """Sends a batch. Blocks while `max_in_flight` batches are unanswered, which slows a caller down to the rate of
        the server.

        The future receives the Ack, or the LocusError of this batch. The batch is copied, so the caller can use it
        again. The stream replaces the `writer` and `number` of the copy. Raises LocusError if the stream has ended.
        """
        return self._send(batch.message.SerializeToString(), is_update=True)

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
        numbers.batch.writer, numbers.batch.batch = self.writer, item.number
        return b"".join((wire.head(_BATCH, len(item.batch)), item.batch, numbers.SerializeToString()))

    def _answer_in(self, response: bytes) -> Tuple[int, Any]:
        message = parsed(_METHOD.response, response)
        kind = message.WhichOneof("outcome")
        if kind == "ack":
            return message.sequence, Ack.of(message.ack)
        return message.sequence, from_error(message.error) if kind else neither()

    def _answered(self, result: Any) -> None:
        self._last_ack = result
