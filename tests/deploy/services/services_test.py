"""Checks that deploy/packages.sh starts no service: runs it with a `sudo` that only writes down what it is asked to do.

    python3 services_test.py SOURCE_DIRECTORY
"""
import os
import re
import subprocess
import sys
import tempfile
import unittest

SCRIPT = os.path.join(os.path.abspath(sys.argv[1]), "deploy/packages.sh")
POLICY, NO_DATABASE = "/usr/sbin/policy-rc.d", "/etc/postgresql-common/createcluster.d/locus-tests.conf"
SUDO = '#!/bin/sh\necho "$@" >> "$LOG"\n' + \
    'case " $* " in *" install "*) exit "$INSTALL_EXIT" ;; " test -e "*) exit "$POLICY_TEST" ;; esac\ncat > /dev/null\n'
PROGRAMS = {"sudo": SUDO, "id": "#!/bin/sh\necho 1000\n", "apt-get": "#!/bin/sh\nexit 1\n", "systemctl": "#!/bin/sh\nexit 1\n",
            "dpkg-query": '#!/bin/sh\nfor name; do :; done\ncase " $INSTALLED " in *" $name "*) echo installed ;; esac\n'}


def install(*sets, installed="", succeeds=True, has_policy=False):
    """Returns the commands that the script runs as root, in order, on a machine where only `installed` is installed."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in PROGRAMS.items():
            path = os.path.join(folder, name)
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
            os.chmod(path, 0o755)
        log = os.path.join(folder, "log")
        environment = {"PATH": f"{folder}:{os.environ['PATH']}", "LOG": log, "INSTALLED": installed,
                       "INSTALL_EXIT": "0" if succeeds else "100", "POLICY_TEST": "0" if has_policy else "1"}
        result = subprocess.run([SCRIPT, *sets], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, text=True, timeout=60, check=False)
        if (result.returncode == 0) != succeeds:
            raise AssertionError(f"packages.sh exited with {result.returncode}: {result.stdout}")
        with open(log, encoding="utf-8") as file:
            return file.read().splitlines()


def place(commands, pattern):
    """Returns the index of the only command that matches."""
    found = [index for index, command in enumerate(commands) if re.search(pattern, command)]
    if len(found) != 1:
        raise AssertionError(f"{pattern}: {len(found)} of {commands}")
    return found[0]


class ServicesTest(unittest.TestCase):
    def order(self, commands, *patterns):
        places = [place(commands, pattern) for pattern in patterns]
        self.assertEqual(places, sorted(places), commands)

    def test_a_policy_forbids_services_during_the_installation_only(self):
        self.order(install("edge"), f"^tee {POLICY}", f"^chmod 0755 {POLICY}", "install .*haproxy", f"^rm -f .*{POLICY}")
        self.order(install("edge", succeeds=False), f"^tee {POLICY}", "install .*haproxy", f"^rm -f .*{POLICY}")

    def test_a_policy_of_the_machine_stays_as_it_is(self):
        commands = install("edge", has_policy=True)
        self.assertEqual([command for command in commands if POLICY in command], [f"test -e {POLICY}"])

    def test_services_are_disabled_after_the_installation(self):
        for sets, services in (("edge", ["haproxy.service"]), ("cluster", ["patroni.service", "etcd.service", "haproxy.service"]),
                               ("container", ["podman.socket", "podman.service", "podman-auto-update.timer"])):
            commands = install(sets)
            for service in services:
                self.order(commands, "apt-get install", f"disable {service}$")

    def test_services_of_packages_that_were_installed_before_stay_as_they_are(self):
        commands = install("cluster", installed="haproxy")
        self.assertFalse([command for command in commands if "haproxy" in command], commands)
        place(commands, "disable etcd.service$")

    def test_postgresql_makes_no_database(self):
        self.order(install("test"), f"^tee {NO_DATABASE}", "install .*postgresql-15", f"^rm -f .*{NO_DATABASE}")

    def test_packages_without_services_leave_nothing(self):
        commands = install("lint")
        self.assertEqual(len(commands), 2, commands)
        place(commands, "apt-get install .*clang-tidy")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
