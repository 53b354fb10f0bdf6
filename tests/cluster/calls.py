"""Raw calls of locus.v1 to the daemons of a cluster, with the details of errors. The messages are those of the Python package,
which declares columns as bytes; it is found by LOCUS_PACKAGE, the folder in which the build puts it.
"""
import dataclasses
import os
import struct
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
BUILD = os.path.join(HERE, "../../build/release")
PACKAGE = os.environ.get("LOCUS_PACKAGE", os.path.join(BUILD, "python"))
BIN = os.environ.get("LOCUS_BIN", os.path.join(BUILD, "bin"))
LOCUSD = os.path.join(BIN, "locusd")
sys.path.insert(0, PACKAGE)

try:
    import grpc
    import locus
    from locus import schema
except ImportError as problem:
    grpc = locus = schema = None
    PROBLEM = f"the Python package of locus cannot be used: {problem}"
else:
    PROBLEM = "" if os.access(LOCUSD, os.X_OK) else f"there is no {LOCUSD}"

CALL_SECONDS = 3


def unavailable():
    """Returns why no daemon can be started and called here; empty if one can be."""
    return PROBLEM


def reason_name(number):
    """Returns the name of a Reason as in the protocol, empty for REASON_UNSPECIFIED."""
    values = schema.message("Error").DESCRIPTOR.fields_by_name["reason"].enum_type.values_by_number
    return (values[number].name if number in values else f"REASON_{number}") if number else ""


def has_field(message, name):
    """Returns whether the protocol of the package has a field, which clusters need and older ones lack."""
    return name in message.DESCRIPTOR.fields_by_name


def ids_of(column):
    """Returns the numbers of a column of fixed64."""
    return list(struct.unpack(f"<{len(column) // 8}Q", column))


def id_column(ids):
    return struct.pack(f"<{len(ids)}Q", *ids)


def double_column(points):
    """Returns a column of the coordinates of points."""
    return b"".join(struct.pack("<3d", *point) for point in points)


def points_of(column):
    """Inverse of double_column()."""
    return list(struct.iter_unpack("<3d", column))


@dataclasses.dataclass
class Answer:
    """How a call ended. `response` is None if it ended by an error."""

    code: str
    response: object = None
    reason: str = ""
    message: str = ""
    addresses: tuple = ()
    token: int = 0
    retry_after: float = 0.0

    @property
    def answered(self):
        return self.response is not None

    @property
    def unsent(self):
        """True if the call did not leave this process, because no connection could be made."""
        return self.code == "UNAVAILABLE" and self.message.startswith("failed to connect")

    @property
    def error(self):
        """Code, reason and message of an error, for histories."""
        return " ".join(filter(None, (self.code, self.reason, self.message[:100])))


class Caller:
    """Channels to daemons, by name. One thread at a time."""

    def __init__(self, addresses):
        """`addresses` are those of the daemons by name. The map may change; addresses of one name must not."""
        self.addresses, self.channels = addresses, {}

    def close(self):
        for name in list(self.channels):
            self.drop(name)

    def drop(self, name):
        """Forgets a channel, so that the next call connects at once: gRPC waits ever longer after failures."""
        self.channels.pop(name).close()

    def channel(self, name):
        if name not in self.channels:
            self.channels[name] = grpc.insecure_channel(self.addresses[name], options=[
                ("grpc.use_local_subchannel_pool", 1), ("grpc.enable_http_proxy", 0)])
        return self.channels[name]

    def call(self, daemon, service, rpc, /, seconds=CALL_SECONDS, **fields):
        """Calls a daemon with a request of these fields. Returns the Answer."""
        return self.send(daemon, service, rpc, request_of(service, rpc, **fields), seconds)

    def send(self, name, service, rpc, request, seconds=CALL_SECONDS):
        """Calls a daemon with a request message. Returns the Answer."""
        method = schema.method(f"locus.v1.{service}Service", rpc)
        try:
            raw = self.channel(name).unary_unary(method.path)(request.SerializeToString(), timeout=seconds)
        except grpc.RpcError as failure:
            answer = error_of(failure)
            if answer.code == "UNAVAILABLE" and not answer.reason:
                self.drop(name)
            return answer
        return Answer("OK", method.response.FromString(raw))


def request_of(service, rpc, /, **fields):
    return schema.method(f"locus.v1.{service}Service", rpc).request(**fields)


def error_of(failure):
    """Returns the Answer of a failed call, with the details that the daemon sent."""
    answer = Answer(failure.code().name, message=failure.details() or "")
    for key, value in failure.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            for detail in schema.message("Status").FromString(value).details:
                error = schema.message("Error").FromString(detail.value)
                answer.reason, answer.retry_after = reason_name(error.reason), error.retry_after_ms / 1000
                if has_field(error, "addresses"):
                    answer.addresses, answer.token = tuple(error.addresses), error.token
    return answer
