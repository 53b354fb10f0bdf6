"""Pipelined stream of query batches to one scene, and of steps: an update with queries that see it. For callers that
query every tick. Answers may arrive in any order; the stream assigns each answer to its batch by the sequence number.
"""
from __future__ import annotations

from concurrent.futures import Future
from typing import Any, Tuple

from . import schema, wire
from .connection import Retry
from .errors import from_error, neither, parsed
from .pipelined_stream import AnyConnection, Item, PipelinedStream
from .queries import QueryBatch
from .results import QueryResult, StepResult
from .updates import UpdateBatch

_METHOD = schema.method("locus.v1.QueryService", "StreamQueries")
_BATCH, _UPDATE = (_METHOD.request.DESCRIPTOR.fields_by_name[name].number for name in ("batch", "update"))
_SEQUENCE, _RESULT, _ERROR, _ACK = (_METHOD.response.DESCRIPTOR.fields_by_name[name].number
                                    for name in ("sequence", "result", "error", "ack"))


class QueryStream(PipelinedStream[Any]):
    """Stream returned by Client.query_stream(). Thread-safe. After a broken connection, unanswered batches are sent
    again on a new connection. This is safe, because queries change nothing, and the server applies the update of a step
    only once. The stream ends in the same cases as an UpdateStream, and renews its lease like one. In
    a cluster, a stream of queries goes to a server that `read_from` of connect() admits, and one with steps to the leader.
    """

    def __init__(self, connection: AnyConnection, scene: str, max_in_flight: int, retry: Retry, lease_ms: int) -> None:
        super().__init__(connection, _METHOD.path, scene, max_in_flight, retry, lease_ms)
        self._needs_leader = False

    def send(self, batch: QueryBatch) -> "Future[QueryResult]":
        """Sends a batch. Blocks while `max_in_flight` batches are unanswered.

        The future receives the result, or the LocusError of this batch. The batch is encoded before send() returns, so
        the caller can use it again. Raises LocusError if the stream has ended. To keep a local server busy, 8 batches
        of 1,024 queries in flight are enough, or 2 batches of 8,192.
        """
        pieces = batch.batch_bytes()
        reading = self._connection.reading(self._scene, batch.names_revision, batch.leader_only)
        self._needs_leader = self._needs_leader or batch.leader_only
        return self._send(wire.head(_BATCH, len(pieces)) + pieces, is_update=False, reading=reading)

    def step(self, update: UpdateBatch, queries: QueryBatch) -> "Future[StepResult]":
        """Sends a step: the server applies `update`, then answers `queries` at a revision that contains it. Otherwise
        like send().

        The future receives the StepResult, or the LocusError with which the step was refused; if the error has a reason,
        nothing was changed and no query was run. Steps are applied in the order sent. The stream replaces the `writer`
        and `number` of the sent copy of the update.
        """
        self._needs_leader = True  # from the next call on, if the current one is to a follower, which refuses the step
        changes, batch = update.message.SerializeToString(), queries.batch_bytes()
        return self._send(b"".join((wire.head(_UPDATE, len(changes)), changes, wire.head(_BATCH, len(batch)), batch)),
                          is_update=True)

    def _request_of(self, item: Item[Any]) -> bytes:
        numbers = _METHOD.request(scene=self._scene, sequence=item.sequence)
        if item.is_update:
            # This is the second occurrence of the field `update`. Protobuf parsers merge the two.
            self._set_numbers(numbers.update, item)
        elif item.reading is not None:
            item.reading.write(numbers.batch.view)
        return b"".join((item.batch, numbers.SerializeToString()))

    def _is_duplicate(self, result: Any) -> bool:
        return isinstance(result, StepResult) and result.ack.duplicate

    def _answered(self, item: Item[Any], result: Any) -> None:
        if item.reading is not None:
            item.reading.answered(result)
        elif item.is_update:
            self._connection.saw(self._scene, result.ack if isinstance(result, StepResult) else result)

    def _answer_in(self, response: bytes) -> Tuple[int, Any]:
        found = wire.fields(memoryview(response))
        sequence = wire.fixed64(found, _SEQUENCE)
        if _ACK in found:
            return sequence, StepResult.of(found, _ACK, _RESULT, _ERROR)
        if _RESULT in found:
            return sequence, QueryResult.of(wire.column(found, _RESULT))
        return sequence, from_error(parsed(_METHOD.response, response).error) if _ERROR in found else neither()
