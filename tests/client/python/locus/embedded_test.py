"""Tests of locus.embedded(): a private locusd that ends with its client and with its process, however that ends."""
import os
import signal
import stat
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import locus
from locus import QueryBatch, UpdateBatch
from support import BIN, WAIT_SECONDS, Daemon, listed

PROGRAM = os.path.join(BIN, "locusd")


def start(**arguments):
    return locus.embedded(program=PROGRAM, timeout=WAIT_SECONDS, **arguments)


def is_running(pid):
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def wait_for_end(pid):
    deadline = time.monotonic() + WAIT_SECONDS
    while is_running(pid):
        if time.monotonic() > deadline:
            raise AssertionError(f"process {pid} still runs")
        time.sleep(0.01)


def folder_of(client):
    return os.path.dirname(client.address[len("unix:"):])


def script(text):
    """Returns the arguments of a Python process that runs `text` with the package, PROGRAM and `client` at hand."""
    head = (f"import os, sys, signal, subprocess, time; sys.path.insert(0, {os.environ['LOCUS_PACKAGE']!r}); import locus\n"
            f"client = locus.embedded(program={PROGRAM!r}, timeout={WAIT_SECONDS})\n"
            "print(client.pid, client.address, flush=True)\n")
    return [sys.executable, "-B", "-c", head + text]


class EmbeddedTest(unittest.TestCase):
    def test_it_serves_and_ends_with_the_client(self):
        with start() as client:
            client.create_scene("yard")
            ack = client.apply("yard", UpdateBatch().insert_balls(9, [0, 0, 30], 0.5))
            (block,) = client.query("yard", QueryBatch(at_least=ack).rays([0, 0, 100], [0, 0, -1])).blocks
            self.assertEqual(listed(block.ids), [9])
            self.assertTrue(is_running(client.pid))
        self.assertFalse(is_running(client.pid))
        self.assertFalse(os.path.exists(folder_of(client)))
        client.close()  # may be repeated

    def test_only_this_user_can_reach_it_and_it_has_no_port(self):
        with start() as client:
            self.assertEqual(stat.S_IMODE(os.stat(folder_of(client)).st_mode), 0o700)
            with open(f"/proc/{client.pid}/net/tcp", encoding="utf-8") as file:
                listening = {line.split()[9] for line in file if line.split()[3] == "0A"}
            sockets = {os.readlink(f"/proc/{client.pid}/fd/{fd}") for fd in os.listdir(f"/proc/{client.pid}/fd")}
            self.assertEqual({f"socket:[{inode}]" for inode in listening} & sockets, set())

    def test_other_clients_connect_to_its_address(self):
        with start() as client, locus.connect(client.address) as other:
            client.create_scene("yard")
            self.assertEqual([scene.name for scene in other.scenes()], ["yard"])

    def test_two_at_once_share_nothing(self):
        with start() as one, start() as other:
            one.create_scene("yard")
            self.assertEqual(other.scenes(), [])

    def test_scenes_in_a_data_directory_outlive_it(self):
        with tempfile.TemporaryDirectory() as folder:
            data = os.path.join(folder, "data")
            with start(data_dir=data) as client:
                client.create_scene("yard")
                with self.assertRaisesRegex(RuntimeError, "locusd ended with code 1\n.*data"):
                    start(data_dir=data)
            with start(data_dir=data) as client:
                self.assertEqual([scene.name for scene in client.scenes()], ["yard"])

    def test_options_reach_the_daemon_and_a_wrong_one_is_shown(self):
        with start(options=["--max-scenes", "3"]) as client:
            self.assertEqual(client.server().limits["scenes"].value, 3)
        with self.assertRaisesRegex(RuntimeError, "--no-such-option"):
            start(options=["--no-such-option"])

    def test_variables_for_another_daemon_have_no_effect(self):
        os.environ["LOCUS_MAX_SCENES"] = "3"
        self.addCleanup(os.environ.pop, "LOCUS_MAX_SCENES")
        with start() as client:
            self.assertGreater(client.server().limits["scenes"].value, 3)

    def test_the_program_is_found_by_argument_variable_and_path(self):
        self.addCleanup(os.environ.__setitem__, "PATH", os.environ["PATH"])
        os.environ["PATH"] = BIN
        with locus.embedded() as client:
            self.assertTrue(client.healthy())
        os.environ["PATH"] = "/nonexistent"
        with self.assertRaisesRegex(FileNotFoundError, "no program 'locusd': install .* `program`, or set LOCUS_LOCUSD"):
            locus.embedded()
        with self.assertRaisesRegex(FileNotFoundError, "no program '/nonexistent/locusd'"):
            locus.embedded(program="/nonexistent/locusd")
        os.environ["LOCUS_LOCUSD"] = PROGRAM
        self.addCleanup(os.environ.pop, "LOCUS_LOCUSD")
        with locus.embedded() as client:
            self.assertTrue(client.healthy())

    def test_a_daemon_that_dies_is_noticed_at_the_start(self):
        with self.assertRaisesRegex(RuntimeError, "locusd ended with code 0"):
            locus.embedded(program="/bin/true")

    def test_it_outlives_the_thread_that_started_it(self):
        started = []
        thread = threading.Thread(target=lambda: started.append(start()))
        thread.start()
        thread.join()
        with started[0] as client:
            for _ in range(20):
                self.assertTrue(client.healthy())


