"""Tests completions of an unfinished line in each shell: completion_test.py BIN_DIRECTORY. Needs bash, zsh and fish."""

import os
import subprocess
import sys
import tempfile
import time
import unittest

from shells import Bash, Fish, Zsh

BIN = os.path.abspath(sys.argv[1])
START_SECONDS = 30


def last_part(offer):
    """Returns the part after the last = or comma. The shells differ in what they repeat before this part."""
    return offer.split("=")[-1].split(",")[-1] if not offer.startswith("--") or "=" in offer else offer


class Offers:
    """The tests of completion; a subclass for each shell runs them."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        os.chdir(cls.folder.name)
        for name in ("level.obj", "levels.txt"):
            open(name, "w", encoding="utf-8").close()
        cls.daemon = subprocess.Popen([os.path.join(BIN, "locusd"), "--listen", "127.0.0.1:0", "--port-file", "port"],
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + START_SECONDS
        while not os.path.exists("port"):
            if cls.daemon.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError("locusd did not start")
            time.sleep(0.05)
        with open("port", encoding="utf-8") as file:
            cls.address = "127.0.0.1:" + file.read().strip()
        environment = dict(os.environ, PATH=BIN + ":" + os.environ["PATH"], LOCUS_ADDRESS=cls.address, LC_ALL="C.UTF-8",
                           HOME=cls.folder.name)
        for scene in ("arena", "arena-2", "hall"):
            subprocess.run(["locus", "scene", "create", scene], env=environment, check=True, stdout=subprocess.DEVNULL)
        with open("script", "w", encoding="utf-8") as file:
            subprocess.run(["locus", "completion", cls.kind.name], env=environment, check=True, stdout=file)
        cls.shell = cls.kind(os.path.abspath("script"), environment)

    @classmethod
    def tearDownClass(cls):
        cls.shell.close()
        cls.daemon.terminate()
        code = cls.daemon.wait(timeout=60)
        os.chdir("/")
        cls.folder.cleanup()
        if code != 0:
            raise RuntimeError(f"locusd ended with {code}")

    def offers(self, line):
        return {last_part(offer) for offer in self.shell.offers(line)}

    def test_the_script_has_no_mistake_of_form(self):
        self.assertEqual(self.shell.check(), "")

    def test_commands_on_every_level(self):
        self.assertEqual(self.offers("locus que"), {"query"})
        self.assertLessEqual({"ray", "ball", "box", "nearest"}, self.offers("locus query "))

    def test_options_of_the_command_and_of_the_program(self):
        self.assertEqual(self.offers("locus query ray --mod"), {"--mode"})
        self.assertEqual(self.offers("locus query ray --out"), {"--output", "--outside"})
        self.assertNotIn("--inside", self.offers("locus query ball --ins"))

    def test_the_words_an_option_takes(self):
        self.assertEqual(self.offers("locus query ray arena --mode "), {"first", "any", "all"})
        self.assertEqual(self.offers("locus query ray arena --mode=f"), {"first"})
        self.assertEqual(self.offers("locus -o nd"), {"ndjson"})

    def test_the_words_a_positional_takes(self):
        self.assertEqual(self.offers("locus insert arena ca"), {"capsule"})

    def test_each_word_of_a_list(self):
        self.assertEqual(self.offers("locus query ray arena --columns id,no"), {"normal"})

    def test_values_are_not_taken_for_commands_or_positionals(self):
        self.assertEqual(self.offers("locus -a 127.0.0.1:1 -o json query bo"), {"box"})
        self.assertEqual(self.offers("locus query ray --from -1,2,3 --dir=0,0,1 arena --cull b"), {"back"})

    def test_scenes_of_the_server(self):
        self.assertEqual(self.offers("locus get a"), {"arena", "arena-2"})
        self.assertEqual(self.offers("locus import level.obj --scene h"), {"hall"})

    def test_scenes_of_the_server_that_the_line_names(self):
        self.assertEqual(self.offers("locus -a unix:/nonexistent/socket get a"), set())
        self.assertEqual(self.offers(f"locus --address={self.address} get h"), {"hall"})

    def test_files(self):
        self.assertEqual(self.offers("locus import lev"), {"level.obj", "levels.txt"})

    def test_nothing_where_there_is_nothing_to_know(self):
        self.assertEqual(self.offers("locus query ray arena --from "), set())
        self.assertEqual(self.offers("locus nonsense "), self.offers("locus "))


class BashTest(Offers, unittest.TestCase):
    kind = Bash


class ZshTest(Offers, unittest.TestCase):
    kind = Zsh


class FishTest(Offers, unittest.TestCase):
    kind = Fish


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
