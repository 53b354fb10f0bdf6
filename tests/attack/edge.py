"""A locusd behind the front of deploy/edge (HAProxy as a proxy for untrusted clients), with the configuration that is
shipped. Both processes are started, watched and stopped together.

Memory, descriptors and threads are summed over both processes. Each process has its own MemoryGroup.
"""
import os
import socket
import subprocess
import time

from daemon import START_SECONDS, Daemon, MemoryGroup, Process, Unsupported, how_it_ended, read, stop_process

PROGRAM = "/usr/sbin/haproxy"
CONFIG = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../deploy/edge/haproxy.cfg")
MEMORY = 1 << 30  # bytes, as MemoryMax= in deploy/edge/locus-edge.service
# Raise locusd's limits per address, as deploy/edge/locusd-edge.conf does: all clients reach locusd as one user of its
# socket, so the front limits each client instead.
DAEMON_OPTIONS = ("--max-connections-per-address", "4096", "--max-new-connections", "4000")


def free_port():
    """Returns a loopback port that was free a moment ago."""
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


def listens(port):
    """Returns whether a process accepts connections at a loopback port."""
    try:
        socket.create_connection(("127.0.0.1", port), 1).close()
        return True
    except OSError:
        return False


class Edge(Process):
    """A running HAProxy with the configuration of deploy/edge, on a free port of loopback. `variables` are environment
    variables that the configuration reads.
    """

    def __init__(self, variables, log):
        super().__init__(0)
        if not os.access(PROGRAM, os.X_OK):
            raise Unsupported(f"{PROGRAM} is missing; deploy/packages.sh test installs it")
        self.port, self.group = free_port(), MemoryGroup(MEMORY)
        with open(log, "wb") as file:
            self.process = subprocess.Popen(
                [PROGRAM, "-db", "-f", CONFIG], stdin=subprocess.DEVNULL, stdout=file, stderr=file, preexec_fn=self.group.enter,
                env={**os.environ, **variables, "LOCUS_EDGE_LISTEN": f"127.0.0.1:{self.port}"})
        self.pid = self.process.pid
        until = time.monotonic() + START_SECONDS
        while not listens(self.port):
            if self.process.poll() is not None or time.monotonic() > until:
                self.stop()
                raise RuntimeError(f"the front did not start: {read(log)[-400:]}")
            time.sleep(0.02)

    def death(self):
        """Returns in a few words how the front ended; empty while the front runs."""
        how = how_it_ended(self.process, self.group)
        return f"the front was {how}" if how else ""

    def stop(self):
        stop_process(self.process)
        self.group.remove()


class EdgedDaemon(Daemon):
    """A locusd on a unix socket, and the front through which clients reach it. With `client_ca` the front requires
    client certificates.
    """

    def __init__(self, program, limit, options=(), client_ca=False):
        self.edge, self.client_ca = None, client_ca
        super().__init__(program, limit, "mtls" if client_ca else "tls", options)

    def start(self, program, options):
        path, pair = self.front.path("locus.sock"), self.front.path("edge.pem")
        self.launch([program, "--listen", f"unix:{path}", *DAEMON_OPTIONS, *options], path)
        with open(pair, "w", encoding="utf-8") as file:
            file.write(read(self.front.path("server.pem")) + read(self.front.path("server.key")))
        variables = {"LOCUS_EDGE_CERT": pair, "LOCUS_EDGE_DAEMON": path}
        if self.client_ca:
            variables["LOCUS_EDGE_CLIENT_CA"] = self.front.path("ca.pem")
        self.edge = Edge(variables, self.front.path("edge.log"))
        self.target, self.attacker = self.front.targets(self.edge.port)

    def resident(self):
        return super().resident() + self.edge.resident()

    def descriptors(self):
        return super().descriptors() + self.edge.descriptors()

    def threads(self):
        return super().threads() + self.edge.threads()

    def peak(self):
        return super().peak() + self.edge.group.peak()

    def alive(self):
        return super().alive() and self.edge.process.poll() is None

    def death(self):
        return super().death() or self.edge.death()

    def stop(self):
        if self.edge:
            self.edge.stop()
        super().stop()
