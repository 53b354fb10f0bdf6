"""LocusError: the exception for refused requests and failed calls, with the details that the server sent."""
from __future__ import annotations

from typing import Any, Optional, Tuple

import grpc

from . import schema
from .enums import Reason

_Status, _Error = schema.message("Status"), schema.message("Error")
_CODES = {code.value[0]: code for code in grpc.StatusCode}
_ERROR_TYPE = "type.googleapis.com/locus.v1.Error"

# Hints for errors that did not come from the server. The server's own error messages need no hint, because they already
# suggest a remedy.
_HINTS = {
    grpc.StatusCode.UNAVAILABLE: "try again when the server answers",
    grpc.StatusCode.DEADLINE_EXCEEDED: "give it more time (timeout); a change may have been made all the same",
    grpc.StatusCode.RESOURCE_EXHAUSTED: "a message is larger than its receiver takes: split the batch, or raise "
                                        "max_receive_bytes",
    grpc.StatusCode.UNIMPLEMENTED: "is this a locus server, and new enough? Client.server() says which",
    grpc.StatusCode.UNAUTHENTICATED: "give a valid token (token, token_file) or a client certificate (cert, key)",
    grpc.StatusCode.PERMISSION_DENIED: "ask the operator of the server for the right to do this",
}

# Pairs (symptom, advice) for connections that cannot be established. The advice applies if gRPC's message contains the
# symptom. The first pair that matches is used.
_ON_CONNECTIONS = (
    (": Permission denied", "permission denied: the socket's file admits other users only; the server's operator can set "
                            "--unix-mode and --unix-owner"),
    ("wrong version number", "the server does not use TLS: connect without it"),
    ("certificate verify failed", "the server's certificate does not come from a known authority, or has expired: give "
                                  "the CA file of the server's operator (ca)"),
    ("is not in peer certificate", "the server's certificate is for other names: use the name in the certificate as "
                                   "address or as server_name"),
    ("Ssl handshake failed", "the server and this client do not agree on TLS: compare their certificates and CA files"),
    ("DNS resolution failed", "the name of the server is unknown here: correct it, or add it to DNS or to /etc/hosts of "
                              "this machine"),
    ("failed to connect to all addresses; last error: UNAVAILABLE", "the server ended the connection at once: it may "
     "require TLS, or a client certificate that it knows"),
)

# Beginnings of gRPC's messages about calls that were never sent.
_NOT_CONNECTED = ("failed to connect to all addresses", "DNS resolution failed")


def connection_advice(message: str) -> str:
    """Returns advice if the connection was not permitted, the server's name is unknown, or TLS failed. Returns an empty
    string for other messages.
    """
    return next((remedy for symptom, remedy in _ON_CONNECTIONS if symptom in message), "")


class LocusError(Exception):
    """Failure of a call, a batch or a stream.

    `code` is the gRPC status code. If the server refused the request, `reason` is its reason, `field` the path of the
    wrong field (`blocks[2].rays.directions`) and `index` the wrong entry, from 0. If a limit was exceeded, `limit` is
    its name, `limit_value` its value and `asked` the requested value. `retry_after` is the time in seconds after which
    the same request may succeed; 0 = the server stated no time. With Reason.ELSEWHERE, `addresses` names the servers of
    the cluster that have the scene, its leader first, and `token` is the number of that leadership, which is higher for
    a newer leader. If the error did not come from the server, `reason` is UNSPECIFIED, and `hint` suggests a remedy if
    one is known.
    """

    def __init__(self, code: grpc.StatusCode, message: str, *, reason: Reason = Reason.UNSPECIFIED, field: str = "",
                 index: Optional[int] = None, limit: str = "", limit_value: float = 0, asked: float = 0,
                 retry_after: float = 0, addresses: Tuple[str, ...] = (), token: int = 0) -> None:
        super().__init__(code, message)
        self.code = code
        self.message = message
        self.reason = reason
        self.field = field
        self.index = index
        self.limit = limit
        self.limit_value = limit_value
        self.asked = asked
        self.retry_after = retry_after
        self.addresses = addresses
        self.token = token

    @property
    def hint(self) -> str:
        """Suggested remedy; empty if the message already contains a remedy, or if no remedy is known."""
        if self.refused or "nothing answers" in self.message:
            return ""
        if self.code == grpc.StatusCode.DEADLINE_EXCEEDED and self.message.startswith("the query"):
            return "give it more time (timeout)"  # a query changes nothing
        advice = connection_advice(self.message) if self.code == grpc.StatusCode.UNAVAILABLE else ""
        return advice or _HINTS.get(self.code, "")

    @property
    def refused(self) -> bool:
        """True if the server refused the request, so that nothing was changed. False in any other case, for
        example if the outcome is unknown.
        """
        return self.reason != Reason.UNSPECIFIED

    @property
    def changed_nothing(self) -> bool:
        """True if the server refused this message of an update, so that the message did not use its batch number. False
        for BATCH_GAP, which is about the numbers before the batch.
        """
        return (self.refused and self.reason != Reason.BATCH_GAP) or self.code == grpc.StatusCode.PERMISSION_DENIED

    @property
    def not_sent(self) -> bool:
        """True if no connection to the server could be made, so that the request did not reach it."""
        return self.code == grpc.StatusCode.UNAVAILABLE and not self.refused and self.message.startswith(_NOT_CONNECTED)

    @property
    def worth_repeating(self) -> bool:
        """True if an idempotent call that failed with this error may succeed when it is retried unchanged."""
        return self.code == grpc.StatusCode.UNAVAILABLE or (
            self.code == grpc.StatusCode.RESOURCE_EXHAUSTED and self.retry_after > 0)

    def __str__(self) -> str:
        kind = self.code.name + (f", {self.reason.name}" if self.refused else "")
        return f"{self.message} [{kind}]" + (f" ({self.hint})" if self.hint else "")