class EndTest(unittest.TestCase):
    def run_script(self, text, wanted_code):
        """Runs a script that has an embedded locusd, and checks that the locusd ends with it. Returns its folder."""
        child = subprocess.Popen(script(text), stdout=subprocess.PIPE, text=True)
        self.addCleanup(child.stdout.close)
        pid, address = child.stdout.readline().split()
        if wanted_code == -signal.SIGKILL:
            child.kill()
        self.assertEqual(child.wait(WAIT_SECONDS), wanted_code)
        wait_for_end(int(pid))
        self.assertFalse(os.path.exists(address[len("unix:"):]))
        return os.path.dirname(address[len("unix:"):])

    def test_it_ends_with_a_script_that_does_not_close_it(self):
        self.assertFalse(os.path.exists(self.run_script("", 0)))

    def test_it_ends_with_a_script_that_fails(self):
        self.assertFalse(os.path.exists(self.run_script("sys.stderr.close(); raise SystemExit(3)", 3)))

    def test_it_ends_when_the_client_is_forgotten(self):
        text = "pid = client.pid; del client\nsys.exit(os.path.exists(f'/proc/{pid}'))"
        self.run_script(text, 0)

    def test_it_ends_with_a_process_that_is_killed(self):
        folder = self.run_script("time.sleep(600)", -signal.SIGKILL)
        self.addCleanup(subprocess.run, ["rm", "-rf", folder], check=True)

    def test_it_ends_with_a_killed_process_that_has_children(self):
        text = ("subprocess.Popen(['sleep', '600'], close_fds=False)\n"
                "if os.fork() != 0: print('ready', flush=True)\n"
                "time.sleep(600)")
        child = subprocess.Popen(script(text), stdout=subprocess.PIPE, text=True, start_new_session=True)
        self.addCleanup(child.stdout.close)
        self.addCleanup(os.killpg, child.pid, signal.SIGKILL)
        pid, address = child.stdout.readline().split()
        self.assertEqual(child.stdout.readline(), "ready\n")
        child.kill()
        child.wait(WAIT_SECONDS)
        wait_for_end(int(pid))
        self.addCleanup(subprocess.run, ["rm", "-rf", os.path.dirname(address[len("unix:"):])], check=True)

    def test_a_forked_copy_does_not_end_it(self):
        text = ("copy = os.fork()\n"
                "if copy == 0: sys.exit(0)\n"
                "os.waitpid(copy, 0)\n"
                "sys.exit(not os.path.exists(f'/proc/{client.pid}') or client._daemon.process.poll() is not None)")
        self.run_script(text, 0)


class SameAnswersTest(unittest.TestCase):
    def test_answers_are_those_of_a_locusd_that_was_started_otherwise(self):
        daemon = Daemon()
        self.addCleanup(daemon.stop)
        answers = []
        with start() as one, locus.connect(daemon.address) as other:
            for client in (one, other):
                client.create_scene("world")
                positions = [[3 * (i % 40), 3 * (i // 40), i % 7] for i in range(1600)]
                client.apply("world", UpdateBatch().insert_balls(range(1, 1601), positions, 1.2))
                rays = QueryBatch().rays([[i % 120, i // 9, 60] for i in range(1024)],
                                         [[(i % 5) - 2, (i % 3) - 1, -9] for i in range(1024)])
                (block,) = client.query("world", rays).blocks
                answers.append((listed(block.t), listed(block.ids)))
        self.assertEqual(answers[0], answers[1])
        self.assertGreater(len(set(answers[0][1])), 100)
