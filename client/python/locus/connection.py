"""gRPC channel to one locusd: addresses, deadlines and retries. Internal to the package.

The methods of Connection that Client and the streams call are also those of ClusterConnection (cluster.py), which chooses a
server for each call.
"""
from __future__ import annotations

import contextlib
import dataclasses
import random
import re
import time
from typing import Any, Callable, Iterator, List, Optional, Tuple, TypeVar

import grpc

from . import schema
from .credentials import Credentials, Metadata, Token, stays_on_this_machine
from .errors import LocusError, connection_advice, from_call, outcome_unknown, parsed

DEFAULT_PORT = 7575
_MAX_CONNECTING_SECONDS = 0.1
_PROBE_SECONDS = 10.0
# Options of a channel to a member of a cluster, whose machine may vanish without a word: maximum time to connect, and
# time after which a server that does not answer pings is given up. Servers accept a ping every 5 s.
_MEMBER_OPTIONS: List[Tuple[str, object]] = [
    ("grpc.min_reconnect_backoff_ms", 1000), ("grpc.keepalive_time_ms", 6000), ("grpc.keepalive_timeout_ms", 2000),
    ("grpc.http2.max_pings_without_data", 0)]
_LEGAL_SCENE = re.compile(r"[!-~]{1,63}")
_Answer = TypeVar("_Answer")
_GREETING = schema.method("locus.v1.ServerService", "GetServer")


@dataclasses.dataclass(frozen=True)
class Retry:
    """Policy of retries with exponential backoff.

    `attempts` is the maximum number of attempts, including the first one; 1 = no retry. The wait starts at `first_wait`
    seconds and doubles up to `max_wait`, with a random variation of 20 % so that many clients do not retry
    simultaneously. If the server's error asks for a longer wait (`retry_after`), that wait is used.
    """

    attempts: int = 5
    first_wait: float = 0.1
    max_wait: float = 2.0

    def wait_after(self, failures: int, error: LocusError) -> Optional[float]:
        """Returns the seconds to wait after `failures` consecutive failures, or None if no attempt is left."""
        if failures >= self.attempts:
            return None
        wait = min(self.first_wait * 2.0 ** min(failures - 1, 20), self.max_wait)
        return max(wait * random.uniform(0.8, 1.2), error.retry_after)


def nothing_answers(addresses: str) -> LocusError:
    """Returns the error of a connection that cannot be made."""
    return LocusError(grpc.StatusCode.UNAVAILABLE,
                      f"nothing answers at {addresses}: start locusd there, or give its address")


def target_of(address: str) -> str:
    """Returns `address` as a target for gRPC. Adds the default port if the address has no port."""
    if not address:
        raise ValueError("the address is empty: give host:port or unix:/path")
    has_port = not address.endswith("]") if address.startswith("[") else ":" in address
    return address if has_port else f"{address}:{DEFAULT_PORT}"


def scene_metadata(scene: str) -> List[Tuple[str, str]]:
    """Returns the `x-scene` header, by which routers choose a server. Returns no header for a name that a header cannot
    carry; the server refuses such a name in the request.
    """
    return [("x-scene", scene)] if _LEGAL_SCENE.fullmatch(scene) else []


