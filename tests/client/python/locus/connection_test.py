"""Tests of the conversion of addresses and scene names for gRPC."""
import unittest

from locus import connection


class ConnectionTest(unittest.TestCase):
    def test_the_default_port_is_added_to_an_address_without_port(self):
        for address, target in (("localhost", "localhost:7575"), ("10.0.0.1:80", "10.0.0.1:80"), ("[::1]", "[::1]:7575"),
                                ("[::1]:9", "[::1]:9"), ("unix:/run/locus.sock", "unix:/run/locus.sock")):
            self.assertEqual(connection.target_of(address), target)

    def test_only_a_legal_name_becomes_a_header(self):
        self.assertEqual(connection.scene_metadata("arena-1"), [("x-scene", "arena-1")])
        self.assertEqual(connection.scene_metadata("team.match_7"), [("x-scene", "team.match_7")])
        for name in ("", "a b", "a\n", "ä", "x" * 64):
            self.assertEqual(connection.scene_metadata(name), [])
