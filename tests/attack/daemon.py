"""The daemon under attack: a locusd that this program starts in a memory cgroup, or one that is already running.

A Daemon is stopped only by the process that started it. Its memory and descriptors are read from /proc and the cgroup.
"""
import ctypes
import os
import re
import resource
import shutil
import signal
import ssl
import subprocess
import tempfile
import time

from wire import Target

START_SECONDS = 60
STOP_SECONDS = 20
GROUPS = "/sys/fs/cgroup"
VICTIM_ADDRESS = "127.0.0.2"  # differs from the attacker's, so that limits per address do not affect the victim
PR_SET_PDEATHSIG = 1


class Unsupported(Exception):
    """The requested options are not possible with this daemon or on this machine. The message gives the reason."""


def read(path):
    try:
        with open(path, encoding="utf-8") as file:
            return file.read()
    except OSError:
        return ""


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


class MemoryGroup:
    """Memory limit: a new cgroup below the cgroup of this process or below one of its ancestors. If no cgroup can be
    created, the limit is RLIMIT_AS. `kind` names what is used: `cgroup v1`, `cgroup v2` or `RLIMIT_AS`.
    """

    NAMES = {"cgroup v2": ("memory.max", "memory.peak", "memory.events"),
             "cgroup v1": ("memory.limit_in_bytes", "memory.max_usage_in_bytes", "memory.oom_control")}

    def __init__(self, limit):
        self.limit, self.kind, self.path = limit, "RLIMIT_AS", None
        for kind, parent in self.parents():
            path = os.path.join(parent, f"locus-attack-{os.getpid()}-{time.monotonic_ns()}")
            try:
                os.mkdir(path)
            except OSError:
                continue
            try:
                write(os.path.join(path, self.NAMES[kind][0]), str(limit))
                self.kind, self.path = kind, path
                return
            except OSError:
                os.rmdir(path)

    @staticmethod
    def parents():
        """Yields (kind, folder) of each cgroup below which a cgroup may be created: the cgroup of this process, then
        its ancestors, nearest first.

        The ancestors are needed because in cgroup version 2 a cgroup that contains processes cannot limit its children.
        """
        for line in read("/proc/self/cgroup").split():
            number, controllers, path = line.split(":", 2)
            if number == "0" and os.path.exists(f"{GROUPS}/cgroup.controllers"):
                parts = [part for part in path.split("/") if part]
                for count in range(len(parts), -1, -1):
                    yield "cgroup v2", "/".join([GROUPS, *parts[:count]])
            elif controllers == "memory":
                yield "cgroup v1", f"{GROUPS}/memory{path}"

    def enter(self):
        """Puts the calling process under the limit. Runs in the child process, before it executes the daemon.

        Also makes the kernel kill the child when its parent ends, even if the parent is killed.
        """
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if self.path:
            write(os.path.join(self.path, "cgroup.procs"), str(os.getpid()))
        else:
            resource.setrlimit(resource.RLIMIT_AS, (self.limit, self.limit))

    def file(self, index):
        return read(os.path.join(self.path, self.NAMES[self.kind][index])) if self.path else ""

    def peak(self):
        """Returns the peak memory in bytes, including memory that the kernel uses for the daemon; 0 if the peak is
        unknown.
        """
        return int(self.file(1) or 0)

    def kills(self):
        """Returns the number of processes that the kernel killed for lack of memory."""
        return int((re.findall(r"^oom_kill (\d+)", self.file(2), re.MULTILINE) or [0])[0])

    def remove(self):
        for _ in range(100):
            try:
                if self.path:
                    os.rmdir(self.path)
                return
            except FileNotFoundError:
                return
            except OSError:
                time.sleep(0.05)


class Front:
    """Transport between clients and the daemon: `plain`, `tls` or `mtls`, with newly made certificates in `folder`.

    With `mtls`, the TLS context `context` has a client certificate; the TLS context `stranger` has none.
    """

    def __init__(self, name, folder):
        self.name, self.folder, self.options, self.context, self.stranger = name, folder, [], None, None
        if name != "plain":
            self.encrypt()

    def targets(self, port):
        """Returns two Targets, one for the victim and one for an attacker. They have different source addresses."""
        return Target("127.0.0.1", port, self.context, VICTIM_ADDRESS), Target("127.0.0.1", port, self.context)

    def path(self, name):
        return os.path.join(self.folder, name)

    def encrypt(self):
        if not shutil.which("openssl"):
            raise Unsupported("openssl is not installed, so there are no certificates")
        for name, authority in (("ca", None), ("server", "ca"), ("client", "ca")):
            self.certify(name, authority)
        self.options = ["--tls-cert", self.path("server.pem"), "--tls-key", self.path("server.key")]
        self.context, self.stranger = (ssl.create_default_context(cafile=self.path("ca.pem")) for _ in range(2))
        for context in (self.context, self.stranger):
            context.set_alpn_protocols(["h2"])
        if self.name == "mtls":
            self.options += ["--tls-client-ca", self.path("ca.pem")]
            self.context.load_cert_chain(self.path("client.pem"), self.path("client.key"))

    def certify(self, name, authority):
        """Makes a key and a certificate. The certificate is signed by the authority; without an authority it is
        self-signed.
        """
        command = ["openssl", "req", "-x509" if not authority else "-new", "-newkey", "ec", "-pkeyopt",
                   "ec_paramgen_curve:P-256", "-nodes", "-keyout", self.path(name + ".key"), "-subj", f"/CN={name}",
                   "-out", self.path(name + (".csr" if authority else ".pem"))]
        run(command + ([] if authority else ["-days", "2"]))
        if not authority:
            return
        write(self.path("names"), "subjectAltName=DNS:localhost,IP:127.0.0.1\n")
        run(["openssl", "x509", "-req", "-in", self.path(name + ".csr"), "-CA", self.path(authority + ".pem"), "-CAkey",
             self.path(authority + ".key"), "-CAcreateserial", "-days", "2", "-extfile", self.path("names"), "-out",
             self.path(name + ".pem")])


