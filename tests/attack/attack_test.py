"""Tests of the attacks themselves: they send the intended bytes, and each fault of a daemon is detected."""
import functools
import os
import sys
import unittest
import zlib

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)

import hpack  # noqa: E402

import attack  # noqa: E402
import edge  # noqa: E402
import protobuf  # noqa: E402
import report  # noqa: E402
import runner  # noqa: E402
import table  # noqa: E402
import victim  # noqa: E402
import wire  # noqa: E402
from job import SHIELDED, STRANGER, Attack, Job, one  # noqa: E402
from rows import messages  # noqa: E402

LIMIT = 256 << 20
FAKE = os.path.join(HERE, "fake_locusd.py")


def call_fault(job, name):
    job.call(f"/fault/{name}", b"", name)


def run_fault(*names):
    """Attacks the fake daemon with calls that switch on the faults `names`. Returns (verdict, failures)."""
    steps = [(name, functools.partial(call_fault, name=name)) for name in names]
    options = runner.Options(FAKE, LIMIT, "plain", 0.3, len(names) == 1)
    row = runner.run(Attack("fault", "faults", lambda job: steps, "", ""), options)
    return report.verdict(row, True), " ".join(row.failures(True))


class FaultTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        runner.RETURN_SECONDS, runner.SERVED_SECONDS = 1.0, 2.0

    def test_a_daemon_without_a_fault_passes(self):
        self.assertEqual(run_fault("none"), ("ok", ""))

    def test_a_daemon_that_ends_is_noticed_with_its_exit_code(self):
        verdict, text = run_fault("die")
        self.assertEqual((verdict, "exit code 3" in text), ("killed", True), text)

    def test_a_daemon_that_needs_too_much_memory_is_noticed(self):
        verdict, text = run_fault("grow")
        self.assertEqual(verdict, "killed", text)

    def test_steps_after_a_death_are_run_against_a_fresh_daemon(self):
        verdict, text = run_fault("die", "none", "die", "internal")
        self.assertEqual(verdict, "killed")
        self.assertEqual(text.count("exit code 3 in die"), 2, text)
        self.assertIn("INTERNAL a fault", text)

    def test_memory_and_descriptors_that_are_held_are_noticed(self):
        self.assertIn("MiB more than before", run_fault("hold")[1])
        self.assertIn("descriptors more than before", run_fault("descriptors")[1])

    def test_a_victim_that_is_refused_afterwards_is_noticed(self):
        self.assertEqual(run_fault("refuse")[0], "hangs")

    def test_a_victim_that_is_mostly_refused_or_connects_slowly_is_noticed(self):
        row = runner.Row(table.ROWS[0], LIMIT)
        row.idle = {"p99_ms": 1.0, "connect_p99_ms": 2.0}
        row.during = {"calls": 10, "errors": {"CLOSED": 5}, "p99_ms": 1.0, "connect_p99_ms": 20.0}
        self.assertEqual(row.failures(False), [])
        row.during |= {"errors": {"CLOSED": 4, "CONNECT": 2}, "connect_p99_ms": 100.0}
        self.assertEqual(row.failures(True), ["only 4 of the victim's 10 calls were answered"])
        self.assertIn("slow: p99 of new connections 50 times as long, at most 10 are allowed", row.failures(False))

    def test_wrong_codes_and_refusals_without_a_text_are_noticed(self):
        self.assertIn("INTERNAL a fault", run_fault("internal")[1])
        self.assertIn("INVALID_ARGUMENT without a text", run_fault("no_text")[1])

    def test_an_attack_that_breaks_does_not_pass(self):
        options = runner.Options(FAKE, LIMIT, "plain", 0.3, True)
        row = runner.run(Attack("broken", "faults", one(lambda job: 1 // 0), "", ""), options)
        self.assertIn("ZeroDivisionError", " ".join(row.failures(True)))

    def test_every_front_serves_the_victim_and_only_mtls_refuses_strangers(self):
        for front in attack.FRONTS:
            if front == "edge" and not os.access(edge.PROGRAM, os.X_OK):
                self.skipTest("haproxy is not installed: deploy/packages.sh test")
            daemon = runner.start(runner.Options(FAKE, LIMIT, front, 1, True))
            try:
                self.assertTrue(victim.is_served(daemon.target), front)
                self.assertEqual(victim.is_served(daemon.attacker), front != STRANGER)
            finally:
                daemon.stop()

    def test_a_front_that_ends_is_noticed(self):
        if not os.access(edge.PROGRAM, os.X_OK):
            self.skipTest("haproxy is not installed: deploy/packages.sh test")
        daemon = runner.start(runner.Options(FAKE, LIMIT, "edge", 1, True))
        try:
            self.assertTrue(daemon.alive())
            daemon.edge.process.kill()
            daemon.edge.process.wait()
            self.assertEqual((daemon.alive(), daemon.death()), (False, "the front was ended by SIGKILL"))
        finally:
            daemon.stop()

    def test_a_stranger_that_gets_a_reply_is_noticed(self):
        wrongs = []
        job = Job(None, 1, True, self, STRANGER)
        self.send = lambda event: wrongs.append(event) if event[0] == "wrong" else None
        job.check(wire.Reply("CLOSED", "", b""), "a call")
        self.assertEqual(wrongs, [])
        job.check(wire.Reply("OK", "", b""), "a call")
        self.assertEqual(wrongs, [("wrong", "a call: a stranger got OK")])

    def test_cgroups_and_folders_are_removed(self):
        daemon = runner.start(runner.Options(FAKE, LIMIT, "plain", 1, True))
        folder, group = daemon.folder, daemon.group.path
        daemon.stop()
        self.assertFalse(os.path.exists(folder) or (group and os.path.exists(group)) or daemon.alive())


class BytesTest(unittest.TestCase):
    def test_copies_of_frames_have_consecutive_stream_ids(self):
        block = wire.on_streams(wire.frame(wire.PING, 0, 0, b"12345678"), (5,), 300, 3)
        self.assertEqual(block, b"".join(wire.frame(wire.PING, 0, stream, b"12345678") for stream in (300, 302, 304)))

    def test_header_blocks_are_read_by_another_decoder(self):
        decoder, fields = hpack.Decoder(), wire.grpc_fields("/a.B/C", (("x-long", "v" * 300),))
        self.assertEqual(decoder.decode(wire.header_block(fields, 0x40)), fields)
        self.assertEqual(decoder.decode(wire.indexed_block(len(fields))), fields)

    def test_the_gzip_stream_inflates_to_its_size(self):
        self.assertEqual(zlib.decompress(messages.gzip_of_zeros(3), 31), bytes(3 << 20))

    def test_map_entries_have_keys_of_their_own(self):
        entries, size = protobuf.map_entries(1, 1 << 20), 8
        keys = {entries[at + 4:at + size] for at in range(0, len(entries), size)}
        self.assertEqual(len(keys), len(entries) // size)

    def test_every_repeated_field_of_every_request_is_attacked(self):
        schema = protobuf.Schema()
        places = {(method.path.split("/")[-1], place.name, place.kind) for method in schema.methods
                  for place in schema.places(method.request)}
        expected = {("Query", "batch.blocks", "lists"), ("Query", "batch.blocks.columns", "varints"),
                    ("StreamUpdates", "batch.inserts", "lists"), ("ListScenes", "labels", "map"),
                    ("CreateScene", "spec.labels", "map"), ("UploadMesh", "parts.name", "string")}
        self.assertEqual(expected - places, set())


class TableTest(unittest.TestCase):
    def test_names_are_unique_and_lists_name_rows(self):
        names = [attack.name for attack in table.ROWS]
        self.assertEqual(len(names), len(set(names)))
        self.assertLessEqual(set(table.NOT_YET) | set(table.TOGETHER), set(names))

    def test_every_group_is_a_test(self):
        with open(os.path.join(HERE, "CMakeLists.txt"), encoding="utf-8") as file:
            self.assertIn(f"foreach(group {' '.join(table.GROUPS)})", file.read())

    def test_the_page_has_every_attack(self):
        with open(os.path.join(HERE, "README.md"), encoding="utf-8") as file:
            page = file.read()
        self.assertEqual([name for name in (attack.name for attack in table.ROWS) if f"`{name}`" not in page], [])

    def test_rows_that_are_not_survived_are_left_out_of_the_quick_form(self):
        rows, quick, left_out = table.chosen("quick")
        self.assertTrue(quick)
        self.assertEqual(set(left_out), set(table.NOT_YET))
        self.assertFalse({row.name for row in rows} & set(table.NOT_YET))

    def test_a_front_that_shields_leaves_no_row_out(self):
        for front in SHIELDED:
            self.assertEqual(table.chosen("quick", front), (table.ROWS, True, []))


if __name__ == "__main__":
    unittest.main(verbosity=2)
