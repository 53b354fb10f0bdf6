"""The cluster of deploy/cluster in plain processes on loopback, from the same files: three etcd, three PostgreSQL with Patroni,
and, where locusd can be a member of a cluster, three locusd behind HAProxy. Everything that is started is ended.

Each node of the engine is a container of processes, as in the compose file: a process namespace, which ends as a whole.
"""
import contextlib
import json
import os
import pwd
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request

SOURCE = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../.."))
sys.path.insert(0, os.path.join(SOURCE, "tests/cluster"))

import keeper  # noqa: E402
import sql  # noqa: E402
from engine import EngineError, hold_port, quick_folder, wait_for  # noqa: E402

DEPLOY = os.path.join(SOURCE, "deploy/cluster")
ETCD, PATRONI, HAPROXY, POSTGRES = "/usr/bin/etcd", "/usr/bin/patroni", "/usr/sbin/haproxy", "/usr/lib/postgresql/15/bin/postgres"
START_SECONDS, HTTP_SECONDS = 120, 2
COUNT = 3


def unavailable():
    """Returns why no cluster can be started here; empty if one can be."""
    missing = [path for path in (ETCD, PATRONI, HAPROXY, POSTGRES) if not os.access(path, os.X_OK)]
    if missing or sql.psycopg2 is None:
        return f"{', '.join(missing) or 'psycopg2'}: missing; deploy/packages.sh cluster installs it"
    if os.geteuid() != 0:
        return "process namespaces of their own need root"
    return ""


def page(port, path):
    """Returns the JSON of a page of Patroni, or None if it does not answer."""
    with contextlib.suppress(OSError, ValueError):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=HTTP_SECONDS) as answer:
            return json.load(answer)
    return None


class Member:
    """One etcd, or one node of the engine: its two ports, which are held while it is down, and its process."""

    def __init__(self, name):
        self.name, self.process = name, None
        self.holders = [hold_port(), hold_port()]
        self.ports = [holder.getsockname()[1] for holder in self.holders]

    def release_ports(self):
        for holder in self.holders:
            holder.close()


