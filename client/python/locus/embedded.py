"""A locusd of one's own, for tests and for tools of one process: embedded() starts it and connects to it."""
from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import time
import weakref
from typing import Any, Dict, List, Sequence

from .client import Client
from .connection import Connection, Retry
from .errors import LocusError

_PROGRAM = "locusd"
_VARIABLE = "LOCUS_LOCUSD"
_END_SECONDS = 10.0
_POLL_SECONDS = 0.005
_LOG_LINES = 5


def embedded(*, data_dir: str = "", program: str = "", options: Sequence[str] = (), start_timeout: float = 60.0,
             timeout: float = 10.0, long_timeout: float = 600.0, max_send_bytes: int = 32 << 20,
             max_receive_bytes: int = 64 << 20, retry: Retry = Retry()) -> "EmbeddedClient":
    """Starts a locusd that only this user can reach, on a unix socket in a temporary folder, and connects to it.

    The daemon ends when the client is closed, and when this process ends, however it ends. Other clients of this user
    can connect to the client's `address`.

    `data_dir`: directory in which scenes and meshes are stored; by default they are kept in memory only. `program`:
    path of locusd; by default the value of the environment variable LOCUS_LOCUSD or, if it is not set, the locusd on
    PATH. `options`: further options of locusd, such as ["--threads", "1"]. `start_timeout`: maximum duration of the
    start in seconds, which includes recovering the scenes of `data_dir`. The other arguments are those of connect().
    Raises FileNotFoundError if there is no locusd, and RuntimeError with the daemon's last messages if it does not
    start.
    """
    daemon = _Daemon(_find(program), data_dir, options)
    client = EmbeddedClient(daemon, Connection(daemon.address, timeout=timeout, long_timeout=long_timeout,
                                               max_send_bytes=max_send_bytes, max_receive_bytes=max_receive_bytes,
                                               retry=retry))
    try:
        client._await_start(time.monotonic() + start_timeout)
    except BaseException:
        client.close()
        raise
    return client


class EmbeddedClient(Client):
    """Client of a locusd of its own, returned by embedded(). Closing the client ends the daemon."""

    def __init__(self, daemon: "_Daemon", connection: Connection) -> None:
        super().__init__(connection)
        self._daemon = daemon

    @property
    def pid(self) -> int:
        """Process id of the daemon."""
        return self._daemon.process.pid

    def close(self) -> None:
        """Closes the connection and the streams opened from it, and ends the daemon."""
        super().close()
        self._daemon.end()

    def _await_start(self, deadline: float) -> None:
        while True:
            self._daemon.check()
            if os.path.exists(self._daemon.socket):
                try:
                    self._connection.greet(True)
                    return
                except LocusError:  # the daemon still recovers its scenes, or has just ended
                    self._daemon.check()
            if time.monotonic() >= deadline:
                raise RuntimeError("locusd did not start in time" + self._daemon.messages())
            time.sleep(_POLL_SECONDS)


def _find(program: str) -> str:
    """Returns the path of locusd."""
    wanted = program or os.environ.get(_VARIABLE, "") or _PROGRAM
    found = shutil.which(wanted)
    if found is None:
        raise FileNotFoundError(f"no program {wanted!r}: install locusd in a folder of PATH, give its path as `program`, "
                                f"or set {_VARIABLE}")
    return found


class _Daemon:
    """Process of a locusd, with the folder of its socket and its log."""

    def __init__(self, program: str, data_dir: str, options: Sequence[str]) -> None:
        folder = tempfile.mkdtemp(prefix="locus-")  # only this user may enter it
        self.socket = os.path.join(folder, "locusd.sock")
        self.address = "unix:" + self.socket
        self.log = os.path.join(folder, "log")
        command: List[str] = [program, "--listen", self.address, "--http-listen", "", "--data-dir", data_dir,
                              "--drain-grace-s", "0", "--end-with-parent", str(os.getpid()), *options]
        try:
            with open(self.log, "wb") as log:
                # In a session of its own, the daemon does not get the signals of the terminal, such as that of Ctrl-C.
                self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                                env=_environment(), start_new_session=True)
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        # Also ends the daemon when the interpreter ends, or when the client is forgotten.
        self.end = weakref.finalize(self, _end, self.process, folder, os.getpid())

    def check(self) -> None:
        """Raises RuntimeError if the process has ended."""
        code = self.process.poll()
        if code is not None:
            raise RuntimeError(f"locusd ended with code {code}" + self.messages())

    def messages(self) -> str:
        """Returns the last lines of the log, as the end of an error message."""
        try:
            with open(self.log, encoding="utf-8", errors="replace") as file:
                lines = file.read().splitlines()[-_LOG_LINES:]
        except OSError:
            lines = []
        return "".join("\n  " + line for line in lines)


def _environment() -> Dict[str, str]:
    """Returns the environment of the daemon: that of this process without the options of locusd, which are meant for
    another daemon.
    """
    return {name: value for name, value in os.environ.items() if not name.startswith("LOCUS_")}


def _end(process: "subprocess.Popen[Any]", folder: str, owner: int) -> None:
    """Ends the daemon and removes its folder. Does nothing in a forked copy of the process that started the daemon."""
    if os.getpid() != owner:
        return
    process.terminate()
    try:
        process.wait(_END_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    shutil.rmtree(folder, ignore_errors=True)
