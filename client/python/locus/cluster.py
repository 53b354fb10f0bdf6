"""Connections to the servers of a cluster: each call goes to the server that leads or follows its scene, and to another
one if that fails. Has the methods of Connection that Client and the streams call. Internal to the package.
"""
from __future__ import annotations

import contextlib
import threading
import time
from typing import Any, Callable, Dict, Iterator, Optional, Sequence, TypeVar

import grpc

from . import schema, wire
from .connection import Connection, Retry, nothing_answers, target_of
from .enums import Reason
from .errors import LocusError, from_call, outcome_unknown, parsed
from .routes import ReadFrom, Routes
from .values import Placement, Revision

_MAX_CONNECTIONS = 64
_MAX_HOPS = 8  # calls of other servers in a row without a wait
_READERS_TIMEOUT = 0.5
_GREET_PAUSE = 0.1
_GET_SCENE = schema.method("locus.v1.SceneService", "GetScene")
_QUERY = schema.message("QueryRequest")
_RESULT_IN_RESPONSE = schema.numbers("QueryResponse")["result"]
_RESULT = schema.numbers("QueryResult")
# Reasons of a server that has done nothing, while another one, or the same one later, may do it.
_ELSEWHERE = (Reason.ELSEWHERE, Reason.NO_LEADER, Reason.DRAINING, Reason.RECOVERING)
_LOST = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.CANCELLED)
_Answer = TypeVar("_Answer")


class Reading:
    """Choice of the server and of the revision for one query. Used by one thread at a time.

    The view of the query gets the highest revision that was seen of the scene, as the minimum, unless it names a
    revision itself. If a follower cannot answer so, the leader is asked.
    """

    def __init__(self, routes: Routes, scene: str, names_revision: bool, leader: bool) -> None:
        self._routes = routes
        self._scene = scene
        self._uses_floor = not names_revision
        self._floor: Optional[Revision] = None
        self.leader = leader

    def write(self, view: Any) -> None:
        """Sets what the protocol's View of the query must contain."""
        self._floor = self._routes.floor(self._scene) if self._uses_floor else None
        if self._floor is not None:
            view.at_least, view.epoch = self._floor.revision, self._floor.epoch
        if self.leader:
            view.leader_only = True

    def turns_to_leader(self, error: LocusError) -> bool:
        """Returns True if the query must be asked again, of the leader, because a follower has not reached the revision
        that this client has seen, or because the scene has another epoch, which only the leader can tell.
        """
        if error.reason == Reason.SCENE_RESTARTED and self._floor is not None:
            self._uses_floor = False
        elif self.leader or error.code != grpc.StatusCode.DEADLINE_EXCEEDED or error.refused:
            return False
        self.leader = True
        return True

    def answered(self, revision: Revision) -> None:
        """Notes the revision of the answer."""
        self._routes.saw(self._scene, revision.epoch, revision.revision, self.leader)