def reason_of(number: int) -> Reason:
    """Returns the reason of this enum number. Returns UNSPECIFIED for a number that this client does not know, which a
    newer server may send.
    """
    return Reason(number) if number in Reason._value2member_map_ else Reason.UNSPECIFIED


def from_error(error: Any) -> LocusError:
    """Returns the LocusError for an Error message of the protocol, with which a stream answers a request. OK and
    unknown status codes become UNKNOWN.
    """
    code = _CODES.get(error.code, grpc.StatusCode.UNKNOWN)
    return LocusError(code if code != grpc.StatusCode.OK else grpc.StatusCode.UNKNOWN, error.message,
                      reason=reason_of(error.reason), field=error.field,
                      index=error.index if error.HasField("index") else None, limit=error.limit,
                      limit_value=error.limit_value, asked=error.asked, retry_after=error.retry_after_ms / 1000,
                      addresses=tuple(error.addresses), token=error.token)


def from_call(call: Any) -> LocusError:
    """Returns the LocusError for a failed gRPC call. Details that cannot be decoded are ignored; the code and the
    message are kept.
    """
    for key, value in call.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            error = _error_in(value)
            if error is not None:
                return from_error(error)
    return LocusError(call.code(), call.details() or "")


def outcome_unknown(refusal: LocusError) -> LocusError:
    """Returns the error for an update that the server refused when it was sent again, although an earlier message of
    the same update may have been applied. It keeps the code, but has no reason.
    """
    return LocusError(refusal.code, "the update may have been applied: it was sent before the connection broke, and was "
                                    f"refused when it was sent again: {refusal.message}")


def late_query(scene: str, waits_for: Optional[int]) -> LocusError:
    """Returns the error for a query whose deadline passed in this client. `waits_for` is the revision for which the query
    waits; None if it waits for none.
    """
    waited = "" if waits_for is None else (f"; scene '{scene}' may not have reached revision {waits_for} yet, for which "
                                           "the query waits")
    return LocusError(grpc.StatusCode.DEADLINE_EXCEEDED, f"the query was not answered in time{waited}")


def unreadable(what: str) -> LocusError:
    """Returns the error for a response that cannot be decoded."""
    return LocusError(grpc.StatusCode.DATA_LOSS, f"the server's answer cannot be read: {what}; is this a locus server?")


def neither() -> LocusError:
    """Returns the error for a response with neither a result nor an error."""
    return LocusError(grpc.StatusCode.DATA_LOSS, "the server answered a batch with neither a result nor an error")


def parsed(message_class: Any, raw: bytes) -> Any:
    """Decodes a message. Raises LocusError DATA_LOSS if the bytes are not a valid message."""
    try:
        return message_class.FromString(raw)
    except schema.DecodeError as error:
        raise unreadable(str(error)) from None


def _error_in(details: bytes) -> Optional[Any]:
    try:
        for detail in _Status.FromString(details).details:
            if detail.type_url == _ERROR_TYPE:
                return _Error.FromString(detail.value)
    except schema.DecodeError:
        pass
    return None
