"""Upgrades, removes and installs the packages on a Debian that has been booted with systemd, under load:

    python3 upgrade_test.py --packages DIR --source DIR --build DIR --work DIR --cache DIR

The machine is a root of its own with systemd as its first process; its network is its own loopback. The packages of the
newer version are packed from the same build. Exits 77, which counts as skipped, if that cannot be done here.
"""

import argparse
import json
import os
import re
import shutil
import sys
import time
import unittest

import debian_root

HERE = os.path.dirname(os.path.abspath(__file__))
OURS = ("locusd", "locus", "python3-locus")
NEWER = "0.1.0+upgrade1"
CHANGED = "0.1.0+upgrade2"
LOAD_SECONDS = 3
UNIT = "/lib/systemd/system/locusd.service"


def with_changed_conffiles(deb, folder):
    """Returns a copy of a package with another version and other conffiles than the package has."""
    tree = os.path.join(folder, "changed")
    debian_root.run("dpkg-deb", "--raw-extract", deb, tree)
    control = os.path.join(tree, "DEBIAN/control")
    with open(control, encoding="utf-8") as file:
        text = file.read()
    with open(control, "w", encoding="utf-8") as file:
        file.write(re.sub(r"^Version: .*$", f"Version: {CHANGED}", text, flags=re.MULTILINE))
    for path in ("etc/default/locusd", "etc/locus/locusd.conf"):
        with open(os.path.join(tree, path), "a", encoding="utf-8") as file:
            file.write("# another line of the maintainers\n")
    path = os.path.join(folder, f"locusd_{CHANGED}_all.deb")
    debian_root.run("dpkg-deb", "--root-owner-group", "--build", tree, path)
    return path


class UpgradeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        root = os.path.join(OPTIONS.work, "machine")
        debian_root.unpack(debian_root.archive(OPTIONS.cache, "systemd", "systemd-sysv", "dbus"), root)
        older = debian_root.newest(OPTIONS.packages, *OURS)
        newer = os.path.join(OPTIONS.work, "newer")
        package = os.path.join(OPTIONS.source, "deploy/package.sh")
        debian_root.run(package, "--from", OPTIONS.build, "--out", newer, "--version", NEWER)
        newer_debs = debian_root.newest(newer, *OURS)
        cls.older = debian_root.add_packages(root, older)
        cls.newer = debian_root.add_packages(root, newer_debs)
        cls.changed = debian_root.add_packages(root, [with_changed_conffiles(newer_debs[0], OPTIONS.work)])
        shutil.copy(os.path.join(HERE, "upgrade_load.py"), os.path.join(root, "debs"))
        debian_root.inside(root, "apt-get", "update")
        debian_root.inside(root, "apt-get", "install", "--yes", "--no-install-recommends", *cls.older)
        debian_root.inside(root, "apt-get", "purge", "--yes", *OURS)
        cls.machine = debian_root.Machine(root)

    @classmethod
    def tearDownClass(cls):
        cls.machine.power_off()
        shutil.rmtree(OPTIONS.work, ignore_errors=True)

    def setUp(self):
        self.machine.run("dpkg", "--install", *self.older)
        self.machine.wait_until("is-active", "active", "locusd")
        self.wait_for_health()

    def tearDown(self):
        self.machine.run("dpkg", "--purge", *OURS)

    def wait_for_health(self):
        deadline = time.monotonic() + 30
        while "SERVING" not in self.machine.run("locus", "health", check=False).upper():
            if time.monotonic() > deadline:
                raise AssertionError(self.machine.run("journalctl", "--unit=locusd", "--no-pager", check=False))
            time.sleep(0.1)

    def main_process(self):
        return self.machine.run("systemctl", "show", "--property=MainPID", "--value", "locusd").strip()

    def version(self, package="locusd"):
        return self.machine.run("dpkg-query", "-W", "-f", "${Version}", package)

    def append(self, path, line):
        self.machine.run("sh", "-c", f"echo '{line}' >> {path}")

    def limit(self, name):
        for line in self.machine.run("locus", "-o", "ndjson", "limits").splitlines():
            if json.loads(line)["name"] == name:
                return int(json.loads(line)["value"])
        raise AssertionError("no limit " + name)

    def test_an_upgrade_under_load_loses_no_acknowledged_update(self):
        before = self.main_process()
        load = self.machine.start("python3", "/debs/upgrade_load.py", "/run/stop", stdout=-1, stderr=-1, text=True)
        time.sleep(LOAD_SECONDS)
        self.assertIsNone(load.poll())
        self.machine.run("dpkg", "--install", *self.newer)
        self.assertEqual(self.version(), NEWER)
        self.assertNotEqual(self.main_process(), before)
        time.sleep(LOAD_SECONDS)
        self.machine.run("touch", "/run/stop")
        output, errors = load.communicate(timeout=60)
        self.assertEqual(load.returncode, 0, errors)
        result = json.loads(output)
        print("upgrade under load:", output.strip(), flush=True)
        self.assertEqual(result["problems"], [])
        self.assertGreater(result["acked"], 1000)
        self.assertGreater(result["queries"], 100)
        dumped = self.machine.run("locus", "-o", "csv", "dump", "upgrade")
        found = {int(row.split(",")[column]) for rows in [dumped.splitlines()] for column in [rows[0].split(",").index("id")]
                 for row in rows[1:]}
        lost = set(range(1, result["acked"] + 1)) - found
        self.assertEqual(lost, set())
        journal = self.machine.run("journalctl", "--unit=locusd", "--no-pager", "--output=cat")
        self.assertIn("draining", journal)
        self.assertNotIn("Failed with result", journal)

    def test_edited_conffiles_survive_upgrades(self):
        self.append("/etc/locus/locusd.conf", "max-scenes = 77")
        self.append("/etc/default/locusd", "LOCUS_MAX_STREAMS=55")
        edited = self.machine.run("cat", "/etc/locus/locusd.conf", "/etc/default/locusd")
        self.machine.run("dpkg", "--install", *self.newer)
        self.assertEqual(self.machine.run("cat", "/etc/locus/locusd.conf", "/etc/default/locusd"), edited)
        # Where the maintainers changed the file, too, dpkg asks; unattended, it keeps the edited one with this option.
        self.machine.run("dpkg", "--force-confold", "--install", *self.changed)
        self.assertEqual(self.version(), CHANGED)
        self.assertEqual(self.machine.run("cat", "/etc/locus/locusd.conf", "/etc/default/locusd"), edited)
        self.wait_for_health()
        self.assertEqual(self.limit("scenes"), 77)

    def test_the_unit_is_clean_and_hardened(self):
        self.assertEqual(self.machine.run("systemd-analyze", "verify", "--man=no", UNIT), "")
        shown = self.machine.run("systemd-analyze", "security", "--offline=true", "--threshold=11", UNIT)
        print(shown.strip().splitlines()[-1], flush=True)

    def test_reloading_keeps_the_process(self):
        before = self.main_process()
        self.machine.run("systemctl", "reload", "locusd")
        self.assertEqual(self.main_process(), before)
        self.wait_for_health()

    def test_the_daemon_listens_on_loopback_only_and_has_no_rights(self):
        status = self.machine.run("sh", "-c", f"cat /proc/{self.main_process()}/status /proc/net/tcp")
        self.assertNotRegex(status, r"(?m)^Uid:\t0\t")
        self.assertIn("CapEff:\t0000000000000000", status)
        listening = re.findall(r"^\s*\d+: ([0-9A-F]+):([0-9A-F]{4}) \S+ 0A ", status, re.MULTILINE)
        self.assertEqual({port for _, port in listening}, {"1D97", "1D98"})
        self.assertEqual({address for address, _ in listening}, {"0100007F"})

    def test_purging_stops_the_daemon_and_leaves_nothing(self):
        self.machine.run("locus", "scene", "create", "yard")
        self.machine.run("dpkg", "--remove", *OURS)
        self.machine.wait_until("is-active", "inactive", "locusd")
        self.assertNotEqual(self.machine.run("ls", "-A", "/var/lib/private/locus"), "")
        self.machine.run("dpkg", "--install", *self.older)
        self.wait_for_health()
        self.assertIn("yard", self.machine.run("locus", "scene", "list"))
        self.machine.run("dpkg", "--purge", *OURS)
        shown = self.machine.run("find", "/", "-xdev", "-path", "/debs", "-prune", "-o", "-name", "*locus*", "-print")
        self.assertEqual(shown, "")


def options():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("packages", "source", "build", "work", "cache"):
        parser.add_argument("--" + name, required=True, type=os.path.abspath)
    return parser.parse_args()


if __name__ == "__main__":
    OPTIONS = options()
    REASON = debian_root.missing(OPTIONS.packages)
    if not REASON and not debian_root.control_groups():
        REASON = "control groups of version 2 are not mounted"
    if REASON:
        print("SKIPPED:", REASON)
        sys.exit(debian_root.SKIPPED)
    unittest.main(argv=sys.argv[:1], verbosity=2)
