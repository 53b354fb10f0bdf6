"""Tests of deploy/edge with the configuration that is shipped: HAProxy accepts the configuration, clients reach locusd
through HAProxy, each client is limited, and a mistake of one client ends no call of another client.

    python3 edge_test.py SOURCE_DIRECTORY BIN_DIRECTORY PYTHON_PACKAGE_DIRECTORY
"""
import os
import re
import subprocess
import sys
import time
import unittest

import yaml

SOURCE, BIN, PACKAGE = (os.path.abspath(path) for path in sys.argv[1:4])
sys.path[:0] = [os.path.join(SOURCE, "tests/attack"), PACKAGE]

import edge  # noqa: E402
import locus  # noqa: E402
import protobuf  # noqa: E402
import wire  # noqa: E402

FOLDER = os.path.join(SOURCE, "deploy/edge")
LIMIT = 1 << 30
WAIT_SECONDS = 30.0
ACCESS = "grant token:admin read,update,admin *\ngrant token:player read,update arena\n"
LIST, WATCH = "/locus.v1.SceneService/ListScenes", "/grpc.health.v1.Health/Watch"


def content(name):
    with open(os.path.join(FOLDER, name), encoding="utf-8") as file:
        return file.read()


def files(folder):
    """Writes an access file and a token file. Returns the options that name these files, and the tokens by their ids.
    """
    paths = [os.path.join(folder, name) for name in ("access.conf", "tokens")]
    with open(os.open(paths[0], os.O_CREAT | os.O_WRONLY, 0o600), "w", encoding="utf-8") as file:
        file.write(ACCESS)
    tokens = {name: subprocess.run([os.path.join(BIN, "locus"), "token", "create", name, "--token-file", paths[1]],
                                   capture_output=True, text=True, check=True).stdout.strip()
              for name in ("admin", "player")}
    return ("--access-file", paths[0], "--token-file", paths[1]), tokens


class EdgedDaemon(edge.EdgedDaemon):
    """An edge.EdgedDaemon with an access file. `tokens` are the tokens of an administrator and of a player."""

    tokens = None

    def start(self, program, options):
        more, self.tokens = files(self.folder)
        super().start(program, (*options, *more))

    def connect(self, token, **options):
        return locus.connect(f"localhost:{self.edge.port}", ca=self.front.path("ca.pem"), token=token, timeout=WAIT_SECONDS,
                             **options)


def new_daemon(**options):
    return EdgedDaemon(os.path.join(BIN, "locusd"), LIMIT, **options)


@unittest.skipUnless(os.access(edge.PROGRAM, os.X_OK), "haproxy is not installed: deploy/packages.sh test")
class ConfigurationTest(unittest.TestCase):
    def check(self, folder, **variables):
        result = subprocess.run([edge.PROGRAM, "-c", "-f", os.path.join(FOLDER, "haproxy.cfg")], capture_output=True, text=True,
                                env={**os.environ, "LOCUS_EDGE_CERT": os.path.join(folder, "edge.pem"), **variables})
        self.assertEqual((result.returncode, re.findall(r"WARNING.*|ALERT.*", result.stderr)), (0, []), result.stderr)

    def test_haproxy_accepts_it_without_a_warning(self):
        daemon = new_daemon()
        self.addCleanup(daemon.stop)
        self.check(daemon.folder)
        self.check(daemon.folder, LOCUS_EDGE_CLIENT_CA=daemon.front.path("ca.pem"), LOCUS_EDGE_LISTEN="127.0.0.1:7575",
                   LOCUS_EDGE_ADMIN=os.path.join(daemon.folder, "admin.sock"))


class FilesTest(unittest.TestCase):
    def test_the_unit_the_compose_file_and_the_image_use_the_configuration(self):
        self.assertIn("-f /etc/locus/haproxy.cfg", content("locus-edge.service"))
        self.assertIn("COPY haproxy.cfg /etc/locus/haproxy.cfg", content("Dockerfile"))
        services = yaml.safe_load(content("compose.yaml"))["services"]
        variables = set(re.findall(r"LOCUS_EDGE_[A-Z_]+", content("haproxy.cfg")))
        self.assertLessEqual(set(services["edge"]["environment"]), variables)
        self.assertLessEqual(set(re.findall(r"LOCUS_EDGE_[A-Z_]+", content("locus-edge.service"))), variables)

    def test_locusd_has_the_same_options_everywhere(self):
        added = dict(re.findall(r"^Environment=(\w+)=(.*)$", content("locusd-edge.conf"), re.MULTILINE))
        composed = yaml.safe_load(content("compose.yaml"))["services"]["locusd"]["environment"]
        self.assertLessEqual(set(added.items()), set(composed.items()))
        for option, value in zip(edge.DAEMON_OPTIONS[::2], edge.DAEMON_OPTIONS[1::2]):
            self.assertEqual(added["LOCUS_" + option[2:].replace("-", "_").upper()], value)


