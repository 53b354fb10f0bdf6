"""Daemons for tests: processes of locusd on ports of loopback, alone or as a cluster on an Engine. They can be killed, frozen,
drained, started again, and cut off from the engine and from each other; everything that is started is ended.

    with Engine() as engine, Daemons(3, engine) as daemons:
        leader = daemons.leader("arena")
        daemons.kill(leader)
        daemons.start(leader)

Each daemon has relays of its own to each node of the engine, under its name (`engine.set_links(HUNG, sources=["d0"])`), and
one that all other daemons use to reach it, which is the address that it advertises. Clients reach daemons past all relays.
LOCUS_CLUSTER_LOGS names a folder to which the logs of daemons are copied at the end.
"""
import contextlib
import os
import shutil
import signal
import subprocess
import tempfile
import time

from calls import LOCUSD, Caller, has_field, unavailable
from engine import DOWN, FROZEN, RUNNING, hold_port, quick_folder, wait_for
from keeper import CUT, OPEN, Keeper

START_SECONDS = 60
DRAIN_SECONDS = 40
DRAIN_GRACE = 5  # seconds that running calls may take after SIGTERM
LIFE_SECONDS = 900


class DaemonError(Exception):
    """A daemon did not do what the test asked for in time, or ended by itself."""


def knows_cluster(program=LOCUSD):
    """Returns whether a locusd has the option --cluster."""
    result = subprocess.run([program, "--help"], stdout=subprocess.PIPE, text=True, timeout=60, check=False)
    return "--cluster " in result.stdout


class Daemon:
    """One locusd. Its port stays the same when it is started again."""

    def __init__(self, name, folder):
        self.name, self.folder = name, folder
        self.holder = hold_port()
        self.address = f"127.0.0.1:{self.holder.getsockname()[1]}"
        self.advertised = self.address
        self.process, self.state, self.starts = None, DOWN, 0

    def __repr__(self):
        return self.name

    @property
    def data(self):
        return os.path.join(self.folder, self.name)

    @property
    def log(self):
        return self.data + ".log"


