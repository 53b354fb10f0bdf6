"""Tests of a client's calls: scenes, the server's description, errors, and addresses without a server."""
import concurrent.futures
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time

import grpc
import locus
from locus import InstanceChange, QueryBatch, UpdateBatch
from support import WAIT_SECONDS, Daemon, DaemonTest, generated_protocol, listed


class ClientTest(DaemonTest):
    def test_the_server_describes_itself(self):
        server = self.client.server()
        self.assertEqual(server.version, self.command_line("version", "--server")["server_version"])
        self.assertIn("rays", server.features)
        self.assertFalse(server.insecure)
        self.assertIsNone(server.cluster)
        self.assertGreater(server.limits["max_reply_bytes"].value, 4_000_000)

    def test_quotas_are_those_of_the_caller_and_its_connection(self):
        own, connection = self.client.quotas().items()
        self.assertEqual(own[0], "anonymous")
        self.assertTrue(connection[0].startswith("connection:"))
        self.assertEqual(own[1]["scenes"], locus.Quota(None, 0, None))
        self.assertNotIn("scenes", connection[1])
        self.assertIn("open_streams", connection[1])
        self.assertEqual(list(self.client.quotas("token:ci")), ["token:ci"])
        self.assertEqual(self.client.quotas(everybody=True), {})

    def test_a_serving_server_is_healthy(self):
        self.assertTrue(self.client.healthy())
        with self.assertRaises(locus.LocusError) as raised:
            self.client.healthy("no.such.Service")
        self.assertEqual(raised.exception.code, grpc.StatusCode.NOT_FOUND)

    def test_scenes_are_created_described_listed_and_deleted(self):
        made = self.client.create_scene("hall", labels={"map": "hall", "mode": "duel"}, cell_size=3)
        self.assertEqual(made.cell_size, 4)
        self.client.update_scene("hall", cell_size=0.3)
        self.client.update_scene("hall", labels={"map": "hall"})
        updated = self.client.scene("hall")
        self.assertEqual((updated.cell_size, updated.labels, updated.revision), (0.5, {"map": "hall"}, 0))
        self.assertEqual((made.name, made.revision, made.objects, made.bounds), ("hall", 0, 0, None))
        self.client.apply("hall", UpdateBatch(tick=4).insert_boxes(1, [1, 2, 3], [1, 1, 1]))
        hall = self.client.scene("hall")
        self.assertEqual((hall.epoch, hall.revision, hall.tick, hall.objects), (made.epoch, 1, 4, 1))
        self.assertEqual(hall.state, locus.SceneState.READY)
        self.assertEqual((hall.placement, hall.durability), (None, locus.Durability.MEMORY))
        low, high = hall.bounds
        self.assertTrue(all(a <= b for a, b in zip(low, (0, 1, 2))) and all(a >= b for a, b in zip(high, (2, 3, 4))))
        self.assertEqual([scene.name for scene in self.client.scenes({"map": "hall"})], ["hall"])
        self.assertIn(self.scene, [scene.name for scene in self.client.scenes()])
        self.client.delete_scene("hall")
        self.client.delete_scene("hall", if_present=True)
        with self.assertRaises(locus.LocusError) as raised:
            self.client.scene("hall")
        self.assertRefused(raised.exception, "NOT_FOUND", "NOT_FOUND")

    def test_all_pages_of_scenes_are_read(self):
        names = [f"page-{number:04}" for number in range(30)]
        for name in names:
            self.client.create_scene(name, labels={"paged": "yes"})
        rpc = locus.schema.method("locus.v1.SceneService", "ListScenes")
        pages = list(self.client._pages(rpc, labels={"paged": "yes"}, page_size=7))
        self.assertEqual([len(page.scenes) for page in pages], [7, 7, 7, 7, 2])
        self.assertEqual([scene.name for page in pages for scene in page.scenes], names)

    def test_an_existing_name_is_refused_without_if_absent(self):
        with self.assertRaises(locus.LocusError) as raised:
            self.client.create_scene(self.scene)
        self.assertRefused(raised.exception, "ALREADY_EXISTS", "ALREADY_EXISTS")
        self.assertEqual(self.client.create_scene(self.scene, if_absent=True).epoch, self.client.scene(self.scene).epoch)

    def test_a_scene_starts_with_the_instances_of_another(self):
        self.client.upload_mesh("shared", [0, 0, 0, 1, 0, 0, 0, 1, 0], [0, 1, 2])
        self.client.change_instances(self.scene, InstanceChange().place("shared", ids=5))
        copy = self.client.create_scene("copy", static_from=self.scene, winding=locus.Winding.CLOCKWISE)
        self.assertEqual((copy.instances, copy.winding), (1, locus.Winding.CLOCKWISE))

    def test_a_scene_may_keep_only_the_latest_of_waiting_moves(self):
        made = self.client.create_scene("crowd", overload=locus.OverloadPolicy.LATEST_WINS)
        self.assertEqual(made.overload, locus.OverloadPolicy.LATEST_WINS)
        self.assertEqual(self.client.scene(self.scene).overload, locus.OverloadPolicy.EVERY_BATCH)

    def test_a_name_that_is_not_a_legal_header_is_refused_by_the_server(self):
        for name in ("Grüße", "two words", ""):
            with self.assertRaises(locus.LocusError) as raised:
                self.client.query(name, QueryBatch())
            self.assertRefused(raised.exception, "INVALID_ARGUMENT", "MALFORMED", "scene")

    def test_a_call_beyond_its_timeout_fails_with_deadline_exceeded(self):
        built = self.apply(UpdateBatch().insert_points(1, [0, 0, 0]))
        later = locus.Revision(built.epoch, built.revision + 1)
        with locus.connect(self.daemon.address, timeout=WAIT_SECONDS) as hasty:
            hasty._connection.timeout = 0.2  # the connection itself may take longer on a busy machine
            with self.assertRaises(locus.LocusError) as raised:
                hasty.query(self.scene, QueryBatch(at_least=later).lookup(1))
        self.assertEqual(raised.exception.code, grpc.StatusCode.DEADLINE_EXCEEDED)
        self.assertIn(f"may not have reached revision {later.revision} yet", str(raised.exception))
        self.assertNotIn("a change may have been made", str(raised.exception))

    def test_a_query_waits_for_the_revision_it_names(self):
        built = self.apply(UpdateBatch().insert_points(1, [0, 0, 0]))
        later = locus.Revision(built.epoch, built.revision + 1)
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            waiting = pool.submit(self.client.query, self.scene, QueryBatch(at_least=later).lookup(1))
            self.apply(UpdateBatch().move(1, [8, 0, 0]))
            self.assertEqual(listed(waiting.result(WAIT_SECONDS).blocks[0].positions), [8, 0, 0])

    def test_the_error_of_a_batch_beyond_the_message_size_suggests_splitting(self):
        with locus.connect(self.daemon.address, max_send_bytes=1000) as narrow:
            with self.assertRaises(locus.LocusError) as raised:
                narrow.query(self.scene, QueryBatch().balls([0] * 3000, 1))
        self.assertEqual(raised.exception.code, grpc.StatusCode.RESOURCE_EXHAUSTED)
        self.assertIn("split the batch", str(raised.exception))

    def test_a_limit_is_named_with_its_value(self):
        most = self.client.server().limits["queries"].value
        with self.assertRaises(locus.LocusError) as raised:
            self.ask(QueryBatch().balls(bytes(12 * (int(most) + 1)), 1))
        error = raised.exception
        self.assertRefused(error, "INVALID_ARGUMENT", "LIMIT")
        self.assertEqual((error.limit_value, error.asked), (most, most + 1))
        self.assertIn(error.limit, self.client.server().limits)

    def test_many_threads_share_a_client(self):
        self.apply(UpdateBatch().insert_balls(range(1, 33), [[3 * one, 0, 0] for one in range(32)], 0.5))

        def ask(number):
            (block,) = self.ask(QueryBatch().rays([3 * number, 0, 9], [0, 0, -1]))
            return listed(block.ids)

        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            self.assertEqual(list(pool.map(ask, list(range(32)) * 8)), [[one + 1] for one in range(32)] * 8)


