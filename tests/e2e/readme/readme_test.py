"""Runs what README.md shows against a fresh locusd and compares the output:

    python3 readme_test.py README BIN_DIRECTORY [PYTHON_DIRECTORY]

Blocks marked console hold `$ command` lines, each followed by its output. A block marked grpcurl holds one call; the
test makes this call with `locus call`, because Debian does not package grpcurl. EPOCH stands for the scene's random
epoch. The block marked cpp was compiled as readme_example; its last comment says what it prints. Blocks marked python,
in README and in client/python/README.md, are scripts for the package in PYTHON_DIRECTORY; without this argument they
are skipped. The last comment of a script says what the script prints. The address in a script is replaced by that of
the daemon. Blocks marked text are not run: the test only checks that their programs exist.
"""

import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
import unittest

README, BIN = sys.argv[1], os.path.abspath(sys.argv[2])
PYTHON = os.path.abspath(sys.argv[3]) if len(sys.argv) > 3 else None
PYTHON_README = os.path.join(os.path.dirname(os.path.abspath(README)), "client/python/README.md")
DEFAULT_ADDRESS = "127.0.0.1:7575"
START_SECONDS = 30


def blocks(kind, readme=README):
    with open(readme, encoding="utf-8") as file:
        return re.findall(r"^```%s\n(.*?)^```" % kind, file.read(), re.MULTILINE | re.DOTALL)


def commands(block):
    """Returns pairs of a command and the output shown below it."""
    parts = re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]
    return [(part.split("\n", 1)[0], part.split("\n", 1)[1]) for part in parts]


def masked(text):
    text = re.sub(r'(epoch"?[:\s]+"?)\d+', r"\1EPOCH", text)
    return "\n".join(line.rstrip() for line in text.strip().splitlines())


class ReadmeTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        port_file = os.path.join(cls.folder.name, "port")
        cls.daemon = subprocess.Popen(
            [os.path.join(BIN, "locusd"), "--listen", "127.0.0.1:0", "--port-file", port_file],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + START_SECONDS
        while not os.path.exists(port_file):
            if cls.daemon.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError("locusd did not start")
            time.sleep(0.05)
        with open(port_file, encoding="utf-8") as file:
            cls.address = "127.0.0.1:" + file.read().strip()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.terminate()
        code = cls.daemon.wait(timeout=60)
        cls.folder.cleanup()
        if code != 0:
            raise RuntimeError(f"locusd ended with {code}")

    def run_shell(self, command):
        environment = dict(os.environ, PATH=BIN + ":" + os.environ["PATH"], LOCUS_ADDRESS=self.address)
        done = subprocess.run(command, shell=True, env=environment, cwd=os.path.dirname(os.path.abspath(README)),
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout}{done.stderr}")
        return done.stdout

    def test_1_commands_print_what_is_shown(self):
        shown = [pair for block in blocks("console") for pair in commands(block)]
        self.assertGreaterEqual(len(shown), 5)
        for command, output in shown:
            self.assertEqual(masked(self.run_shell(command)), masked(output), command)

    def test_2_call_by_hand_answers_what_is_shown(self):
        ((command, output),) = commands(blocks("grpcurl")[0])
        words = shlex.split(command)
        self.assertEqual(words[:3], ["grpcurl", "-plaintext", "-d"])
        self.assertEqual(words[4], DEFAULT_ADDRESS)
        call = ["locus", "call", words[5], words[3]]
        self.assertEqual(masked(self.run_shell(shlex.join(call))), masked(output))

    def test_3_program_prints_what_it_says(self):
        (wanted,) = re.findall(r"//\s*(hit .*)$", blocks("cpp")[0], re.MULTILINE)
        self.assertEqual(self.run_shell("readme_example " + self.address).strip(), wanted)

    @unittest.skipUnless(PYTHON, "the Python package is not built")
    def test_4_scripts_print_what_they_say(self):
        of_the_package = blocks("python", PYTHON_README)
        self.assertEqual(len(of_the_package), 1)
        for script in blocks("python") + of_the_package:
            (wanted,) = re.findall(r"#\s*(hit .*)$", script, re.MULTILINE)
            self.assertLessEqual(script.count("\n"), 25)
            self.assertEqual(script.count(DEFAULT_ADDRESS), 1)
            path = os.path.join(self.folder.name, "script.py")
            with open(path, "w", encoding="utf-8") as file:
                file.write(script.replace(DEFAULT_ADDRESS, self.address))
            command = shlex.join(["env", "PYTHONPATH=" + PYTHON, "/usr/bin/python3", "-B", path])
            self.assertEqual(self.run_shell(command).strip(), wanted)

    def test_6_the_preset_of_the_benchmarks_builds_them_after_the_quickstart(self):
        # The quickstart configures the same folder without tests, which the benchmarks need.
        with open(os.path.join(os.path.dirname(os.path.abspath(README)), "CMakePresets.json"), encoding="utf-8") as file:
            (bench,) = [preset for preset in json.load(file)["configurePresets"] if preset["name"] == "bench"]
        self.assertEqual(bench["cacheVariables"], {"LOCUS_BENCH": "ON", "LOCUS_TESTS": "ON"})

    def test_5_programs_to_read_about_exist(self):
        top = os.path.dirname(os.path.abspath(README))
        programs = [command.split()[0] for block in blocks("text") for command, _ in commands(block)]
        self.assertEqual(programs, ["./deploy/quickstart.sh", "./tests/run.sh"])
        for program in programs:
            self.assertTrue(os.access(os.path.join(top, program), os.X_OK), program)
            subprocess.run([os.path.join(top, program), "--help"], check=True, stdout=subprocess.DEVNULL, timeout=60)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