class Daemons:
    """A context manager. With an `engine`, the daemons are a cluster on it and end with it. Without, each is alone, with a data
    directory if `stored`. `options` are further options of every daemon.
    """

    def __init__(self, count, engine=None, stored=True, options=(), program=LOCUSD, life_seconds=LIFE_SECONDS):
        if unavailable():
            raise DaemonError(unavailable())
        self.engine, self.stored, self.options, self.program = engine, stored, list(options), program
        self.keeper = engine.keeper if engine else Keeper(life_seconds)
        self.daemons, self.caller = [], None
        try:
            self.folder = tempfile.mkdtemp(prefix="locus-daemons-", dir=quick_folder())
            self.keeper.guard_folder(self.folder)
            self.daemons = [Daemon(f"d{number}", self.folder) for number in range(count)]
            self.caller = Caller(self.addresses())
            if engine:
                for daemon in self.daemons:
                    port = self.keeper.link(self.peers_link(daemon), int(daemon.address.rpartition(":")[2]))
                    daemon.advertised = f"127.0.0.1:{port}"
                    engine.postgresql_url(daemon.name)  # makes the links, so that a fault reaches them from the start
            for daemon in self.daemons:
                self.start(daemon)
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        for daemon in self.daemons:
            if daemon.state != DOWN:
                self.kill(daemon)
            daemon.holder.close()
            if os.environ.get("LOCUS_CLUSTER_LOGS") and os.path.exists(daemon.log):
                shutil.copy(daemon.log, os.environ["LOCUS_CLUSTER_LOGS"])
        if self.caller:
            self.caller.close()
        if self.engine is None:
            self.keeper.close()
        else:
            shutil.rmtree(self.folder, ignore_errors=True)

    @staticmethod
    def peers_link(daemon):
        return f"peers>{daemon.name}"

    def addresses(self):
        """Returns the addresses at which clients reach the daemons, by name."""
        return {daemon.name: daemon.address for daemon in self.daemons}

    def names(self):
        """Returns the names of the daemons by the address that they advertise, and by that at which clients reach them."""
        return {address: daemon.name for daemon in self.daemons for address in (daemon.address, daemon.advertised)}

    def by_name(self, name):
        return next(daemon for daemon in self.daemons if daemon.name == name)

    def running(self):
        return [daemon for daemon in self.daemons if daemon.state == RUNNING]

    # Processes.

    def command(self, daemon, port_file):
        if self.engine:
            stored = ["--cluster", self.engine.postgresql_url(daemon.name), "--advertise", daemon.advertised]
        else:
            stored = ["--data-dir", daemon.data] if self.stored else []
        return [self.program, "--listen", daemon.address, "--port-file", port_file, "--http-listen", "", "--end-with-parent",
                str(os.getpid()), "--drain-grace-s", str(DRAIN_GRACE), *stored, *self.options]

    def start(self, daemon, wait=True):
        """Starts a daemon that is down. With `wait` it answers when this returns."""
        daemon.starts += 1
        port_file = f"{daemon.data}.port{daemon.starts}"
        with open(daemon.log, "ab") as log:
            daemon.process = subprocess.Popen(self.command(daemon, port_file), cwd="/", stdin=subprocess.DEVNULL, stdout=log,
                                              stderr=log, start_new_session=True)
        self.keeper.guard(daemon.process.pid)
        daemon.state = RUNNING

        def answers():
            if daemon.process.poll() is not None:
                raise DaemonError(f"{daemon} did not start: {self.log_tail(daemon)}")
            return os.path.exists(port_file)
        if wait:
            wait_for(answers, START_SECONDS, f"{daemon} answers")

    def log_tail(self, daemon, size=1500):
        with contextlib.suppress(OSError):
            with open(daemon.log, encoding="utf-8", errors="replace") as file:
                return file.read()[-size:]
        return ""

    def check_running(self):
        """Raises DaemonError if a daemon has ended that nobody killed."""
        for daemon in self.daemons:
            if daemon.state != DOWN and daemon.process.poll() is not None:
                raise DaemonError(f"{daemon} ended by itself with {daemon.process.returncode}: {self.log_tail(daemon)}")

    def ended(self, daemon):
        self.keeper.release(daemon.process.pid)
        daemon.state = DOWN

    def kill(self, daemon):
        """Kills a daemon with SIGKILL."""
        daemon.process.kill()
        daemon.process.wait()
        with contextlib.suppress(BrokenPipeError, RuntimeError, ValueError):  # the keeper may have ended before
            self.ended(daemon)
        daemon.state = DOWN

    def freeze(self, daemon):
        """Stops a daemon by SIGSTOP; its connections stay open."""
        os.kill(daemon.process.pid, signal.SIGSTOP)
        daemon.state = FROZEN

    def thaw(self, daemon):
        os.kill(daemon.process.pid, signal.SIGCONT)
        daemon.state = RUNNING

    def drain(self, daemon):
        """Ends a daemon by SIGTERM, as an operator does. It must end in time, with exit code 0."""
        daemon.process.terminate()
        try:
            code = daemon.process.wait(timeout=DRAIN_SECONDS)
        except subprocess.TimeoutExpired:
            self.kill(daemon)
            raise DaemonError(f"{daemon} did not end within {DRAIN_SECONDS} s of SIGTERM: {self.log_tail(daemon)}") from None
        self.ended(daemon)
        if code != 0:
            raise DaemonError(f"{daemon} ended with {code} after SIGTERM: {self.log_tail(daemon)}")

    def revive(self, daemon):
        """Makes a daemon run, whether it is frozen or down."""
        if daemon.state == FROZEN:
            self.thaw(daemon)
        elif daemon.state == DOWN:
            self.start(daemon)

    def repair(self):
        """Opens all links of the daemons and makes all of them run."""
        if self.engine:
            self.engine.set_links(OPEN, sources=[daemon.name for daemon in self.daemons])
            self.keeper.set([self.peers_link(daemon) for daemon in self.daemons], OPEN)
        for daemon in self.daemons:
            self.revive(daemon)

    # Clusters.

    def cut_from_engine(self, daemon, state=CUT, nodes=None):
        """Cuts a daemon off from some nodes of the engine, by default from all."""
        self.engine.set_links(state, sources=[daemon.name], nodes=nodes)

    def cut_from_peers(self, daemon, state=CUT):
        """Cuts all other daemons off from a daemon, but not its clients, nor it from them."""
        self.keeper.set([self.peers_link(daemon)], state)

    def is_damaged(self, daemon, scene):
        """Returns whether a daemon says that the stored data of a scene is damaged."""
        return self.caller.call(daemon.name, "Scene", "GetScene", name=scene).reason == "REASON_DAMAGED"

    def placement(self, scene):
        """Returns the newest ScenePlacement that a running daemon tells, or None."""
        newest = None
        for daemon in self.running():
            answer = self.caller.call(daemon.name, "Scene", "GetScene", name=scene)
            if not answer.answered or not has_field(answer.response.scene, "placement"):
                continue
            found = answer.response.scene.placement
            if newest is None or found.token > newest.token:
                newest = found
        return newest

    def leader(self, scene, seconds=START_SECONDS):
        """Returns the daemon that leads a scene, and waits until there is one."""
        names = self.names()

        def find():
            found = self.placement(scene)
            name = names.get(found.leader) if found else None
            return self.by_name(name) if name and self.by_name(name).state == RUNNING else None
        return wait_for(find, seconds, f"a daemon leads {scene}")

    def followers(self, scene):
        """Returns the running daemons that follow a scene; none if nobody tells any."""
        found, names = self.placement(scene), self.names()
        told = {names.get(follower.address) for follower in found.followers} if found else ()
        return [daemon for daemon in self.running() if daemon.name in told]
