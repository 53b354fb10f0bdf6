"""Replicated PostgreSQL for tests: a primary and two standbys in a temporary folder, on free ports of loopback, with quorum
commit. Nodes can be killed, frozen, cut off, promoted and joined again; everything that is started is ended.

    with Engine() as engine:
        session = Session(engine.dsn(engine.primary))
        engine.kill(engine.primary)
        engine.fail_over()

Every client has relays of its own to each node (`source` names the client), and so has each node to each other node, so that
a fault can cut or hang any pair. The harness itself connects past the relays. It is the failover manager, as Patroni is in
production: it promotes the standby that is furthest, after both standbys stopped to receive, since an acknowledged commit is
on the primary and on at least one of them.
"""
import contextlib
import os
import pwd
import random
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time

import keeper
import sql
from keeper import CUT, HUNG, OPEN, family, started_at

PROGRAMS = "/usr/lib/postgresql/15/bin"
USER, DATABASE = "locus", "locus"
START_SECONDS = 60
POLL_SECONDS = 0.05
REST_POLLS = 5  # equal positions in a row that count as the end; longer than wal_retrieve_retry_interval
PORTS = range(20000, 32000)  # below those that Linux gives to connections, so that a node that is down keeps its port
MEMORY_FOLDER = "/dev/shm"
MEMORY_BYTES = 4 << 30  # free bytes that the memory folder must have to be used
DOWN, RUNNING, FROZEN = "down", "running", "frozen"
# Settings of every node. A server that is killed by a test must not lose what the machine's memory still has, so nothing is
# relaxed: a daemon refuses engines with fsync, full_page_writes or synchronous_commit off.
SETTINGS = {
    "listen_addresses": "127.0.0.1", "unix_socket_directories": "", "max_connections": 60, "shared_buffers": "32MB",
    "dynamic_shared_memory_type": "mmap", "wal_level": "replica", "hot_standby": "on", "fsync": "on", "full_page_writes": "on",
    "synchronous_commit": "on", "wal_log_hints": "on", "max_wal_senders": 8, "wal_keep_size": "512MB", "max_wal_size": "1GB",
    "wal_sender_timeout": "3s", "wal_receiver_timeout": "3s", "wal_receiver_status_interval": "1s",
    "wal_retrieve_retry_interval": "100ms", "autovacuum_naptime": "5s", "jit": "off", "log_line_prefix": "%m [%p] ",
}


class EngineError(Exception):
    """The engine did not do what the test asked for in time."""


def unavailable():
    """Returns why no engine can be started here; empty if one can be."""
    if not os.access(os.path.join(PROGRAMS, "postgres"), os.X_OK):
        return "PostgreSQL 15 is missing; deploy/packages.sh test installs it"
    if sql.psycopg2 is None:
        return "python3-psycopg2 is missing; deploy/packages.sh test installs it"
    return ""


def quick_folder():
    """Returns a folder in memory, or the usual temporary folder where that is too small.

    A node that is killed loses nothing there, since the machine goes on, and tests are several times faster. Benchmarks
    must use a disk, and power cuts need more than this module.
    """
    with contextlib.suppress(OSError):
        space = os.statvfs(MEMORY_FOLDER)
        if os.access(MEMORY_FOLDER, os.W_OK) and space.f_bavail * space.f_frsize >= MEMORY_BYTES:
            return MEMORY_FOLDER
    return tempfile.gettempdir()


def hold_port():
    """Returns a socket that holds a port of loopback that no process uses. A server that sets SO_REUSEADDR, as PostgreSQL and
    locusd do, can listen at the port, and no other hold_port() gets it, also while the server is down.
    """
    while True:
        holder = socket.socket()
        try:
            holder.bind(("127.0.0.1", random.SystemRandom().choice(PORTS)))
        except OSError:
            holder.close()
            continue
        holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # after bind(), which so took no port that is held
        return holder


