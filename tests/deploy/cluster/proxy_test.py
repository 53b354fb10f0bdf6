"""Tests of the files of deploy/cluster that need no PostgreSQL: the proxy leads calls to the daemon of their scene, and what the
compose file, the settings of Patroni and the scripts promise holds.

    LOCUS_PACKAGE=build/release/python LOCUS_BIN=build/release/bin python3 proxy_test.py

Exits 77, which counts as skipped, without HAProxy, psycopg2 or the Python package of locus.
"""
import os
import re
import stat
import subprocess
import sys
import tempfile
import unittest

import yaml

sys.dont_write_bytecode = True
SOURCE = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../.."))
DEPLOY = os.path.join(SOURCE, "deploy/cluster")
sys.path[:0] = [os.path.join(SOURCE, "tests/cluster"), DEPLOY]

import calls  # noqa: E402
from daemons import Daemons  # noqa: E402
from engine import hold_port, wait_for  # noqa: E402
from keeper import end_in_order  # noqa: E402

try:
    import update_map  # noqa: E402
except ImportError:
    update_map = None

SKIPPED = 77
HAPROXY = "/usr/sbin/haproxy"
CALL_SECONDS, START_SECONDS = 5, 30
CONNECTIONS = 6
MANY_SCENES = 1000


def content(name):
    with open(os.path.join(DEPLOY, name), encoding="utf-8") as file:
        return file.read()


class DaemonsWithPages(Daemons):
    """Daemons that serve /readyz, each on a free port."""

    def command(self, daemon, port_file):
        command = super().command(daemon, port_file)
        command[command.index("--http-listen") + 1] = "127.0.0.1:0"
        return command


