"""Refusals and failures as one exception, with what the server said about them."""
from __future__ import annotations

from typing import Any, Optional

import grpc

from . import schema
from .enums import Reason

_Status, _Error = schema.message("Status"), schema.message("Error")
_CODES = {code.value[0]: code for code in grpc.StatusCode}
_ERROR_TYPE = "type.googleapis.com/locus.v1.Error"

# What to do where the server itself did not speak; its own messages say it themselves.
_HINTS = {
    grpc.StatusCode.UNAVAILABLE: "try again when the server answers",
    grpc.StatusCode.DEADLINE_EXCEEDED: "give it more time (timeout); a change may have been made all the same",
    grpc.StatusCode.RESOURCE_EXHAUSTED: "a message is larger than its receiver takes: split the batch, or raise "
                                        "max_receive_bytes",
    grpc.StatusCode.UNIMPLEMENTED: "is this a locus server, and new enough? Client.server() says which",
    grpc.StatusCode.UNAUTHENTICATED: "ask whoever runs the server for the right to do this",
    grpc.StatusCode.PERMISSION_DENIED: "ask whoever runs the server for the right to do this",
}


class LocusError(Exception):
    """A call, a batch or a stream that failed.

    `code` is the gRPC status code. Where the server refused, `reason` says why, `field` is the path of the offending
    field (`blocks[2].rays.directions`) and `index` the offending entry counted from 0; `limit`, `limit_value` and
    `asked` name a limit that was hit; `retry_after` is the wait in seconds after which the same request may succeed,
    0 = not unchanged. Where the server did not speak, `reason` is UNSPECIFIED and `hint` says what to try.
    """

    def __init__(self, code: grpc.StatusCode, message: str, *, reason: Reason = Reason.UNSPECIFIED, field: str = "",
                 index: Optional[int] = None, limit: str = "", limit_value: float = 0, asked: float = 0,
                 retry_after: float = 0) -> None:
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

    @property
    def hint(self) -> str:
        """What to do next, where the message does not say it; may be empty."""
        if self.refused or "nothing answers" in self.message:
            return ""
        return _HINTS.get(self.code, "")

    @property
    def refused(self) -> bool:
        """True if the server refused, so that nothing was changed; False also where the outcome is unknown."""
        return self.reason != Reason.UNSPECIFIED

    @property
    def worth_repeating(self) -> bool:
        """True if a call that is safe to repeat may succeed later, unchanged."""
        return self.code == grpc.StatusCode.UNAVAILABLE or (
            self.code == grpc.StatusCode.RESOURCE_EXHAUSTED and self.retry_after > 0)

    def __str__(self) -> str:
        kind = self.code.name + (f", {self.reason.name}" if self.refused else "")
        return f"{self.message} [{kind}]" + (f" ({self.hint})" if self.hint else "")


def reason_of(number: int) -> Reason:
    """The reason of a number; UNSPECIFIED for one that a newer server knows."""
    return Reason(number) if number in Reason._value2member_map_ else Reason.UNSPECIFIED


def from_error(error: Any) -> LocusError:
    """From the protocol's Error, as streams report it. A code that no refusal has becomes UNKNOWN."""
    code = _CODES.get(error.code, grpc.StatusCode.UNKNOWN)
    return LocusError(code if code != grpc.StatusCode.OK else grpc.StatusCode.UNKNOWN, error.message,
                      reason=reason_of(error.reason), field=error.field,
                      index=error.index if error.HasField("index") else None, limit=error.limit,
                      limit_value=error.limit_value, asked=error.asked, retry_after=error.retry_after_ms / 1000)


def from_call(call: Any) -> LocusError:
    """From a failed gRPC call. Details that cannot be read are left out: code and message still hold."""
    for key, value in call.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            error = _error_in(value)
            if error is not None:
                return from_error(error)
    return LocusError(call.code(), call.details() or "")


def unreadable(what: str) -> LocusError:
    """For an answer whose bytes are no answer."""
    return LocusError(grpc.StatusCode.DATA_LOSS, f"the server's answer cannot be read: {what}; is this a locus server?")


def parsed(message_class: Any, raw: bytes) -> Any:
    """A message from its wire form; LocusError DATA_LOSS for bytes that are none."""
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
