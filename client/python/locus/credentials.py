"""Credentials of a client: TLS, certificates and bearer tokens. Internal to the package; connect() takes the options."""
from __future__ import annotations

import dataclasses
import ipaddress
import os
import re
import threading
from typing import List, Optional, Tuple

import grpc

MAX_TOKEN_BYTES = 8192
_TOKEN = re.compile(r"[!-~]+")

Metadata = List[Tuple[str, str]]


def stays_on_this_machine(target: str) -> bool:
    """Returns True if data for a gRPC target never leaves this machine: a unix socket or a loopback address."""
    if target.startswith("unix:"):
        return True
    host = target.rpartition(":")[0]
    if host in ("localhost", "[::1]"):
        return True
    try:
        return ipaddress.IPv4Address(host).is_loopback
    except ValueError:
        return False


@dataclasses.dataclass(frozen=True)
class Credentials:
    """Options of connect() about encryption and identity; connect() describes them."""

    tls: bool = False
    ca: str = ""
    cert: str = ""
    key: str = ""
    server_name: str = ""
    token: str = dataclasses.field(default="", repr=False)
    token_file: str = ""
    allow_token_without_tls: bool = False

    def __post_init__(self) -> None:
        if bool(self.cert) != bool(self.key):
            raise ValueError("a client's certificate and its key belong together: give both cert and key or neither")
        if self.token and self.token_file:
            raise ValueError("there are two tokens: give token or token_file, not both")

    @property
    def uses_tls(self) -> bool:
        """True if the options enable TLS."""
        return self.tls or bool(self.ca or self.cert or self.server_name)

    def channel(self, target: str, options: List[Tuple[str, object]]) -> grpc.Channel:
        """Returns a channel to `target`. Raises OSError if a file cannot be read."""
        if not self.uses_tls:
            return grpc.insecure_channel(target, options)
        if self.server_name:
            options = options + [("grpc.ssl_target_name_override", self.server_name)]
        files = [_content(name) for name in (self.ca, self.key, self.cert)]
        return grpc.secure_channel(target, grpc.ssl_channel_credentials(*files), options)


class Token:
    """Bearer token that calls carry. Thread-safe. Without a token, the metadata are empty.

    A token file is read again when it has changed. If the changed file cannot be read, the old token is kept.
    """

    def __init__(self, credentials: Credentials, target: str) -> None:
        self._lock = threading.Lock()
        self._file = credentials.token_file
        self._number = 1
        self._stamp = _stamp(self._file)
        self._token = credentials.token
        if self._file:
            self._token = _read_token(self._file)
        elif self._token:
            _check_token("the token", self._token)
        permitted = credentials.uses_tls or credentials.allow_token_without_tls or stays_on_this_machine(target)
        if self._token and not permitted:
            raise ValueError(f"without TLS everyone on the way to {target} could read the token: connect with TLS")

    def metadata(self) -> Tuple[int, Metadata]:
        """Returns the number of the token (1 for the first token) and the metadata for a call."""
        with self._lock:
            if self._file and _stamp(self._file) != self._stamp:
                self._read()
            return self._number, [("authorization", f"Bearer {self._token}")] if self._token else []

    def has_newer(self, used: int) -> bool:
        """Reads the file again after the server refused token number `used`. Returns True if there is a newer token."""
        with self._lock:
            if self._file:
                self._read()
            return self._number > used

    def _read(self) -> None:
        # Take the stamp before reading the file: if the file changes in between, the next call reads it again.
        self._stamp = _stamp(self._file)
        try:
            token = _read_token(self._file)
        except (OSError, ValueError):
            return
        if token != self._token:
            self._token = token
            self._number += 1


def _content(name: str) -> Optional[bytes]:
    if not name:
        return None
    with open(name, "rb") as file:
        return file.read()


def _check_token(origin: str, token: str) -> None:
    """Raises ValueError if the token is malformed. The message does not contain the token."""
    if not _TOKEN.fullmatch(token) or len(token) > MAX_TOKEN_BYTES:
        raise ValueError(f"{origin} is no token: a token is one word of at most {MAX_TOKEN_BYTES} ASCII characters")


def _read_token(name: str) -> str:
    with open(name, encoding="latin-1") as file:
        token = file.read(MAX_TOKEN_BYTES + 3).strip()
    _check_token(f"the content of {name}", token)
    return token


def _stamp(name: str) -> Optional[Tuple[int, int, int]]:
    """Returns the state of a file. If a later state differs, the file has changed."""
    try:
        status = os.stat(name) if name else None
    except OSError:
        return None
    return (status.st_ino, status.st_size, status.st_mtime_ns) if status else None