def run(command):
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=60)


class Process:
    """Memory, descriptors and threads of a process, read from /proc by its id."""

    def __init__(self, pid):
        self.pid = pid

    def status(self, name):
        found = re.search(rf"^{name}:\s+(\d+) kB", read(f"/proc/{self.pid}/status"), re.MULTILINE)
        return int(found.group(1)) * 1024 if found else 0

    def resident(self):
        return self.status("VmRSS")

    def descriptors(self):
        try:
            return len(os.listdir(f"/proc/{self.pid}/fd"))
        except OSError:
            return 0

    def threads(self):
        found = re.search(r"^Threads:\s+(\d+)", read(f"/proc/{self.pid}/status"), re.MULTILINE)
        return int(found.group(1)) if found else 0

    def alive(self):
        return os.path.exists(f"/proc/{self.pid}/status") and "Z (zombie)" not in read(f"/proc/{self.pid}/status")


def how_it_ended(process, group):
    """Returns in a few words how a child in a MemoryGroup ended; empty while the child runs."""
    code = process.poll()
    if code is None:
        return ""
    if group.kills():
        return "killed by the kernel, out of memory"
    return f"ended by {signal.Signals(-code).name}" if code < 0 else f"ended with exit code {code}"


def stop_process(process):
    """Ends a child process by its id and waits until it has ended."""
    if process.poll() is not None:
        return
    process.terminate()
    try:
        process.wait(timeout=STOP_SECONDS)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait(timeout=STOP_SECONDS)


class Daemon(Process):
    """A locusd started by this program on a free loopback port, in a MemoryGroup and with a temporary folder."""

    def __init__(self, program, limit, front="plain", options=()):
        super().__init__(0)
        self.folder = tempfile.mkdtemp(prefix="locus-attack-")
        self.group = self.process = None
        try:
            self.front = Front(front, self.folder)
            self.group = MemoryGroup(limit)
            self.log = os.path.join(self.folder, "log")
            self.start(program, options)
        except BaseException:
            self.stop()
            raise

    def start(self, program, options):
        """Starts the daemon, waits until it answers, and sets the Targets of the victim and of the attacker."""
        port_file = self.front.path("port")
        self.launch([program, "--listen", "127.0.0.1:0", "--port-file", port_file, *self.front.options, *options], port_file)
        self.target, self.attacker = self.front.targets(int(read(port_file)))

    def launch(self, command, sign):
        """Starts the program within the limit and waits until the file `sign` exists."""
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen([*command, "--http-listen", "", "--log-level", "warning"],
                                            stdin=subprocess.DEVNULL, stdout=log, stderr=log, preexec_fn=self.group.enter)
        self.pid = self.process.pid
        until = time.monotonic() + START_SECONDS
        while not os.path.exists(sign):
            if self.process.poll() is not None or time.monotonic() > until:
                text = read(self.log)[-400:].strip()
                raise (Unsupported if "--tls-" in text else RuntimeError)(f"locusd did not start: {text}")
            time.sleep(0.02)

    def alive(self):
        return self.process.poll() is None

    def peak(self):
        return self.group.peak()

    def death(self):
        """Returns in a few words how the daemon ended; empty while the daemon runs."""
        return how_it_ended(self.process, self.group)

    def stop(self):
        """Stops the daemon and removes its cgroup and its folder."""
        if self.process:
            stop_process(self.process)
        if self.group:
            self.group.remove()
        shutil.rmtree(self.folder, ignore_errors=True)


class OtherDaemon(Process):
    """A daemon that is already running, perhaps behind a proxy. It is given by its address and the id of the process to
    watch.
    """

    def __init__(self, address, pid, authority=None):
        super().__init__(pid)
        host, port = address.rsplit(":", 1)
        context = ssl.create_default_context(cafile=authority) if authority else None
        if context:
            context.set_alpn_protocols(["h2"])
        self.target = self.attacker = Target(host, int(port), context)
        self.highest = 0

    def peak(self):
        self.highest = max(self.highest, self.status("VmHWM"))
        return self.highest

    def death(self):
        return "" if self.alive() else "ended"

    def stop(self):
        """Does nothing, because the process was not started by this program."""
