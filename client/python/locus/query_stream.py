"""Pipelined stream of query batches to one scene, for callers that query every tick. Answers may arrive in any order;
the stream assigns each answer to its batch by the sequence number.
"""
from __future__ import annotations

from concurrent.futures import Future
from typing import Any, Tuple

from . import schema, wire
from .connection import Connection, Retry
from .errors import from_error, parsed
from .pipelined_stream import Item, PipelinedStream, neither
from .queries import QueryBatch
from .results import QueryResult

_METHOD = schema.method("locus.v1.QueryService", "StreamQueries")
_BATCH = _METHOD.request.DESCRIPTOR.fields_by_name["batch"].number
_SEQUENCE, _RESULT, _ERROR = (_METHOD.response.DESCRIPTOR.fields_by_name[name].number
                              for name in ("sequence", "result", "error"))


class QueryStream(PipelinedStream[QueryResult]):
    """Stream returned by Client.query_stream(). Thread-safe. After a broken connection, unanswered batches are sent
    again on a new connection, which is safe since queries change nothing.
    """

    def __init__(self, connection: Connection, scene: str, max_in_flight: int, retry: Retry) -> None:
        super().__init__(connection, _METHOD.path, scene, max_in_flight, retry)

    def send(self, batch: QueryBatch) -> "Future[QueryResult]":
        """Sends a batch. Blocks while `max_in_flight` batches are unanswered.

        The future receives the result, or the LocusError of this batch. The batch is encoded before send() returns, so
        the caller can use it again. Raises LocusError if the stream has ended. To keep a local server busy, 8 batches
        of 1,024 queries in flight are enough, or 2 batches of 8,192.
        """
        return self._send(batch.batch_bytes())

    def _request_of(self, item: Item[QueryResult]) -> bytes:
        numbers = _METHOD.request(scene=self._scene, sequence=item.sequence).SerializeToString()
        return b"".join((numbers, wire.head(_BATCH, len(item.batch)), item.batch))

    def _answer_in(self, response: bytes) -> Tuple[int, Any]:
        found = wire.fields(memoryview(response))
        sequence = wire.fixed64(found, _SEQUENCE)
        if _RESULT in found:
            return sequence, QueryResult.of(wire.column(found, _RESULT))
        return sequence, from_error(parsed(_METHOD.response, response).error) if _ERROR in found else neither()
