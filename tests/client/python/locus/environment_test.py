"""Tests of connections that the environment and named contexts describe."""
import os
import tempfile
import unittest
from unittest import mock

import locus
from locus import environment
from support import Daemon

CONTEXTS = """# mine
default = usual
[usual]
address = usual:1
ca = /usual.pem

[prod]
address = prod:1
tls = true
cert = /prod.pem
key = /prod.key
server_name = inner
token_file = /prod.token
scene = arena
"""


class EnvironmentTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = os.path.join(folder.name, "locus", "contexts")
        os.mkdir(os.path.dirname(self.path))
        self.write(CONTEXTS)
        patch = mock.patch.dict(os.environ, {"XDG_CONFIG_HOME": folder.name})
        patch.start()
        self.addCleanup(patch.stop)
        for name in [name for name in os.environ if name.startswith("LOCUS_")]:
            del os.environ[name]

    def write(self, text):
        with open(self.path, "w", encoding="utf-8") as file:
            file.write(text)

    def test_without_variables_it_is_the_default_context(self):
        self.assertEqual(environment.endpoint(), {"address": "usual:1", "ca": "/usual.pem", "tls": False})

    def test_without_contexts_nothing_is_given(self):
        os.remove(self.path)
        self.assertEqual(environment.endpoint(), {})

    def test_every_variable_is_read(self):
        given = {"address": "other:1", "ca": "/ca.pem", "cert": "/own.pem", "key": "/own.key", "server_name": "name",
                 "token": "secret"}
        for name, value in given.items():
            os.environ["LOCUS_" + name.upper()] = value
        os.environ["LOCUS_TLS"] = "True"
        self.assertEqual(environment.endpoint(), {**given, "tls": True})
        os.environ["LOCUS_TOKEN_FILE"] = "/token"
        del given["token"]
        self.assertEqual(environment.endpoint(), {**given, "tls": True, "token_file": "/token"})

    def test_credentials_of_the_default_context_do_not_reach_the_address_of_the_environment(self):
        os.environ["LOCUS_ADDRESS"] = "other:1"
        self.assertEqual(environment.endpoint(), {"address": "other:1"})

    def test_a_named_context_gives_what_the_variables_leave_open(self):
        os.environ["LOCUS_CA"] = "/mine.pem"
        expected = {"address": "prod:1", "tls": True, "ca": "/mine.pem", "cert": "/prod.pem", "key": "/prod.key",
                    "server_name": "inner", "token_file": "/prod.token"}
        self.assertEqual(environment.endpoint("prod"), expected)
        os.environ["LOCUS_CONTEXT"] = "prod"
        self.assertEqual(environment.endpoint(), expected)
        self.assertEqual(environment.endpoint("usual")["address"], "usual:1")
        os.environ["LOCUS_CERT"] = "/own.pem"
        self.assertNotIn("key", environment.endpoint())

    def test_mistakes_are_named(self):
        with self.assertRaisesRegex(ValueError, "there is no context nowhere; there is prod, usual"):
            environment.endpoint("nowhere")
        os.environ["LOCUS_TLS"] = "perhaps"
        with self.assertRaisesRegex(ValueError, "LOCUS_TLS is true or false, not 'perhaps'"):
            environment.endpoint()
        del os.environ["LOCUS_TLS"]
        for text in ("address = x", "[a b]", "[a]\ntoken = secret", "[a]\ntls = yes", "[a]\nnonsense"):
            self.write(text)
            with self.assertRaisesRegex(ValueError, "contexts:%d: " % (text.count("\n") + 1)):
                environment.endpoint()

    def test_a_client_connects_and_options_come_before_the_environment(self):
        daemon = Daemon()
        self.addCleanup(daemon.stop)
        os.environ["LOCUS_ADDRESS"] = daemon.address
        with locus.connect_from_environment() as client:
            self.assertEqual(client.address, daemon.address)
        os.environ["LOCUS_ADDRESS"] = "127.0.0.1:1"
        with locus.connect_from_environment(address=daemon.address) as client:
            self.assertTrue(client.healthy())


if __name__ == "__main__":
    unittest.main()