@unittest.skipUnless(os.access(edge.PROGRAM, os.X_OK), "haproxy is not installed: deploy/packages.sh test")
class EdgeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = new_daemon()
        cls.admin = cls.daemon.connect(cls.daemon.tokens["admin"])
        for scene in ("arena", "secret"):
            cls.admin.create_scene(scene)

    @classmethod
    def tearDownClass(cls):
        cls.admin.close()
        cls.daemon.stop()

    def player(self):
        client = self.daemon.connect(self.daemon.tokens["player"])
        self.addCleanup(client.close)
        return client

    def wire_connection(self, target=None):
        connection = wire.Connection(target or self.daemon.target, timeout=WAIT_SECONDS)
        self.addCleanup(connection.close)
        return connection

    def bearer(self, name):
        return ("authorization", f"Bearer {self.daemon.tokens[name]}")

    def test_a_call_and_streams_pass(self):
        client = self.player()
        client.apply("arena", locus.UpdateBatch(upsert=True).insert_balls(ids=[9], positions=[[0, 0, 30]], radii=0.5))
        rays = locus.QueryBatch().rays(origins=[[0, 0, 100]], directions=[[0, 0, -1]])
        self.assertEqual(client.query("arena", rays).blocks[0].t[0], 69.5)
        with client.update_stream("arena") as updates, client.query_stream("arena") as queries:
            for height in range(60):
                move = locus.UpdateBatch(upsert=True).insert_balls(ids=[9], positions=[[0, 0, height]], radii=0.5)
                updates.send(move).result(WAIT_SECONDS)
                self.assertEqual(queries.send(rays).result(WAIT_SECONDS).blocks[0].t[0], 99.5 - height)

    def test_a_message_of_8_mebibytes_passes(self):
        count = (8 << 20) // 20  # bytes of an object: 8 for its id and 12 for its position
        positions = [coordinate for i in range(count) for coordinate in (float(i), 0.0, 0.0)]
        batch = locus.UpdateBatch(upsert=True).insert_points(ids=range(1, count + 1), positions=positions)
        self.assertGreater(len(batch.request_bytes("arena")), (8 << 20) - 64)
        self.assertEqual(self.player().apply("arena", batch).refused, 0)

    def test_a_message_of_almost_32_mebibytes_passes(self):
        body = protobuf.apply(b"arena", b"") + protobuf.delimited(15, bytes(31 << 20))  # a field that locusd ignores
        apply = "/locus.v1.UpdateService/ApplyUpdates"
        reply = self.wire_connection().call(apply, body, (self.bearer("player"),))
        self.assertEqual(reply.code, "OK", reply.text)

    def test_without_a_token_nobody_is_known_and_a_token_has_its_grants(self):
        with self.assertRaises(locus.LocusError) as caught:
            self.daemon.connect("").scenes()
        self.assertIn(caught.exception.code.name, ("UNAUTHENTICATED", "PERMISSION_DENIED"))
        self.assertEqual([scene.name for scene in self.player().scenes()], ["arena"])

    def test_wrong_headers_and_tokens_of_one_client_end_no_call_of_another(self):
        others = [self.wire_connection() for _ in range(4)]
        streams = [connection.start(WATCH, (self.bearer("player"),)) for connection in others]
        for connection, stream in zip(others, streams):
            connection.write(stream, wire.message(b""))
        for field in (("x-bin", "!!!"), ("authorization", "Bearer wrong"), ("x-long", "v" * 12000)):
            attacker = self.wire_connection(self.daemon.attacker)
            codes = {attacker.call(LIST, b"", (field,)).code for _ in range(40)}
            self.assertNotIn("OK", codes)
        time.sleep(0.5)
        for connection, stream in zip(others, streams):
            connection.step(time.monotonic() + 1)
            self.assertNotIn(stream, connection.ended, connection.headers)

    def test_binary_metadata_is_removed(self):
        reply = self.wire_connection().call(LIST, b"", (self.bearer("player"), ("x-bin", "!!!")))
        self.assertEqual(reply.code, "OK", reply.text)

    def test_refusals_name_the_limit(self):
        reply = self.wire_connection().call(LIST, b"", (("x-long", "v" * 9000),))
        self.assertEqual((reply.code, "8000 bytes of metadata" in reply.text), ("RESOURCE_EXHAUSTED", True), reply.text)
        # Use an address of its own, so that the limits refuse no call of another test.
        busy = self.daemon.target._replace(source="127.0.0.3")
        connections = [self.wire_connection(busy) for _ in range(4)]
        texts, until = "", time.monotonic() + WAIT_SECONDS
        # Repeat the 360 calls, because on a busy machine they can take so long that they do not exceed the limit.
        while "200 new calls in 100 ms" not in texts and time.monotonic() < until:
            streams = [(connection, connection.start(LIST, (), end=True)) for _ in range(90) for connection in connections]
            texts = " ".join(connection.finish(stream).text for connection, stream in streams)
        self.assertIn("200 new calls in 100 ms", texts)

    def test_pings_are_answered_and_an_idle_stream_stays(self):
        connection = self.wire_connection()
        stream = connection.start(WATCH, (self.bearer("player"),))
        connection.write(stream, wire.message(b""), end=False)
        for _ in range(3):
            connection.send(wire.frame(wire.PING, 0, 0, b"locus..."))
            self.assertTrue(connection.step(time.monotonic() + WAIT_SECONDS))
        self.assertNotIn(stream, connection.ended)


@unittest.skipUnless(os.access(edge.PROGRAM, os.X_OK), "haproxy is not installed: deploy/packages.sh test")
class ClientCertificateTest(unittest.TestCase):
    def test_a_client_without_a_certificate_gets_no_answer_and_one_with_it_still_needs_a_token(self):
        daemon = new_daemon(client_ca=True)
        self.addCleanup(daemon.stop)
        stranger = daemon.target._replace(context=daemon.front.stranger)
        with self.assertRaises((wire.Closed, OSError)):
            connection = wire.Connection(stranger)
            self.assertEqual(connection.call(LIST, b"").code, "CLOSED")
            raise wire.Closed()
        own = {"cert": daemon.front.path("client.pem"), "key": daemon.front.path("client.key")}
        with self.assertRaises(locus.LocusError) as caught:
            daemon.connect("", **own).scenes()
        self.assertIn(caught.exception.code.name, ("UNAUTHENTICATED", "PERMISSION_DENIED"))
        with daemon.connect(daemon.tokens["admin"], **own) as client:
            self.assertEqual(client.scenes(), [])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