class ProxyTest(unittest.TestCase):
    """Three daemons that know nothing of each other, so that it shows which of them a call reached."""

    def setUp(self):
        self.daemons = DaemonsWithPages(3, stored=False)
        self.addCleanup(self.daemons.close)
        self.folder = self.daemons.folder
        self.holder = hold_port()
        self.addCleanup(self.holder.close)
        self.address = f"127.0.0.1:{self.holder.getsockname()[1]}"
        self.socket, self.map = os.path.join(self.folder, "haproxy.sock"), os.path.join(self.folder, "scenes.map")
        open(self.map, "w", encoding="utf-8").close()
        variables = {"LOCUS_CLUSTER_LISTEN": self.address, "LOCUS_CLUSTER_ADMIN": self.socket, "LOCUS_CLUSTER_MAP": self.map}
        for number, daemon in enumerate(self.daemons.daemons, 1):
            variables[f"LOCUS_CLUSTER_DAEMON_{number}"] = daemon.address
            variables[f"LOCUS_CLUSTER_HTTP_{number}"] = self.http_port(daemon)
        self.check_configuration(variables)
        with open(os.path.join(self.folder, "haproxy.log"), "wb") as log:
            proxy = subprocess.Popen([HAPROXY, "-db", "-f", os.path.join(DEPLOY, "haproxy.cfg")], env={**os.environ, **variables},
                                     stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self.daemons.keeper.guard(proxy.pid)
        self.addCleanup(proxy.wait, 10)
        self.addCleanup(proxy.kill)
        wait_for(lambda: self.served_by("lobby"), START_SECONDS, "the proxy passes on calls")

    def http_port(self, daemon):
        found = wait_for(lambda: re.search(r"http_port=(\d+)", self.daemons.log_tail(daemon)), START_SECONDS, "it serves pages")
        return found[1]

    def check_configuration(self, variables):
        answer = subprocess.run([HAPROXY, "-c", "-f", os.path.join(DEPLOY, "haproxy.cfg")], env={**os.environ, **variables},
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60, check=False)
        self.assertEqual((answer.returncode, re.findall("WARNING.*|ALERT.*", answer.stdout)), (0, []), answer.stdout)

    def served_by(self, scene):
        """Returns the names of the daemons that calls for a scene reach, on several connections."""
        reached = set()
        for _ in range(CONNECTIONS):
            try:
                with calls.locus.connect(self.address, timeout=CALL_SECONDS) as client:
                    reached.add(client.scene(scene).labels["daemon"])
            except calls.locus.LocusError as error:
                if error.code.name != "NOT_FOUND":
                    return set()
                reached.add("not found")
        return reached

    def wait_until_served_by(self, scene, *daemons):
        """Waits until all calls for a scene are answered, and only by some of these daemons."""
        names = {daemon.name for daemon in daemons}
        wait_for(lambda: set() < self.served_by(scene) <= names, START_SECONDS, f"only {names} are asked")

    def create(self, scene, *daemons):
        for daemon in daemons:
            with calls.locus.connect(daemon.address, timeout=CALL_SECONDS) as client:
                client.create_scene(scene, labels={"daemon": daemon.name})

    def lead(self, leaders):
        update_map.replace(self.socket, self.map, {scene: daemon.address for scene, daemon in leaders.items()})

    def test_calls_reach_the_daemon_that_the_map_names_for_their_scene(self):
        daemons = self.daemons.daemons
        for scene in ("arena", "maze"):
            self.create(scene, *daemons)
        self.assertEqual(self.served_by("arena"), {daemon.name for daemon in daemons})  # any, as it is not in the map
        for first, second in ((0, 1), (2, 0)):
            self.lead({"arena": daemons[first], "maze": daemons[second]})
            self.assertEqual(self.served_by("arena"), {daemons[first].name})
            self.assertEqual(self.served_by("maze"), {daemons[second].name})

    def test_calls_for_a_daemon_that_is_lost_reach_another_one(self):
        first, second, third = self.daemons.daemons
        self.create("arena", first, second, third)
        self.lead({"arena": first})
        self.daemons.kill(first)
        self.wait_until_served_by("arena", second, third)
        self.daemons.kill(second)
        self.wait_until_served_by("arena", third)

    def test_a_daemon_that_drains_gets_no_new_calls(self):
        first, second, third = self.daemons.daemons
        self.create("arena", first, second, third)
        self.daemons.drain(first)
        self.wait_until_served_by("arena", second, third)

    def test_a_map_of_many_scenes_is_replaced_at_once(self):
        leaders = {f"arena-{number}": self.daemons.daemons[number % 3] for number in range(MANY_SCENES)}
        self.lead(leaders)
        self.assertEqual(update_map.current(self.socket, self.map), {scene: daemon.address for scene, daemon in leaders.items()})
        self.lead({})
        self.assertEqual(update_map.current(self.socket, self.map), {})

    def test_a_map_that_the_proxy_does_not_have_is_an_error(self):
        with self.assertRaises(update_map.ProxyError):
            update_map.replace(self.socket, "/nowhere.map", {"arena": "127.0.0.1:1"})


class FilesTest(unittest.TestCase):
    def test_every_container_is_without_privileges_and_limited(self):
        services = yaml.safe_load(content("compose.yaml"))["services"]
        self.assertEqual(len(services), 11)
        for name, service in services.items():
            with self.subTest(name):
                self.assertTrue(service["read_only"])
                self.assertEqual((service["cap_drop"], service["security_opt"]), (["ALL"], ["no-new-privileges"]))
                self.assertIn("mem_limit", service)
                self.assertIn("pids_limit", service)
                for port in service.get("ports", ()):
                    self.assertTrue(port.startswith("127.0.0.1:"), port)

    def test_every_image_is_built_by_one_service(self):
        services = yaml.safe_load(content("compose.yaml"))["services"].values()
        built = [service["image"] for service in services if "build" in service]
        self.assertEqual(sorted(built), sorted({service["image"] for service in services}))

    def test_commits_wait_for_a_second_machine_and_only_it_takes_over(self):
        settings = yaml.safe_load(content("engine/patroni.yml"))
        shared, parameters = settings["bootstrap"]["dcs"], settings["bootstrap"]["dcs"]["postgresql"]["parameters"]
        self.assertEqual((shared["synchronous_mode"], shared["synchronous_mode_strict"]), (True, True))
        self.assertEqual([parameters[name] for name in ("fsync", "full_page_writes", "synchronous_commit")], ["on"] * 3)
        self.assertNotIn("synchronous_standby_names", {**parameters, **settings["postgresql"]["parameters"]})
        self.assertLessEqual(shared["loop_wait"] + 2 * shared["retry_timeout"], shared["ttl"])  # as Patroni requires
        self.assertTrue(all(line.endswith("scram-sha-256") for line in settings["postgresql"]["pg_hba"]))

    def test_passwords_are_made_once_and_for_their_owner_only(self):
        with tempfile.TemporaryDirectory() as folder:
            command = [os.path.join(DEPLOY, "secrets.sh"), os.path.join(folder, "made")]
            subprocess.run(command, check=True, timeout=60)
            before = {}
            for name in ("engine.env", "passfile"):
                path = os.path.join(folder, "made", name)
                self.assertEqual(stat.S_IMODE(os.stat(path).st_mode), 0o600)
                with open(path, encoding="utf-8") as file:
                    before[name] = file.read()
            passwords = re.findall(r"PASSWORD=([0-9a-f]{48})$", before["engine.env"], re.MULTILINE)
            self.assertEqual(len(set(passwords)), 4)
            self.assertEqual(before["passfile"], f"*:*:locus:locus:{passwords[-1]}\n")
            again = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60, check=False)
            self.assertEqual(again.returncode, 1, again.stdout)
            with open(os.path.join(folder, "made", "engine.env"), encoding="utf-8") as file:
                self.assertEqual(file.read(), before["engine.env"])


if __name__ == "__main__":
    for missing in (calls.unavailable(), "" if os.access(HAPROXY, os.X_OK) else f"{HAPROXY}: missing",
                    "" if update_map else "psycopg2 is missing"):
        if missing:
            print(f"SKIPPED: {missing}; deploy/packages.sh test installs what is missing")
            sys.exit(SKIPPED)
    end_in_order()
    unittest.main(argv=sys.argv[:1], verbosity=2)
