"""Process that relays TCP connections of a test, which can be cut or hung, and that ends what the test started.

    python3 keeper.py LIFE_SECONDS

The test starts it (class Keeper) and sends it commands as lines of JSON; each is answered by a line. When its input ends,
because the test ended in whatever way, also by SIGKILL, or when its life is over, it ends the guarded processes and removes the
guarded folders. So nothing that a test started outlives the test. It is no descendant of the test, since ctest kills a test that
takes too long together with all descendants.

States of a link: `open` forwards all bytes; `cut` resets connections, also new ones, as a refusing firewall does; `hung` keeps
and accepts connections but forwards nothing, as a machine does that is frozen or behind a broken cable. What a hung link
accepted is forwarded when it is open again.
"""
import asyncio
import contextlib
import json
import os
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

OPEN, CUT, HUNG = "open", "cut", "hung"
CHUNK = 1 << 16
STOP_SECONDS = 5
ANSWER_SECONDS = 30
RESET = struct.pack("ii", 1, 0)  # SO_LINGER that makes close() reset the connection


def started_at(pid):
    """Returns when a process was started, in clock ticks since boot, or None if there is none. With the id it identifies
    a process, since ids are used again.
    """
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
            fields = file.read().rpartition(")")[2].split()
    except OSError:
        return None
    return None if fields[0] == "Z" else int(fields[19])


def family(pid):
    """Returns the ids of a process and of all its descendants."""
    parents = {}
    for name in os.listdir("/proc"):
        if name.isdigit():
            with contextlib.suppress(OSError, ValueError, IndexError):
                with open(f"/proc/{name}/stat", encoding="utf-8", errors="replace") as file:
                    parents.setdefault(int(file.read().rpartition(")")[2].split()[1]), []).append(int(name))
    found = [pid]
    for member in found:
        found += parents.get(member, ())
    return found


def end_in_order():
    """Lets SIGTERM end this process by an exception, so that it ends what it started itself."""
    signal.signal(signal.SIGTERM, lambda number, _frame: sys.exit(128 + number))


def send(processes, number):
    """Sends a signal to processes, a map from id to start, as far as they still live."""
    for pid, start in processes.items():
        with contextlib.suppress(ProcessLookupError):
            if start is not None and started_at(pid) == start:
                os.kill(pid, number)


class Link:
    """A listening port whose connections are forwarded to another port of this machine."""

    def __init__(self, target):
        self.target, self.state = target, OPEN
        self.writers, self.passable = set(), asyncio.Event()
        self.passable.set()
        self.server = None

    async def listen(self):
        self.server = await asyncio.start_server(self.serve, "127.0.0.1", 0)
        return self.server.sockets[0].getsockname()[1]

    def set(self, state):
        self.state = state
        if state == HUNG:
            self.passable.clear()
        else:
            self.passable.set()
        if state == CUT:
            for writer in list(self.writers):
                self.reset(writer)

    @staticmethod
    def reset(writer):
        sock = writer.get_extra_info("socket")
        if sock is not None and sock.fileno() >= 0:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
        writer.transport.abort()

    async def serve(self, reader, writer):
        self.writers.add(writer)
        forward = None
        try:
            await self.passable.wait()
            if self.state == CUT:
                return
            back, forward = await asyncio.open_connection("127.0.0.1", self.target)
            self.writers.add(forward)
            for side in (writer, forward):
                side.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            await asyncio.gather(self.pump(reader, forward), self.pump(back, writer))
        except OSError:
            pass
        finally:
            for side in filter(None, (writer, forward)):
                self.writers.discard(side)
                self.reset(side)

    async def pump(self, reader, writer):
        while data := await reader.read(CHUNK):
            await self.passable.wait()
            if self.state == CUT:
                raise ConnectionResetError
            writer.write(data)
            await writer.drain()
        await self.passable.wait()
        if writer.can_write_eof():
            writer.write_eof()


