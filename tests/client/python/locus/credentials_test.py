"""Tests of TLS, client certificates and tokens against servers of Debian's grpcio, with certificates of `locus cert`."""
import os
import subprocess
import tempfile
import threading
import unittest
from concurrent import futures

import grpc
import locus
from locus import credentials
from support import BIN, WAIT_SECONDS


class Server(grpc.GenericRpcHandler):
    """Server that answers calls with an empty message. If `required` is set, it refuses calls without this token."""

    def __init__(self, ssl=None):
        self.required = None
        self.refused = lambda: None
        self.seen = {}
        self.calls = 0
        self._lock = threading.Lock()
        self._server = grpc.server(futures.ThreadPoolExecutor(max_workers=8), handlers=[self])
        self.address = "127.0.0.1:%d" % (self._server.add_secure_port("127.0.0.1:0", ssl) if ssl else
                                         self._server.add_insecure_port("127.0.0.1:0"))
        self._server.start()

    def stop(self):
        self._server.stop(0).wait(WAIT_SECONDS)

    def service(self, details):
        method = details.method.rsplit("/", 1)[1]
        if method.startswith("Stream"):
            return grpc.stream_stream_rpc_method_handler(lambda requests, context: self._stream(method, requests, context))
        if method == "UploadMesh":
            return grpc.stream_unary_rpc_method_handler(lambda requests, context: self._admit(method, context))
        if method == "DownloadMesh":
            return grpc.unary_stream_rpc_method_handler(lambda request, context: iter([self._admit(method, context)]))
        return grpc.unary_unary_rpc_method_handler(lambda request, context: self._admit(method, context))

    def _admit(self, method, context):
        with self._lock:
            self.calls += 1
            self.seen[method] = dict(context.invocation_metadata()).get("authorization")
            if self.required is None or self.seen[method] == "Bearer " + self.required:
                return b""
            self.refused()
        context.abort(grpc.StatusCode.UNAUTHENTICATED, "the token is not accepted")

    def _stream(self, method, requests, context):
        request_class, response_class = (locus.schema.message(method + kind) for kind in ("Request", "Response"))
        for raw in requests:
            self._admit(method, context)
            response = response_class(sequence=request_class.FromString(raw).sequence)
            (response.ack if method == "StreamUpdates" else response.result).SetInParent()
            yield response.SerializeToString()


class CredentialsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        for name in ("certs", "others"):
            cls.certify("authority", name)
            cls.certify("client", name, "--name", "lobby")
        cls.certify("server", "certs", "--address", "127.0.0.1", "--name", "locus.example")

    @classmethod
    def certify(cls, kind, name, *more):
        subprocess.run([os.path.join(BIN, "locus"), "cert", kind, os.path.join(cls.folder.name, name), *more], check=True,
                       stdout=subprocess.DEVNULL, timeout=WAIT_SECONDS)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def content(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def write_token(self, text):
        with open(self.path("new"), "w", encoding="utf-8") as file:
            file.write(text + "\n")
        os.replace(self.path("new"), self.path("token"))
        return self.path("token")

    def serve(self, ssl=None):
        server = Server(ssl)
        self.addCleanup(server.stop)
        return server

    def serve_tls(self, mutual=False):
        pair = (self.content("certs/server.key"), self.content("certs/server.pem"))
        return self.serve(grpc.ssl_server_credentials([pair], self.content("certs/ca.pem"), mutual))

    def connect(self, server, **options):
        client = locus.connect(server.address, timeout=WAIT_SECONDS, **options)
        self.addCleanup(client.close)
        return client

    def assertNoConnection(self, server, text, **options):
        with self.assertRaises(locus.LocusError) as raised:
            self.connect(server, **options)
        self.assertEqual(raised.exception.code, grpc.StatusCode.UNAVAILABLE)
        self.assertIn(text, str(raised.exception))

    def test_tls_connects_with_the_ca_file_of_the_servers_authority_only(self):
        server = self.serve_tls()
        self.connect(server, ca=self.path("certs/ca.pem")).server()
        self.connect(server, ca=self.path("certs/ca.pem"), server_name="locus.example").server()
        self.assertNoConnection(server, "give the CA file", ca=self.path("others/ca.pem"))
        self.assertNoConnection(server, "is for other names", ca=self.path("certs/ca.pem"), server_name="elsewhere")
        self.assertNoConnection(server, "it may require TLS")
        self.assertNoConnection(self.serve(), "connect without it", ca=self.path("certs/ca.pem"))

    def test_mutual_tls_accepts_only_clients_of_the_authority(self):
        server = self.serve_tls(mutual=True)
        ca = self.path("certs/ca.pem")
        self.connect(server, ca=ca, cert=self.path("certs/lobby.pem"), key=self.path("certs/lobby.key")).server()
        self.assertNoConnection(server, "a client certificate", ca=ca)
        self.assertNoConnection(server, "a client certificate", ca=ca, cert=self.path("others/lobby.pem"),
                                key=self.path("others/lobby.key"))

    def test_every_call_carries_the_token(self):
        server = self.serve_tls()
        server.required = "secret"
        client = self.connect(server, ca=self.path("certs/ca.pem"), token="secret")
        client.server()
        client.query("arena", locus.QueryBatch())
        client.query_stream("arena").send(locus.QueryBatch()).result(WAIT_SECONDS)
        client.update_stream("arena").send(locus.UpdateBatch()).result(WAIT_SECONDS)
        client.upload_mesh("rock", [0.0] * 9, [0, 1, 2])
        with self.assertRaises(locus.LocusError):  # an empty answer is no mesh
            client.download_mesh("rock")
        for method in ("GetServer", "Query", "StreamQueries", "StreamUpdates", "UploadMesh", "DownloadMesh"):
            self.assertEqual(server.seen.get(method), "Bearer secret", method)

    def test_without_a_token_nothing_is_sent(self):
        server = self.serve()
        self.connect(server).server()
        self.assertIsNone(server.seen["GetServer"])

    def test_a_refused_token_is_an_error_after_one_attempt(self):
        server = self.serve()
        server.required = "other"
        with self.assertRaises(locus.LocusError) as raised:
            self.connect(server, token="secret")
        self.assertEqual(raised.exception.code, grpc.StatusCode.UNAUTHENTICATED)
        self.assertIn("give a valid token", str(raised.exception))
        self.assertNotIn("secret", str(raised.exception))
        self.assertEqual(server.calls, 1)
        server.required = "secret"
        client = self.connect(server, token="secret")
        server.required, server.calls = "other", 0
        self.assertRaises(locus.LocusError, client.server)
        self.assertEqual(server.calls, 1)

    def test_a_changed_token_file_is_read_before_the_next_call_and_after_a_refusal(self):
        server = self.serve()
        client = self.connect(server, token_file=self.write_token("one"))
        self.assertEqual(server.seen["GetServer"], "Bearer one")
        self.write_token("two")
        client.server()
        self.assertEqual(server.seen["GetServer"], "Bearer two")
        os.remove(self.path("token"))
        client.server()
        self.assertEqual(server.seen["GetServer"], "Bearer two")
        server.required, server.refused = "three", lambda: self.write_token("three")
        client.server()
        self.assertEqual(server.seen["GetServer"], "Bearer three")

    def test_a_stream_continues_with_the_new_token(self):
        server = self.serve()
        server.required = "one"
        client = self.connect(server, token_file=self.write_token("one"))
        stream = client.update_stream("arena")
        stream.send(locus.UpdateBatch()).result(WAIT_SECONDS)
        server.required, server.refused = "two", lambda: self.write_token("two")
        stream.send(locus.UpdateBatch()).result(WAIT_SECONDS)
        self.assertEqual(server.seen["StreamUpdates"], "Bearer two")

    def test_a_token_stays_on_this_machine_without_tls(self):
        for target in ("unix:/run/locus.sock", "127.0.0.1:1", "127.9.9.9:1", "localhost:1", "[::1]:1"):
            self.assertTrue(credentials.stays_on_this_machine(target), target)
        for target in ("127.0.0.1.example.com:1", "localhost.example.com:1", "10.0.0.1:1", "[::2]:1", "0.0.0.0:1"):
            self.assertFalse(credentials.stays_on_this_machine(target), target)
        with self.assertRaisesRegex(ValueError, "connect with TLS"):
            locus.connect("example.com", token="secret")
        credentials.Token(credentials.Credentials(token="secret", allow_token_without_tls=True), "example.com:1")
        credentials.Token(credentials.Credentials(token="secret", tls=True), "example.com:1")

    def test_options_that_do_not_fit_together_are_refused(self):
        for options in ({"cert": "a"}, {"key": "a"}, {"token": "a", "token_file": "b"}, {"token": "two words"},
                        {"token": "a\nb"}, {"token": "x" * (credentials.MAX_TOKEN_BYTES + 1)}):
            with self.assertRaises(ValueError) as raised:
                locus.connect("127.0.0.1:1", **options)
            self.assertNotIn("two words", str(raised.exception))
        for options in ({"ca": "/nonexistent"}, {"token_file": "/nonexistent"}):
            with self.assertRaises(FileNotFoundError):
                locus.connect("127.0.0.1:1", **options)
        self.assertNotIn("secret", repr(credentials.Credentials(token="secret")))