class ClusterConnection:
    """Thread-safe. `connect` opens a connection to an address. `timeout`, `long_timeout` and `retry` are those of
    connect().
    """

    def __init__(self, addresses: Sequence[str], connect: Callable[[str], Connection], *, timeout: float,
                 long_timeout: float, retry: Retry, read_from: ReadFrom) -> None:
        self._connect = connect
        self._lock = threading.Lock()
        self._connections: Dict[str, Connection] = {}  # the least recently used first
        self._users: Dict[str, int] = {}
        self._closed = False
        self._read_from = read_from
        self.timeout = timeout
        self.long_timeout = long_timeout
        self.retry = retry
        try:
            for address in dict.fromkeys(map(target_of, addresses)):
                self._connections[address] = connect(address)
                self._users[address] = 1  # never closed to make room
        except BaseException:
            self.close()
            raise
        self.routes = Routes(tuple(self._connections))

    @property
    def address(self) -> str:
        """The given addresses, joined by commas."""
        return ",".join(self.routes.given)

    def close(self) -> None:
        """Closes every connection."""
        with self._lock:
            self._closed = True
            connections = list(self._connections.values())
        for connection in connections:
            connection.close()

    def greet(self, wait_for_server: bool) -> None:
        """Calls GetServer at one server after another until one answers."""
        deadline = time.monotonic() + self.timeout
        while True:
            for address in self.routes.given:
                try:
                    with self._using(address) as connection:
                        connection.greet(False, max(0.0, min(deadline - time.monotonic(), self.timeout / 3)))
                    self.routes.answered(address)
                    return
                except LocusError as error:
                    if error.code not in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED):
                        raise
                    self.routes.failed(address)
                    last = error
            if not wait_for_server or time.monotonic() + _GREET_PAUSE >= deadline:
                raise nothing_answers(self.address) if not last.refused and "nothing answers" in last.message else last
            time.sleep(_GREET_PAUSE)

    # Calls.

    def unary(self, rpc: schema.Method, request: Any, *, scene: str = "", repeat: bool = False,
              timeout: Optional[float] = None, route: str = "") -> Any:
        """Calls a unary rpc with a message and returns the response message. The arguments are those of
        Connection.unary().
        """
        raw = self.unary_bytes(rpc.path, request.SerializeToString(), scene=scene, repeat=repeat, timeout=timeout,
                               route=route)
        return parsed(rpc.response, raw)

    def unary_bytes(self, path: str, request: bytes, *, scene: str = "", repeat: bool = False,
                    timeout: Optional[float] = None, is_update: bool = False, route: str = "") -> bytes:
        """Calls a unary rpc with an encoded request and returns the encoded response. A call that a server refused
        because another one leads the scene has changed nothing and is repeated, even without `repeat`.
        """

        def attempt(connection: Connection, seconds: float) -> bytes:
            return connection.unary_bytes(path, request, scene=scene, timeout=seconds)

        return self._run(route or scene, attempt, timeout=self.timeout if timeout is None else timeout, repeat=repeat,
                         is_update=is_update)

    def query_bytes(self, path: str, request: bytes, scene: str, names_revision: bool, leader_only: bool) -> bytes:
        """Runs an encoded query at a server that `read_from` admits, at a revision not below those seen before."""
        reading = self.reading(scene, names_revision, leader_only)

        def attempt(connection: Connection, seconds: float) -> bytes:
            more = _QUERY()
            reading.write(more.batch.view)
            # A follower may wait for the revision as long as the call may take: leave time to ask the leader.
            seconds = seconds if reading.leader else seconds / 2
            return connection.unary_bytes(path, request + more.SerializeToString(), scene=scene, timeout=seconds)

        response = self._run(scene, attempt, timeout=self.timeout, repeat=True, reading=reading)
        result = wire.fields(wire.column(wire.fields(memoryview(response)), _RESULT_IN_RESPONSE))
        reading.answered(Revision(wire.fixed64(result, _RESULT["epoch"]), wire.fixed64(result, _RESULT["revision"])))
        return response

    def transfer(self, attempt: Callable[[Connection, float], _Answer]) -> _Answer:
        """Runs a transfer of a mesh, which is safe to repeat: calls attempt(connection, timeout in seconds)."""

        def one(connection: Connection, seconds: float) -> _Answer:
            try:
                return attempt(connection, seconds)
            except grpc.RpcError as failure:
                raise from_call(failure) from None

        return self._run("", one, timeout=self.long_timeout, repeat=True)

    def _run(self, scene: str, attempt: Callable[[Connection, float], _Answer], *, timeout: float, repeat: bool,
             is_update: bool = False, reading: Optional[Reading] = None) -> _Answer:
        began = time.monotonic()
        failures = hops = 0
        lost = False  # True if the outcome of an attempt is unknown
        while True:
            address = self._address(scene, reading)
            try:
                with self._using(address) as connection:
                    answer = attempt(connection, max(0.0, began + timeout - time.monotonic()))
                self.routes.answered(address)
                return answer
            except LocusError as caught:
                error = caught
            lost = lost or not (error.changed_nothing or error.not_sent
                                or error.code == grpc.StatusCode.UNAUTHENTICATED)
            follow = self._note(scene, address, error, reading)
            left = began + timeout - time.monotonic()
            if reading is not None and left > 0 and reading.turns_to_leader(error):
                continue
            changed_nothing = repeat or error.refused or error.not_sent
            if not (self.moves(error) and changed_nothing) and not (repeat and error.worth_repeating):
                raise outcome_unknown(error) if is_update and lost and error.changed_nothing else error
            if reading is not None and error.reason == Reason.ELSEWHERE:
                reading.leader = True
            wait: Optional[float] = 0.0
            if follow and hops < _MAX_HOPS:
                hops += 1
            else:
                hops, failures = 0, failures + 1
                wait = self.retry.wait_after(failures, error)
            if wait is None or wait >= left:
                error = self.gave_up(error)
                raise outcome_unknown(error) if is_update and lost and error.changed_nothing else error
            time.sleep(wait)

    # Streams.

    @contextlib.contextmanager
    def use(self, scene: str, reads: bool) -> Iterator[Connection]:
        """Returns the connection for the next call of a stream to a scene. `reads`: the stream has queries only."""
        reading = self.reading(scene, False, False) if reads else None
        with self._using(self._address(scene, reading)) as connection:
            yield connection

    def note_end(self, used: Connection, scene: str, error: LocusError) -> bool:
        """Notes the error that ended a call of a stream. Returns True if another server may answer at once."""
        return self._note(scene, used.address, error, None)

    def moves(self, error: LocusError) -> bool:
        """Returns True if a request that was answered by this error may succeed at another server, or later. A server that
        ends cancels calls.
        """
        return error.reason in _ELSEWHERE or (error.code in _LOST and not error.refused)

    def reading(self, scene: str, names_revision: bool, leader_only: bool) -> Reading:
        """Returns the choice of the server and of the revision for a query."""
        return Reading(self.routes, scene, names_revision, leader_only or self._read_from is ReadFrom.LEADER)

    def saw(self, scene: str, ack: Revision) -> None:
        """Notes the ack of an update."""
        self.routes.saw(scene, ack.epoch, ack.revision, from_leader=True)

    def forget(self, scene: str) -> None:
        """Notes that a scene was deleted."""
        self.routes.forget(scene)

    def gave_up(self, error: LocusError) -> LocusError:
        """Returns the error of a call or stream whose last attempt failed with `error`. It keeps code and reason."""
        if not self.moves(error):
            return error
        return LocusError(error.code, f"{error.message}; tried at {', '.join(self.routes.addresses)}: check that these "
                          "servers run and that their PostgreSQL answers (Client.server().cluster shows both), or "
                          "allow more time (timeout, retry, reconnect)", reason=error.reason, field=error.field,
                          retry_after=error.retry_after, addresses=error.addresses, token=error.token)

    # Servers.

    def _note(self, scene: str, address: str, error: LocusError, reading: Optional[Reading]) -> bool:
        """Notes what an error says of servers. Returns True if the next call goes to another server that may answer."""
        if error.reason == Reason.ELSEWHERE:
            self.routes.answered(address)
            self.routes.elsewhere(scene, address, error.addresses, error.token)
            if reading is not None and not reading.leader:
                self.routes.forget_readers(scene)
        elif error.reason == Reason.NO_LEADER:
            self.routes.answered(address)
            self.routes.has_no_leader(scene, address, error.retry_after)
        elif error.reason == Reason.NOT_FOUND:
            self.routes.forget_leader(scene)
        elif self.moves(error):
            self.routes.failed(address)
        reads = reading is not None and not reading.leader and error.reason != Reason.ELSEWHERE
        following = (self.routes.reader(scene) if reads else None) or self.routes.next(scene)
        return following != address and self.routes.would_answer(following)

    def _address(self, scene: str, reading: Optional[Reading]) -> str:
        if reading is None or reading.leader:
            return self.routes.next(scene)
        reader = self.routes.reader(scene)
        if reader is None:
            self.routes.set_readers(scene, self._placement(scene), self._read_from)
            reader = self.routes.reader(scene)
        return reader if reader and self.routes.would_answer(reader) else self.routes.next(scene)

    def _placement(self, scene: str) -> Optional[Placement]:
        """Returns who leads and follows a scene; None if its leader does not answer soon."""

        def attempt(connection: Connection, seconds: float) -> Any:
            raw = connection.unary_bytes(_GET_SCENE.path, _GET_SCENE.request(name=scene).SerializeToString(),
                                         scene=scene, timeout=seconds)
            return parsed(_GET_SCENE.response, raw).scene

        try:
            found = self._run(scene, attempt, timeout=_READERS_TIMEOUT, repeat=True)
        except LocusError:
            return None
        return Placement.of(found.placement) if found.HasField("placement") else None

    @contextlib.contextmanager
    def _using(self, address: str) -> Iterator[Connection]:
        """Opens the connection to an address, and keeps it open at least until the end of the block."""
        connection = self._open(address)
        try:
            yield connection
        finally:
            with self._lock:
                self._users[connection.address] -= 1
                if not self._users[connection.address]:
                    del self._users[connection.address]

    def _open(self, address: str) -> Connection:
        with self._lock:
            if self._closed:
                raise LocusError(grpc.StatusCode.FAILED_PRECONDITION, "the client was closed: open a new one")
            connection = self._connections.pop(address, None)
            if connection is None:
                self._make_room()
                connection = self._connected(address)
            self._connections[connection.address] = connection
            self._users[connection.address] = self._users.get(connection.address, 0) + 1
            return connection

    def _make_room(self) -> None:
        if len(self._connections) < _MAX_CONNECTIONS:
            return
        idle = next((address for address in self._connections if address not in self._users), None)
        if idle is None:
            raise LocusError(grpc.StatusCode.RESOURCE_EXHAUSTED, f"this client has connections to {_MAX_CONNECTIONS} "
                             "servers, all in use: close streams, or use a second client")
        self._connections.pop(idle).close()

    def _connected(self, address: str) -> Connection:
        try:
            return self._connect(address)
        except ValueError as error:
            raise LocusError(grpc.StatusCode.FAILED_PRECONDITION, f"the server at {address} has the scene, but this "
                             f"client does not connect there: {error}") from None