class Connection:
    """Owner of one gRPC channel. Thread-safe."""

    def __init__(self, address: str, *, timeout: float, long_timeout: float, max_send_bytes: int,
                 max_receive_bytes: int, retry: Retry, credentials: Credentials = Credentials(),
                 is_member: bool = False) -> None:
        self.address = target_of(address)
        self.token = Token(credentials, self.address)
        self.timeout = timeout
        self.long_timeout = long_timeout
        self.retry = retry
        self._probe: Any = None  # health check that waits for the channel to connect; see note_failure()
        options: List[Tuple[str, object]] = [
            ("grpc.max_send_message_length", max_send_bytes), ("grpc.max_receive_message_length", max_receive_bytes),
            ("grpc.use_local_subchannel_pool", 1),
            ("grpc.initial_reconnect_backoff_ms", 100), ("grpc.max_reconnect_backoff_ms", 2000)]
        if stays_on_this_machine(self.address):  # a proxy set in the environment cannot reach this host's loopback
            options.append(("grpc.enable_http_proxy", 0))
        if is_member:
            options += _MEMBER_OPTIONS
        self.channel = credentials.channel(self.address, options)

    def close(self) -> None:
        """Closes the channel and cancels every call on it."""
        self.channel.close()

    def metadata(self, scene: str = "") -> Tuple[int, Metadata]:
        """Returns the number of the token and the metadata of a call: the token and the scene."""
        number, authorization = self.token.metadata()
        return number, authorization + scene_metadata(scene)

    def note_failure(self, error: LocusError) -> None:
        """Notes the failure of a call. If the call did not reach the server, starts a health check that waits until the
        channel is connected.

        gRPC continues an attempt to connect only while a call waits, or every 5 s, and calls on a channel whose last
        attempt failed return immediately. Without the health check, all calls could fail for 15 s after the server has
        returned.
        """
        if error.code != grpc.StatusCode.UNAVAILABLE or error.refused:
            return
        if self._probe is not None and not self._probe.done():
            return
        try:
            self._probe = self.channel.unary_unary("/grpc.health.v1.Health/Check").future(
                b"", timeout=_PROBE_SECONDS, wait_for_ready=True, metadata=self.metadata()[1])
        except (ValueError, OSError):  # the channel is closed, or the token cannot be read
            self._probe = None

    def continue_connecting(self, seconds: float = _MAX_CONNECTING_SECONDS) -> None:
        """Waits at most 0.1 s, and at most `seconds`, for the health check that note_failure() started. Called before
        each call.
        """
        probe = self._probe
        if probe is None:
            return
        try:
            probe.exception(timeout=max(0.0, min(seconds, _MAX_CONNECTING_SECONDS)))
        except grpc.FutureTimeoutError:
            return
        except grpc.FutureCancelledError:  # the channel was closed
            pass
        self._probe = None

    def greet(self, wait_for_server: bool, timeout: Optional[float] = None) -> None:
        """Calls GetServer, so that connect() fails with a clear message if the address is wrong."""
        call = self.channel.unary_unary(_GREETING.path)
        try:
            _, metadata = self.metadata()
            call(b"", timeout=self.timeout if timeout is None else timeout, wait_for_ready=wait_for_server,
                 metadata=metadata)
        except grpc.RpcError as failure:
            error = from_call(failure)
            if error.code == grpc.StatusCode.PERMISSION_DENIED:  # the server answers, and other calls may be permitted
                return
            silent = error.code in (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED)
            if error.refused or connection_advice(error.message) or not silent:
                raise error from None
            raise nothing_answers(self.address) from None

    @contextlib.contextmanager
    def use(self, scene: str, reads: bool) -> Iterator["Connection"]:
        """Returns the connection for a stream to a scene. `reads`: the stream has queries only."""
        yield self

    def note_end(self, used: "Connection", scene: str, error: LocusError) -> bool:
        """Notes the error that ended a call of a stream. Returns True if another server may answer at once."""
        return False

    def moves(self, error: LocusError) -> bool:
        """Returns True if a message that was answered by this error must be sent to another server."""
        return False

    def reading(self, scene: str, names_revision: bool, leader_only: bool) -> None:
        """Returns the settings that are added to the view of a query: none."""

    def saw(self, scene: str, ack: Any) -> None:
        """Notes the ack of an update."""

    def forget(self, scene: str) -> None:
        """Notes that a scene was deleted."""

    def gave_up(self, error: LocusError) -> LocusError:
        """Returns the error of a stream whose last attempt to open a call failed with `error`."""
        return error

    def transfer(self, attempt: Callable[["Connection", float], _Answer]) -> _Answer:
        """Runs a transfer of a mesh: calls attempt(connection, timeout in seconds)."""
        self.continue_connecting()
        try:
            return attempt(self, self.long_timeout)
        except grpc.RpcError as failure:
            error = from_call(failure)
            self.note_failure(error)
            raise error from None

    def unary(self, rpc: schema.Method, request: Any, *, scene: str = "", repeat: bool = False,
              timeout: Optional[float] = None, route: str = "") -> Any:
        """Calls a unary rpc with a message and returns the response message. `repeat`: the call is idempotent and may
        be retried. `route`: scene by which a cluster chooses the server, if it is not `scene`.
        """
        raw = self.unary_bytes(rpc.path, request.SerializeToString(), scene=scene, repeat=repeat, timeout=timeout)
        return parsed(rpc.response, raw)

    def query_bytes(self, path: str, request: bytes, scene: str, names_revision: bool, leader_only: bool) -> bytes:
        """Runs an encoded query. The last two arguments describe its view, for clusters."""
        return self.unary_bytes(path, request, scene=scene, repeat=True)

    def unary_bytes(self, path: str, request: bytes, *, scene: str = "", repeat: bool = False,
                    timeout: Optional[float] = None, is_update: bool = False) -> bytes:
        """Calls a unary rpc with an encoded request and returns the encoded response. `is_update`: the request applies
        an update; if a retry is refused, the outcome is unknown. The other arguments are those of unary().
        """
        call = self.channel.unary_unary(path)
        deadline = time.monotonic() + (self.timeout if timeout is None else timeout)

        used = 0
        lost = False  # True if the outcome of an attempt is unknown

        def attempt() -> bytes:
            nonlocal used, lost
            self.continue_connecting(deadline - time.monotonic())
            used, metadata = self.metadata(scene)
            try:
                return bytes(call(request, timeout=max(0.0, deadline - time.monotonic()), metadata=metadata))
            except grpc.RpcError as failure:
                error = from_call(failure)
                lost = lost or not (error.changed_nothing or error.code == grpc.StatusCode.UNAUTHENTICATED)
                raise

        def attempts() -> bytes:
            try:
                return self._attempts(attempt, deadline if repeat else None)
            except LocusError as error:
                if is_update and lost and error.changed_nothing:
                    raise outcome_unknown(error) from None
                raise

        try:
            return attempts()
        except LocusError as error:
            # A server that refuses the token has done nothing, so every call may be repeated.
            if error.code != grpc.StatusCode.UNAUTHENTICATED or not self.token.has_newer(used):
                raise
        return attempts()

    def _attempts(self, attempt: Callable[[], _Answer], deadline: Optional[float]) -> _Answer:
        failures = 0
        while True:
            try:
                return attempt()
            except grpc.RpcError as failure:
                failures += 1
                error = from_call(failure)
                self.note_failure(error)
                wait = self.retry.wait_after(failures, error) if deadline and error.worth_repeating else None
                if wait is None or deadline is None or time.monotonic() + wait >= deadline:
                    raise error from None
            time.sleep(wait)
