"""Tests of fault plans, and of the links that faults cut and hang. They need no PostgreSQL."""
import contextlib
import os
import socket
import socketserver
import sys
import threading
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from daemon_faults import DaemonFaults  # noqa: E402
from engine import hold_port  # noqa: E402
from engine_faults import EngineFaults  # noqa: E402
from fault_plan import DAEMONS, ENGINE, FAULTS, HOOKS, STORED, Fault, Plan, names, run  # noqa: E402
from keeper import CUT, HUNG, OPEN, Keeper  # noqa: E402

WAIT_SECONDS = 20
SHORT_SECONDS = 0.3


class PlanTest(unittest.TestCase):
    def test_a_printed_plan_is_parsed_again(self):
        for seed in range(50):
            plan = Plan.make(seed, 200, names(HOOKS))
            self.assertEqual(Plan.parse(str(plan)), plan)

    def test_a_seed_always_makes_the_same_plan_and_another_seed_another_one(self):
        self.assertEqual(Plan.make(4, 100, names(ENGINE)), Plan.make(4, 100, names(ENGINE)))
        self.assertNotEqual(Plan.make(4, 100, names(ENGINE)).faults, Plan.make(5, 100, names(ENGINE)).faults)

    def test_a_long_plan_has_every_fault_within_its_durations_and_none_overlaps(self):
        plan = Plan.make(8, 1000, names(HOOKS))
        self.assertEqual({fault.name for fault in plan.faults}, set(FAULTS))
        for fault, after in zip(plan.faults, plan.faults[1:]):
            self.assertLess(fault.at + fault.seconds, after.at)
        for fault in plan.faults:
            low, high = FAULTS[fault.name].seconds
            self.assertTrue(low <= fault.seconds <= min(high, 15), str(fault))

    def test_wrong_lines_are_refused_by_their_number(self):
        for text in ("1 kill-everything 1 0", "1 kill-primary 1", "x kill-primary 1 0", "1 kill-primary 5 0\n3 kill-standby 1 0"):
            with self.assertRaises(ValueError):
                Plan.parse(text)
        with self.assertRaisesRegex(ValueError, "line 2 .* before the fault before it ends"):
            Plan.parse("1 kill-primary 5 0\n3 kill-standby 1 0")

    def test_faults_begin_and_end_in_order(self):
        told = []

        def action(fault):
            told.append(f"begin {fault.name}")
            return lambda: told.append(f"end {fault.name}")
        plan = Plan.parse("0 kill-primary 0.01 3\n0.1 kill-standby 0.01 4\n")
        run(plan, {"kill-primary": action, "kill-standby": action})
        self.assertEqual(told, ["begin kill-primary", "end kill-primary", "begin kill-standby", "end kill-standby"])

    def test_a_plan_with_a_fault_that_nobody_can_make_is_refused_before_its_start(self):
        with self.assertRaisesRegex(ValueError, "no actions for kill-leader"):
            run(Plan(0, [Fault(0, "kill-primary", 0, 0), Fault(1, "kill-leader", 0, 0)]), {"kill-primary": self.fail})

    def test_each_fault_of_the_engine_has_an_action(self):
        self.assertEqual(set(EngineFaults(None, []).actions()), {name for name, kind in FAULTS.items() if kind.needs == ENGINE})

    def test_each_fault_of_daemons_and_of_stored_rows_has_an_action(self):
        expected = {name for name, kind in FAULTS.items() if kind.needs in (DAEMONS, STORED)}
        self.assertEqual(set(DaemonFaults(None, []).actions()), expected - {"upgrade-daemon"})
        self.assertEqual(set(DaemonFaults(None, [], upgraded="locusd-of-another-version").actions()), expected)


class PortTest(unittest.TestCase):
    def test_a_held_port_is_free_for_its_server_and_for_nobody_else(self):
        holder = hold_port()
        self.addCleanup(holder.close)
        address = holder.getsockname()
        for _ in range(2):  # a server, and the same one started again
            with self.assertRaises(OSError), socket.socket() as other:
                other.bind(address)
            server = socketserver.TCPServer(address, Echo, bind_and_activate=False)
            server.allow_reuse_address = True
            server.server_bind()
            server.server_activate()
            with self.assertRaises(OSError), socket.socket() as other:
                other.bind(address)
            server.server_close()


class Echo(socketserver.BaseRequestHandler):
    """Sends back what it gets."""

    def handle(self):
        with contextlib.suppress(ConnectionError):
            while data := self.request.recv(1 << 16):
                self.request.sendall(data)


class LinkTest(unittest.TestCase):
    def setUp(self):
        self.server = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Echo)
        self.server.daemon_threads = True
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        self.keeper = Keeper(life_seconds=120)
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.addCleanup(self.keeper.close)
        self.port = self.keeper.link("here", self.server.server_address[1])
        self.sockets = []
        self.addCleanup(lambda: [sock.close() for sock in self.sockets])

    def connect(self):
        sock = socket.create_connection(("127.0.0.1", self.port), timeout=WAIT_SECONDS)
        self.sockets.append(sock)
        return sock

    def echo(self, sock, data):
        """Sends data and returns what comes back of it."""
        threading.Thread(target=sock.sendall, args=(data,), daemon=True).start()
        back = b""
        while len(back) < len(data) and (more := sock.recv(1 << 16)):
            back += more
        return back

    def test_an_open_link_forwards_all_bytes_both_ways(self):
        data = os.urandom(3_000_000)
        self.assertEqual(self.echo(self.connect(), data), data)

    def test_a_cut_link_resets_its_connections_and_new_ones_until_it_is_open_again(self):
        sock = self.connect()
        self.assertEqual(self.echo(sock, b"one"), b"one")
        self.keeper.set(["here"], CUT)
        with self.assertRaises(ConnectionResetError):
            sock.recv(1)
        with self.assertRaises(ConnectionError):
            if self.connect().recv(1) == b"":
                raise ConnectionError
        self.keeper.set(["here"], OPEN)
        self.assertEqual(self.echo(self.connect(), b"two"), b"two")

    def test_a_hung_link_accepts_and_forwards_only_when_it_is_open_again(self):
        old = self.connect()
        self.assertEqual(self.echo(old, b"one"), b"one")
        self.keeper.set(["here"], HUNG)
        new = self.connect()
        for sock in (old, new):
            sock.sendall(b"later")
            sock.settimeout(SHORT_SECONDS)
            with self.assertRaises(TimeoutError):
                sock.recv(1)
            sock.settimeout(WAIT_SECONDS)
        self.keeper.set(["here"], OPEN)
        for sock in (old, new):
            self.assertEqual(sock.recv(5, socket.MSG_WAITALL), b"later")

    def test_the_end_of_a_connection_is_forwarded(self):
        sock = self.connect()
        sock.sendall(b"last")
        sock.shutdown(socket.SHUT_WR)
        self.assertEqual(sock.recv(4, socket.MSG_WAITALL), b"last")
        self.assertEqual(sock.recv(1), b"")

    def test_a_keeper_that_was_ended_says_so(self):
        keeper = Keeper(life_seconds=0.2)
        self.addCleanup(keeper.close)
        self.assertTrue(keeper.wait(WAIT_SECONDS))
        with self.assertRaises((RuntimeError, BrokenPipeError)):
            keeper.set([], OPEN)


if __name__ == "__main__":
    unittest.main(verbosity=2)