class PlainCluster:
    """A context manager: the engine, with etcd. After `life_seconds` everything is ended in any case."""

    def __init__(self, life_seconds=900):
        self.keeper = keeper.Keeper(life_seconds)
        self.folder = tempfile.mkdtemp(prefix="locus-plain-cluster-", dir=quick_folder())
        self.keeper.guard_folder(self.folder)
        os.chmod(self.folder, 0o711)
        self.members, self.processes = [], []
        self.etcds = [self.member(f"etcd-{number}") for number in range(1, COUNT + 1)]
        self.nodes = [self.member(f"engine-{number}") for number in range(1, COUNT + 1)]
        try:
            self.prepare()
            for member in self.etcds:
                self.start_etcd(member)
            for node in self.nodes:
                self.start_node(node)
            wait_for(self.is_complete, START_SECONDS, "two standbys follow a primary")
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.keeper.close()
        for process in self.processes:
            process.wait(timeout=30)
        for member in self.members:
            member.release_ports()

    def member(self, name, kind=Member):
        self.members.append(kind(name))
        return self.members[-1]

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def prepare(self):
        """Makes the passwords by the script that operators use, and copies what the user of PostgreSQL must read."""
        self.user = pwd.getpwnam("postgres")
        self.run([os.path.join(DEPLOY, "secrets.sh"), self.path("secrets")])
        os.chown(self.path("secrets", "passfile"), os.geteuid(), os.getegid())  # not the user of the image, as this is none
        with open(self.path("secrets", "engine.env"), encoding="utf-8") as file:
            self.secrets = dict(line.rstrip("\n").split("=", 1) for line in file)
        shutil.copy(os.path.join(DEPLOY, "engine/create_database.sh"), self.path("create_database.sh"))
        # Shared memory outside of a node's folder would outlive a node that is killed.
        parameters = '  parameters:\n    unix_socket_directories: ""\n'
        with open(os.path.join(DEPLOY, "engine/patroni.yml"), encoding="utf-8") as file:
            before, _, after = file.read().rpartition(parameters)
        with open(self.path("patroni.yml"), "w", encoding="utf-8") as file:
            file.write(before + parameters + "    dynamic_shared_memory_type: mmap\n" + after)
        for member in self.etcds + self.nodes:
            os.mkdir(self.path(member.name), 0o700)
            os.chown(self.path(member.name), self.user.pw_uid, self.user.pw_gid)

    @staticmethod
    def run(command, **options):
        result = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                timeout=60, check=False, **options)
        if result.returncode != 0:
            raise EngineError(f"{command[0]} failed: {result.stdout[-600:]}")
        return result.stdout

    def start(self, name, command, environment, user=None):
        """Starts a program in a process namespace of its own, as another user if one is given. Returns the process."""
        prefix = ["setpriv", f"--reuid={user.pw_uid}", f"--regid={user.pw_gid}", "--clear-groups", "--"] if user else []
        variables = {"PATH": f"{self.folder}:/usr/bin:/bin:/usr/sbin:/sbin", "LC_ALL": "C.UTF-8", **environment}
        with open(self.path(name + ".log"), "ab") as log:
            process = subprocess.Popen(["unshare", "--pid", "--ipc", "--fork", "--mount-proc", "--", *prefix, *command],
                                       env=variables, cwd=self.path(name) if user else self.folder, stdin=subprocess.DEVNULL,
                                       stdout=log, stderr=log)
        self.keeper.guard(process.pid)
        self.processes.append(process)
        return process

    def log(self, name):
        with open(self.path(name + ".log"), encoding="utf-8", errors="replace") as file:
            return file.read()

    # Processes.

    def start_etcd(self, member):
        def urls(port):
            return f"http://127.0.0.1:{port}"
        client, peer = (urls(port) for port in member.ports)
        member.process = self.start(member.name, [ETCD], {
            "ETCD_NAME": member.name, "ETCD_DATA_DIR": self.path(member.name, "data"), "ETCD_INITIAL_CLUSTER_TOKEN": "locus",
            "ETCD_INITIAL_CLUSTER": ",".join(f"{other.name}={urls(other.ports[1])}" for other in self.etcds),
            "ETCD_INITIAL_CLUSTER_STATE": "new", "ETCD_LISTEN_CLIENT_URLS": client, "ETCD_ADVERTISE_CLIENT_URLS": client,
            "ETCD_LISTEN_PEER_URLS": peer, "ETCD_INITIAL_ADVERTISE_PEER_URLS": peer}, self.user)

    def start_node(self, node):
        node.process = self.start(node.name, [PATRONI, self.path("patroni.yml")], {
            **self.secrets, "PATRONI_NAME": node.name,
            "PATRONI_ETCD3_HOSTS": ",".join(f"127.0.0.1:{member.ports[0]}" for member in self.etcds),
            "PATRONI_POSTGRESQL_LISTEN": f"127.0.0.1:{node.ports[0]}",
            "PATRONI_POSTGRESQL_CONNECT_ADDRESS": f"127.0.0.1:{node.ports[0]}",
            "PATRONI_POSTGRESQL_DATA_DIR": self.path(node.name, "data"),
            "PATRONI_POSTGRESQL_PGPASS": self.path(node.name, "pgpass"),
            "PATRONI_RESTAPI_LISTEN": f"127.0.0.1:{node.ports[1]}",
            "PATRONI_RESTAPI_CONNECT_ADDRESS": f"127.0.0.1:{node.ports[1]}"}, self.user)

    def kill(self, member):
        """Kills all processes of a member with SIGKILL, as a machine does that loses its power."""
        members = [pid for pid in keeper.family(member.process.pid) if pid != member.process.pid]
        os.kill(members[0], signal.SIGKILL)  # the first process of the namespace: the kernel kills all others with it
        member.process.wait(timeout=30)
        self.keeper.release(member.process.pid)

    @staticmethod
    def signal(member, number):
        """Sends a signal to all processes of a member."""
        for pid in keeper.family(member.process.pid):
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, number)

    # The engine's state.

    def states(self):
        """Returns the name, role and state of each node that some node knows."""
        for node in self.nodes:
            cluster = page(node.ports[1], "/cluster")
            if cluster:
                return {member["name"]: (member["role"], member["state"]) for member in cluster["members"]}
        return {}

    def is_complete(self):
        """Returns whether two standbys follow a primary, one of them synchronously."""
        roles = sorted(role for role, state in self.states().values() if state in ("running", "streaming"))
        return roles == ["leader", "replica", "sync_standby"]

    def primary(self):
        """Returns the node that leads for Patroni; None while there is none."""
        return next((node for node in self.nodes if self.states().get(node.name, ("",))[0] == "leader"), None)

    def dsn(self, node):
        return (f"host=127.0.0.1 port={node.ports[0]} user=locus dbname=locus passfile={self.path('secrets', 'passfile')} "
                "connect_timeout=3 target_session_attrs=read-write")

    def url(self):
        """Returns the address of the engine as locusd takes it."""
        hosts = ",".join(f"127.0.0.1:{node.ports[0]}" for node in self.nodes)
        return f"postgresql://locus@{hosts}/locus?passfile={self.path('secrets', 'passfile')}"

    def ask(self, text, *arguments):
        """Runs a statement at the node that takes writes."""
        def answer():
            for node in self.nodes:
                with contextlib.suppress(sql.Unknown):
                    return sql.ask(self.dsn(node), text, *arguments) or [()]
            return None
        return wait_for(answer, START_SECONDS, text)


def seconds_since(start):
    return f"{time.monotonic() - start:.1f} s"


__all__ = ["COUNT", "DEPLOY", "HAPROXY", "Member", "PlainCluster", "page", "seconds_since", "unavailable", "wait_for"]