class Service:
    """The keeper itself: links, and what to end."""

    def __init__(self):
        self.links, self.guarded, self.folders = {}, {}, []
        self.until = 0.0

    async def execute(self, command):
        """Runs one command. Returns its answer."""
        what = command["do"]
        if what == "link":
            link = Link(command["target"])
            self.links[command["name"]] = link
            return {"port": await link.listen()}
        if what == "set":
            for name in command["names"]:
                self.links[name].set(command["state"])
        elif what == "states":
            return {"states": {name: link.state for name, link in self.links.items()}}
        elif what == "guard":
            self.guarded[command["pid"]] = started_at(command["pid"])
        elif what == "release":
            self.guarded.pop(command["pid"], None)
        elif what == "folder":
            self.folders.append(command["path"])
        elif what == "life":
            self.until = time.monotonic() + command["seconds"]
        return {}

    async def run(self, life_seconds):
        reader = asyncio.StreamReader()
        loop = asyncio.get_running_loop()
        await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
        self.until = time.monotonic() + life_seconds
        while (left := self.until - time.monotonic()) > 0:
            try:
                line = await asyncio.wait_for(reader.readline(), left)
            except asyncio.TimeoutError:
                break
            if not line:
                break
            try:
                print(json.dumps(await self.execute(json.loads(line))), flush=True)
            except BrokenPipeError:
                break
        self.end()

    def end(self):
        """Ends guarded processes: quickly but in order first, so that PostgreSQL frees its shared memory, then by force, with
        all processes that they started.
        """
        guarded = {pid: start for pid, start in self.guarded.items() if start is not None and started_at(pid) == start}
        members = {pid: started_at(pid) for parent in guarded for pid in family(parent)}
        send(members, signal.SIGCONT)
        send(guarded, signal.SIGQUIT)
        until = time.monotonic() + STOP_SECONDS
        while time.monotonic() < until and any(started_at(pid) == start for pid, start in guarded.items()):
            time.sleep(0.02)
        send(members, signal.SIGKILL)
        for folder in self.folders:
            shutil.rmtree(folder, ignore_errors=True)


class Keeper:
    """A running keeper, for the test that started it. Thread-safe."""

    def __init__(self, life_seconds):
        self._lock = threading.Lock()
        self._process = subprocess.Popen([sys.executable, "-B", os.path.abspath(__file__), str(life_seconds)], text=True,
                                         stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True)
        self._process.wait(timeout=ANSWER_SECONDS)  # the child ends once the keeper, its own child, runs
        self.pid = json.loads(self._process.stdout.readline())["pid"]

    def command(self, **command):
        with self._lock:
            self._process.stdin.write(json.dumps(command) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        if not line:
            raise RuntimeError("the keeper has ended: the life of the test is over")
        return json.loads(line)

    def link(self, name, target):
        """Makes a link to a port of this machine. Returns the port at which it listens."""
        return self.command(do="link", name=name, target=target)["port"]

    def set(self, names, state):
        self.command(do="set", names=list(names), state=state)

    def guard(self, pid):
        """Has a process ended when the test ends."""
        self.command(do="guard", pid=pid)

    def release(self, pid):
        """Forgets a process that has ended."""
        self.command(do="release", pid=pid)

    def guard_folder(self, path):
        """Has a folder removed when the test ends."""
        self.command(do="folder", path=path)

    def set_life(self, seconds):
        """Sets the seconds from now on after which everything guarded is ended."""
        self.command(do="life", seconds=seconds)

    def wait(self, seconds=ANSWER_SECONDS):
        """Waits until the keeper has ended: its output ends then. Returns whether it has."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0 and any(select.select([self._process.stdout], [], [], left)):
            if not os.read(self._process.stdout.fileno(), CHUNK):
                return True
        return False

    def close(self):
        """Ends everything guarded, and the keeper."""
        if self._process.stdout.closed:
            return
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        if not self.wait():
            os.kill(self.pid, signal.SIGKILL)
        self._process.stdout.close()


if __name__ == "__main__":
    if os.fork():
        sys.exit(0)
    for ignored in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):  # the test may be ended by one of them: end after it
        signal.signal(ignored, signal.SIG_IGN)
    print(json.dumps({"pid": os.getpid()}), flush=True)
    asyncio.run(Service().run(float(sys.argv[1])))