def wait_for(condition, seconds, what):
    """Waits until condition() is true and returns its value. A lost connection counts as false."""
    until = time.monotonic() + seconds
    while True:
        with contextlib.suppress(sql.Unknown):
            value = condition()
            if value:
                return value
        if time.monotonic() > until:
            raise EngineError(f"{what}: not within {seconds} s")
        time.sleep(POLL_SECONDS)


class Node:
    """One PostgreSQL server. `follows` is the node whose commits it receives; None for a primary. `stale` says that it missed a
    promotion, so that it must be rewound before it follows again.
    """

    def __init__(self, name, folder):
        self.name, self.folder, self.data = name, folder, os.path.join(folder, name)
        self.holder = hold_port()
        self.port = self.holder.getsockname()[1]
        self.process, self.state, self.follows, self.stale = None, DOWN, None, False

    def __repr__(self):
        return self.name

    @property
    def log(self):
        return os.path.join(self.folder, self.name + ".log")


class Engine:
    """A context manager. `settings` are further settings of every node; with `quorum` False, commits wait for no standby.
    `parent` is the folder for all files; by default quick_folder(). After `life_seconds` everything is ended in any case.
    """

    def __init__(self, settings=None, quorum=True, life_seconds=900, parent=None):
        if unavailable():
            raise EngineError(unavailable())
        self.settings, self.quorum = dict(settings or {}), quorum
        self.keeper = keeper.Keeper(life_seconds)
        self.links = {}  # (source, node's name) -> port
        try:
            self.folder = tempfile.mkdtemp(prefix="locus-engine-", dir=parent or quick_folder())
            self.keeper.guard_folder(self.folder)
            self.prepare_user()
            self.nodes = [Node(f"n{number}", os.path.join(self.folder, "nodes")) for number in range(3)]
            self.primary = self.nodes[0]
            for node in self.nodes:  # all at once, so that a fault reaches those that are used later, too
                for other in self.nodes:
                    self.link(node.name, other)
            self.start_all()
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.keeper.close()
        for node in getattr(self, "nodes", ()):
            if node.process:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    node.process.wait(timeout=10)
            node.holder.close()

    # Processes and files.

    def prepare_user(self):
        """Makes the folder of the nodes, and password files for them and for this process. PostgreSQL refuses to run as root,
        so root runs it as the user of Debian's package.
        """
        nodes = os.path.join(self.folder, "nodes")
        os.mkdir(nodes, 0o700)
        os.chmod(self.folder, 0o711)
        self.as_user = []
        if os.geteuid() == 0:
            try:
                user = pwd.getpwnam("postgres")
            except KeyError:
                user = pwd.getpwnam("nobody")
            os.chown(nodes, user.pw_uid, user.pw_gid)
            self.as_user = ["setpriv", f"--reuid={user.pw_uid}", f"--regid={user.pw_gid}", "--clear-groups", "--"]
        password = secrets.token_hex(16)
        self.passfile, self.node_passfile = (os.path.join(folder, "passfile") for folder in (self.folder, nodes))
        for path, text in ((self.passfile, f"*:*:*:{USER}:{password}\n"), (self.node_passfile, f"*:*:*:{USER}:{password}\n"),
                           (os.path.join(nodes, "password"), password + "\n")):
            self.write(path, text)

    def write(self, path, text):
        """Writes a file that only its owner can read; in the folder of the nodes, their user owns it."""
        with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w", encoding="utf-8") as file:
            file.write(text)
        if os.geteuid() == 0:
            owner = os.stat(os.path.dirname(path))
            os.chown(path, owner.st_uid, owner.st_gid)

    def program(self, name, *arguments, check=True, seconds=START_SECONDS):
        """Runs a program of PostgreSQL as the user of the nodes. Returns whether it succeeded."""
        result = subprocess.run([*self.as_user, os.path.join(PROGRAMS, name), *arguments], cwd="/", text=True,
                                env={**os.environ, "PGPASSFILE": self.node_passfile, "LC_ALL": "C"}, stdin=subprocess.DEVNULL,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=seconds, check=False)
        if check and result.returncode != 0:
            raise EngineError(f"{name} failed: {result.stdout[-600:]}")
        return result.returncode == 0

    def log_tail(self, node):
        with contextlib.suppress(OSError):
            with open(node.log, encoding="utf-8", errors="replace") as file:
                return file.read()[-800:]
        return ""

    # Connections.

    def link(self, source, node):
        """Returns the port at which `source`, the name of a client or of a node, reaches a node."""
        key = (source, node.name)
        if key not in self.links:
            self.links[key] = self.keeper.link(f"{source}>{node.name}", node.port)
        return self.links[key]

    def set_links(self, state, sources=None, nodes=None):
        """Sets the links of some sources to some nodes to OPEN, CUT or HUNG. None means all sources, or all nodes. Links of
        clients that are made later are open.
        """
        names = [f"{source}>{name}" for source, name in self.links
                 if (sources is None or source in sources) and (nodes is None or name in [node.name for node in nodes])]
        self.keeper.set(names, state)

    def isolate(self, node, state=CUT):
        """Cuts a node off from all clients and all other nodes, in both directions."""
        self.set_links(state, nodes=[node])
        self.set_links(state, sources=[node.name])

    def heal(self):
        """Opens all links."""
        self.set_links(OPEN)

    def dsn(self, node, source=None):
        """Returns the parameters of a connection to one node; without `source` past all relays."""
        port = self.link(source, node) if source else node.port
        return f"host=127.0.0.1 port={port} user={USER} dbname={DATABASE} passfile={self.passfile}"

    def postgresql_url(self, source):
        """Returns the address of all nodes for a client, whose connections go through the relays of `source`."""
        hosts = ",".join(f"127.0.0.1:{self.link(source, node)}" for node in self.nodes)
        return f"postgresql://{USER}@{hosts}/{DATABASE}?passfile={self.passfile}"

    def ask(self, node, text, *arguments, seconds=sql.CONNECT_SECONDS):
        return sql.ask(self.dsn(node), text, *arguments, seconds=seconds)

    # Start and stop.

    def start_all(self):
        first = self.primary
        self.program("initdb", "-D", first.data, "-U", USER, "--encoding=UTF8", "--locale=C", "--auth-host=scram-sha-256",
                     "--auth-local=reject", "--pwfile", os.path.join(first.folder, "password"), "--no-sync", "--no-instructions")
        quorum, self.quorum = self.quorum, False
        self.start(first, database="postgres")
        sql.ask(self.dsn(first).replace(f"dbname={DATABASE}", "dbname=postgres"), f"CREATE DATABASE {DATABASE}", seconds=20)
        self.ask(first, "CREATE TABLE probe (at timestamptz)")
        for node in self.nodes[1:]:
            self.copy_primary(node)
            self.start(node)
        self.set_quorum(quorum)
        self.wait_until_replicated()

    def configure(self, node):
        """Writes all settings of a node."""
        others = ", ".join(other.name for other in self.nodes if other is not node)
        settings = {**SETTINGS, **self.settings, "port": node.port, "cluster_name": node.name,
                    "synchronous_standby_names": f"ANY 1 ({others})" if self.quorum else ""}
        if node.follows:
            settings["primary_conninfo"] = (f"host=127.0.0.1 port={self.link(node.name, node.follows)} user={USER} "
                                            f"passfile={self.node_passfile} application_name={node.name} connect_timeout=3")
        self.write(os.path.join(node.data, "postgresql.conf"),
                   "".join(f"{name} = '{value}'\n" for name, value in settings.items()))

    def reload(self, node):
        """Writes the settings of a node anew and lets it read them."""
        self.configure(node)
        if node.state == RUNNING:
            os.kill(node.process.pid, signal.SIGHUP)

    def start(self, node, database=DATABASE):
        """Starts a node that is down, as what it was: the primary, or a standby."""
        self.configure(node)
        with open(node.log, "ab") as log:
            node.process = subprocess.Popen([*self.as_user, os.path.join(PROGRAMS, "postgres"), "-D", node.data], cwd="/",
                                            stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
        self.keeper.guard(node.process.pid)
        node.state = RUNNING
        dsn = self.dsn(node).replace(f"dbname={DATABASE}", f"dbname={database}")

        def answers():
            if node.process.poll() is not None:
                raise EngineError(f"node {node} did not start: {self.log_tail(node)}")
            return sql.ask(dsn, "SELECT 1")
        wait_for(answers, START_SECONDS, f"node {node} answers")

    def kill(self, node):
        """Kills all processes of a node with SIGKILL: nothing is written any more."""
        os.kill(node.process.pid, signal.SIGSTOP)  # so that it starts no further process
        members = [(pid, started_at(pid)) for pid in family(node.process.pid)]
        for pid, _ in members:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        node.process.wait()
        wait_for(lambda: all(start is None or started_at(pid) != start for pid, start in members), START_SECONDS,
                 f"node {node} ends")
        self.keeper.release(node.process.pid)
        node.state = DOWN

    def freeze(self, node):
        """Stops all processes of a node by SIGSTOP; its connections stay open."""
        for pid in family(node.process.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGSTOP)
        node.state = FROZEN

    def thaw(self, node):
        """Wakes a frozen node."""
        for pid in family(node.process.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        node.state = RUNNING

    def revive(self, node):
        """Makes a node run, whether it is frozen or down."""
        if node.state == FROZEN:
            self.thaw(node)
        elif node.state == DOWN:
            self.start(node)

    def wipe(self, node):
        """Deletes all data of a node that is down, as a lost disk does, and the shared memory that a killed node leaves."""
        with contextlib.suppress(OSError, IndexError):
            with open(os.path.join(node.data, "postmaster.pid"), encoding="utf-8") as file:
                identifier = file.read().split("\n")[6].split()[1]
            subprocess.run(["ipcrm", "-m", identifier], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        shutil.rmtree(node.data)
        node.stale = True

    # Replication.

    def set_quorum(self, quorum):
        """Decides whether commits wait for a standby."""
        self.quorum = quorum
        for node in self.nodes:
            if node.state == RUNNING:
                self.reload(node)
        expected = "ANY" if quorum else ""
        wait_for(lambda: self.ask(self.primary, "SHOW synchronous_standby_names")[0][0].startswith(expected) and
                 bool(self.ask(self.primary, "SHOW synchronous_standby_names")[0][0]) == quorum, 10, "the quorum is set")

    def standbys(self):
        """Returns the nodes that follow the primary, whether they are up or not."""
        return [node for node in self.nodes if node.follows is self.primary]

    def copy_primary(self, node):
        """Fills the folder of a node with a base backup of the primary and makes it a standby."""
        if os.path.exists(node.data):
            shutil.rmtree(node.data)
        self.program("pg_basebackup", "-D", node.data, "-X", "stream", "-c", "fast", "--no-sync", "-d",
                     f"host=127.0.0.1 port={self.primary.port} user={USER} dbname=postgres")
        self.follow(node)

    def follow(self, node):
        """Makes a node that is down a standby of the primary."""
        node.follows, node.stale = self.primary, False
        self.write(os.path.join(node.data, "standby.signal"), "")

    def wait_until_replicated(self, seconds=START_SECONDS):
        """Waits until all running standbys receive from the primary and have all that it has now."""
        names = sorted(node.name for node in self.standbys() if node.state == RUNNING)
        # A commit that is flushed here, before any standby has it, flushes all commits before it.
        wait_for(lambda: self.ask(self.primary, "SET synchronous_commit = local; INSERT INTO probe VALUES (now()) RETURNING 1"),
                 seconds, f"{self.primary} commits")
        position = self.ask(self.primary, "SELECT pg_current_wal_flush_lsn()")[0][0]

        def complete():
            rows = self.ask(self.primary, "SELECT application_name FROM pg_stat_replication WHERE state = 'streaming' AND "
                            "flush_lsn >= %s::pg_lsn", position)
            return sorted(row[0] for row in rows) == names
        wait_for(complete, seconds, f"{names} follow {self.primary}")

    def end_of_log(self, node):
        """Returns how far a standby that receives nothing any more got: waits until it has replayed all that it has."""
        query = ("SELECT (SELECT count(*) FROM pg_stat_wal_receiver), (SELECT wait_event FROM pg_stat_activity WHERE "
                 "backend_type = 'startup'), current_setting('primary_conninfo'), "
                 "pg_wal_lsn_diff(pg_last_wal_replay_lsn(), '0/0')::bigint")
        seen = []

        def at_end():
            receivers, event, source, position = self.ask(node, query)[0]
            at_rest = receivers == 0 and source == "" and event == "RecoveryRetrieveRetryInterval"
            seen.append(position if at_rest else None)
            # The process that replays may read the settings a moment later than the one that answers.
            return position if at_rest and seen[-REST_POLLS:] == [position] * REST_POLLS else None
        return wait_for(at_end, START_SECONDS, f"{node} has replayed its log")

    def fail_over(self):
        """Promotes the standby that is furthest, and lets the other one follow it. The old primary stays as it is: stale.

        Every standby is asked, and is started first if it is down: the one that is away may be the one that has the last
        acknowledged commits.
        """
        old, standbys = self.primary, self.standbys()
        for node in standbys:
            node.follows = None
            self.revive(node)
            self.reload(node)  # without primary_conninfo it receives nothing, so its position is final
        best = max(standbys, key=self.end_of_log)
        if not self.ask(best, "SELECT pg_promote(true, 30)", seconds=40)[0][0]:
            raise EngineError(f"{best} was not promoted: {self.log_tail(best)}")
        self.primary, old.stale, old.follows = best, True, None
        for node in standbys:
            if node is not best:
                node.follows = best
                self.reload(node)
        return best

    def rejoin(self, node):
        """Makes a stale node, for example an old primary, a standby: by pg_rewind, or by a new copy where that fails."""
        if node.state != DOWN:
            if node.state == FROZEN:
                self.thaw(node)
            self.kill(node)
        rewound = False
        if os.path.exists(os.path.join(node.data, "PG_VERSION")):
            self.ask(self.primary, "CHECKPOINT", seconds=30)  # pg_rewind reads the new timeline from the last checkpoint
            with contextlib.suppress(subprocess.TimeoutExpired):
                rewound = self.program("pg_rewind", "-D", node.data, "--no-sync", "--source-server",
                                       f"host=127.0.0.1 port={self.primary.port} user={USER} dbname=postgres", check=False)
        if rewound:
            self.follow(node)
        else:
            self.copy_primary(node)
        self.start(node)
        return "rewound" if rewound else "copied"

    def repair(self):
        """Opens all links, starts all nodes and joins the stale ones again. Waits until all is replicated."""
        self.heal()
        self.revive(self.primary)
        for node in self.nodes:
            if node.stale:
                self.rejoin(node)
            else:
                self.revive(node)
        self.wait_until_replicated()

    def wait_until_writable(self, seconds=START_SECONDS):
        """Waits until the primary commits, which includes an answer of a standby. Returns the seconds that it took."""
        start = time.monotonic()
        wait_for(lambda: self.ask(self.primary, "INSERT INTO probe VALUES (now()) RETURNING 1"), seconds,
                 "the engine takes writes")
        return time.monotonic() - start


__all__ = ["CUT", "HUNG", "OPEN", "Engine", "EngineError", "Node", "unavailable"]