def calls_until_answered(client, limit):
    """Returns the number of calls, 50 ms apart, until one is answered; at most `limit`."""
    for calls in range(1, limit):
        try:
            client.healthy()
            return calls
        except locus.LocusError:
            time.sleep(0.05)
    return limit


class ConnectTest(DaemonTest):
    def test_connecting_without_a_server_fails_at_once_naming_the_address(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
        begin = time.monotonic()
        with self.assertRaisesRegex(locus.LocusError, f"nothing answers at 127.0.0.1:{port}: start locusd there") as raised:
            locus.connect(f"127.0.0.1:{port}", timeout=WAIT_SECONDS)
        self.assertEqual(raised.exception.code, grpc.StatusCode.UNAVAILABLE)
        self.assertLess(time.monotonic() - begin, WAIT_SECONDS)

    def test_connect_waits_for_a_starting_server(self):
        with tempfile.TemporaryDirectory() as folder:
            path = "unix:" + os.path.join(folder, "locus.sock")
            with self.assertRaises(locus.LocusError):
                locus.connect(path, timeout=WAIT_SECONDS)
            daemons = []
            starter = threading.Timer(0.3, lambda: daemons.append(Daemon("--listen", path)))
            starter.start()
            with locus.connect(path, timeout=WAIT_SECONDS, wait_for_server=True) as client:
                self.assertTrue(client.healthy())
            starter.join()
            daemons[0].stop()

    def test_connecting_to_another_kind_of_server_is_an_error(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
            with self.assertRaisesRegex(locus.LocusError, "nothing answers"):
                locus.connect(f"127.0.0.1:{port}", timeout=0.3)

    def test_an_unknown_name_is_named_as_the_cause(self):
        error = locus.LocusError(grpc.StatusCode.UNAVAILABLE, "DNS resolution failed for no-such-server:7575: not found")
        self.assertIn("/etc/hosts", error.hint)

    def test_an_empty_address_is_refused(self):
        with self.assertRaisesRegex(ValueError, "the address is empty"):
            locus.connect("")

    def test_a_call_is_repeated_once_the_server_is_back(self):
        with tempfile.TemporaryDirectory() as folder:
            path = "unix:" + os.path.join(folder, "locus.sock")  # not a port, which another process could take
            daemon = Daemon("--listen", path)
            client = locus.connect(path, retry=locus.Retry(attempts=10000, first_wait=0.05, max_wait=0.1),
                                   timeout=WAIT_SECONDS)
            daemon.kill()
            with concurrent.futures.ThreadPoolExecutor(1) as pool:
                asked = pool.submit(client.healthy)
                again = Daemon("--listen", path)
                self.assertTrue(asked.result(WAIT_SECONDS))
            client.close()
            again.stop()

    def test_calls_succeed_soon_after_the_server_has_returned(self):
        with tempfile.TemporaryDirectory() as folder:
            path = "unix:" + os.path.join(folder, "locus.sock")
            daemon = Daemon("--listen", path)
            with locus.connect(path, retry=locus.Retry(attempts=1), timeout=WAIT_SECONDS) as client:
                daemon.kill()
                for _ in range(2):
                    with self.assertRaises(locus.LocusError) as raised:
                        client.healthy()
                    self.assertEqual(raised.exception.code, grpc.StatusCode.UNAVAILABLE)
                    time.sleep(0.3)
                again = Daemon("--listen", path)
                self.assertLess(calls_until_answered(client, 100), 60)
            again.stop()

    def test_an_update_without_number_is_not_repeated(self):
        daemon = Daemon()
        client = locus.connect(daemon.address, retry=locus.Retry(attempts=100))
        daemon.kill()
        with self.assertRaises(locus.LocusError) as raised:
            client.apply("arena", UpdateBatch().insert_points(1, [0, 0, 0]))
        self.assertEqual(raised.exception.code, grpc.StatusCode.UNAVAILABLE)
        client.close()


class SideBySideTest(DaemonTest):
    def test_generated_modules_work_in_the_same_process(self):
        generated = generated_protocol(type(self))["query_service_pb2"]
        request = generated.QueryRequest(scene=self.scene)
        request.batch.blocks.add().rays.origins.extend([0, 0, 9])
        request.batch.blocks[0].rays.directions.extend([0, 0, -1])
        self.apply(UpdateBatch().insert_balls(6, [0, 0, 0], 1))
        answer = generated.QueryResponse.FromString(self.client.query_bytes(self.scene, request.SerializeToString()))
        self.assertEqual(list(answer.result.blocks[0].ids), [6])
        self.assertEqual(request.SerializeToString(),
                         QueryBatch().rays([0, 0, 9], [0, 0, -1], mode=0, cull=0, inside=0).request_bytes(self.scene))

    def test_a_script_that_does_not_close_its_stream_ends(self):
        script = (f"import sys; sys.path.insert(0, {os.environ['LOCUS_PACKAGE']!r}); import locus\n"
                  f"stream = locus.connect({self.daemon.address!r}).update_stream({self.scene!r})\n"
                  "print(stream.send(locus.UpdateBatch().insert_points(1, [0, 0, 0])).result().revision)")
        done = subprocess.run([sys.executable, "-B", "-c", script], capture_output=True, text=True, timeout=WAIT_SECONDS)
        self.assertEqual((done.returncode, done.stdout), (0, "1\n"), done.stderr)
