"""Runs the commands of the pages in deploy/security, unchanged, on two simulated machines. A machine is a network
namespace and a mount namespace; a virtual cable connects the two machines.

    python3 hardening_test.py SOURCE_DIRECTORY BIN_DIRECTORY

Exits 77, which counts as skipped, if namespaces cannot be made.
"""
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

SOURCE, BIN = (os.path.abspath(path) for path in sys.argv[1:3])
PAGES = os.path.join(SOURCE, "deploy/security")
SERVER, CLIENT = "10.0.0.5", "10.0.0.6"
USER_ID = 61234  # user id of the user `locus` within the namespaces
WAIT_SECONDS = 30
SKIPPED = 77
SETUP = f"""
set -eu
ip link set lo up
cp /etc/hosts /etc/passwd {{folder}}/
echo '{SERVER} locus.internal' >> {{folder}}/hosts
echo 'locus:x:{USER_ID}:{USER_ID}::/nonexistent:/bin/sh' >> {{folder}}/passwd
mount --bind {{folder}}/hosts /etc/hosts
mount --bind {{folder}}/passwd /etc/passwd
mount -t tmpfs tmpfs /run
mount -t tmpfs tmpfs /var/lib
mkdir /run/locus /var/lib/locus
chown {USER_ID}:{USER_ID} /run/locus /var/lib/locus {{folder}}/work
echo ready
exec sleep 600
"""


def blocks(page, heading):
    """Returns the commands of one section of a page, as one text for each code block."""
    with open(os.path.join(PAGES, page), encoding="utf-8") as file:
        section = re.split(r"^## ", file.read(), flags=re.MULTILINE)
    text = next(part for part in section if part.startswith(heading))
    return re.findall(r"^```sh\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)


def can_make_machines():
    made = subprocess.run(["unshare", "--net", "--mount", "true"], capture_output=True, check=False)
    return os.geteuid() == 0 and made.returncode == 0 and shutil.which("ip") is not None


class Machine:
    """A machine made of a network namespace and a mount namespace, which a process keeps alive. `folder` is the folder
    of its user.
    """

    def __init__(self, root, name):
        self.folder = os.path.join(root, name, "work")
        os.makedirs(self.folder)
        for parent in (root, os.path.join(root, name)):
            os.chmod(parent, 0o755)
        self.programs = os.path.join(root, "bin")
        setup = SETUP.format(folder=os.path.dirname(self.folder))
        self.keeper = subprocess.Popen(["unshare", "--net", "--mount", "sh", "-c", setup], stdout=subprocess.PIPE, text=True)
        if self.keeper.stdout.readline() != "ready\n":
            raise RuntimeError(f"machine {name} did not start")

    def enter(self, command, user=True):
        """Returns the arguments that run `command`, a text for the shell, on this machine, as the user locus or as
        root.
        """
        as_user = ["setpriv", f"--reuid={USER_ID}", f"--regid={USER_ID}", "--clear-groups"] if user else []
        return ["nsenter", "-t", str(self.keeper.pid), "--net", "--mount", "--wd=" + self.folder, *as_user, "sh", "-c",
                f"PATH={self.programs}:$PATH\n{command}"]

    def run(self, command, user=True):
        return subprocess.run(self.enter(command, user), capture_output=True, text=True, timeout=WAIT_SECONDS, check=False)

    def stop(self):
        self.keeper.kill()
        self.keeper.wait()
        self.keeper.stdout.close()


class MutualTlsTest(unittest.TestCase):
    def setUp(self):
        root = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, root)
        os.mkdir(os.path.join(root, "bin"))
        for program in ("locus", "locusd"):  # copy the programs: the user may not be allowed to read BIN
            shutil.copy(os.path.join(BIN, program), os.path.join(root, "bin"))
        self.server = Machine(root, "server")
        self.addCleanup(self.server.stop)
        self.client = Machine(root, "client")
        self.addCleanup(self.client.stop)
        self.check(self.server, f"ip link add cable type veth peer name cable netns {self.client.keeper.pid}", user=False)
        for machine, address in ((self.server, SERVER), (self.client, CLIENT)):
            self.check(machine, f"ip address add {address}/24 dev cable && ip link set cable up", user=False)

    def check(self, machine, command, user=True):
        """Runs a command that must succeed. Returns the command's output."""
        result = machine.run(command, user)
        self.assertEqual(result.returncode, 0, f"{command}\n{result.stdout}{result.stderr}")
        return result.stdout

    def refuse(self, machine, command):
        """Runs a command that must fail. Returns the command's error output."""
        result = machine.run(command)
        self.assertNotEqual(result.returncode, 0, f"{command}\n{result.stdout}")
        return result.stderr

    def start_daemon(self):
        for heading in ("Certificates", "Tokens", "Access file"):
            self.check(self.server, "\n".join(blocks("CREDENTIALS.md", heading)))
        path = os.path.join(self.server.folder, "log")
        with open(path, "w", encoding="utf-8") as log:
            daemon = subprocess.Popen(self.server.enter("exec " + blocks("HARDENING.md", "2. Inside a network")[0]), stdout=log,
                                      stderr=subprocess.STDOUT)
        self.addCleanup(daemon.wait)
        self.addCleanup(daemon.send_signal, signal.SIGTERM)
        until = time.monotonic() + WAIT_SECONDS
        while self.server.run("locus -a unix:/run/locus/locus.sock health").returncode != 0:
            if daemon.poll() is not None or time.monotonic() > until:
                with open(path, encoding="utf-8") as log:
                    self.fail("locusd does not serve:\n" + log.read())
            time.sleep(0.1)

    def test_the_pages_lead_to_mutual_tls_between_two_machines_and_a_token_that_may_read_one_scene(self):
        self.start_daemon()
        for scene in ("arena-1", "lobby-1"):
            self.check(self.server, f"locus -a unix:/run/locus/locus.sock scene create {scene}")
        for name in ("certs/ca.pem", "certs/game1.pem", "certs/game1.key", "ci.token"):
            copy = os.path.join(self.client.folder, os.path.basename(name))
            shutil.copy(os.path.join(self.server.folder, name), copy)
            os.chown(copy, USER_ID, USER_ID)
        listing, query = blocks("HARDENING.md", "2. Inside a network")[1].strip().split("\n")
        scenes = self.check(self.client, listing)
        self.assertIn("arena-1", scenes)
        self.assertNotIn("lobby-1", scenes)
        self.check(self.client, query)
        self.assertIn("no scene is called 'lobby-1'", self.refuse(self.client, query.replace("arena-1", "lobby-1")))
        token = query.split(" query ")[0]
        insert = f"{token} insert arena-1 ball --id 1 --at 0,0,0 --radius 1"
        self.assertIn("lacks the right update to scene 'arena-1'", self.refuse(self.client, insert))
        without_certificate = "locus -a locus.internal:7575 --ca ca.pem --token-file ci.token scene list"
        for command in (without_certificate, "locus -a locus.internal:7575 scene list"):
            self.assertIn("no connection to locus.internal:7575: the server ended", self.refuse(self.client, command))
        self.check(self.client, listing)


if __name__ == "__main__":
    if not can_make_machines():
        print("skipped: network namespaces need root and iproute2")
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1], verbosity=2)
