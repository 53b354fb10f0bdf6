"""Support of the Python tests: a locusd process, the command line, and the modules that protoc generates."""
import glob
import importlib
import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time
import unittest

import locus
from locus import columns

BIN = os.environ["LOCUS_BIN"]
PROTO = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../proto")
START_SECONDS = 60
WAIT_SECONDS = 60


class Daemon:
    """Process of locusd on a free port, ended by stop()."""

    def __init__(self, *options):
        self.folder = tempfile.TemporaryDirectory()
        port_file = os.path.join(self.folder.name, "port")
        command = [os.path.join(BIN, "locusd"), "--listen", "127.0.0.1:0", "--port-file", port_file, *options]
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + START_SECONDS
        while not os.path.exists(port_file):
            if self.process.poll() is not None or time.monotonic() > deadline:
                self.process.kill()
                self.folder.cleanup()
                raise RuntimeError("locusd did not start")
            time.sleep(0.02)
        with open(port_file, encoding="utf-8") as file:
            self.address = "127.0.0.1:" + file.read().strip()

    def stop(self):
        self.process.terminate()
        code = self.process.wait(timeout=WAIT_SECONDS)
        self.folder.cleanup()
        if code != 0:
            raise RuntimeError(f"locusd ended with {code}")

    def kill(self):
        """Kills the process, to simulate a crash."""
        self.process.kill()
        self.process.wait(timeout=WAIT_SECONDS)
        self.folder.cleanup()


class DaemonTest(unittest.TestCase):
    """Base class whose tests share a locusd and a client; each test has a scene that is named after it. The locusd is a
    Daemon or, with run_tests.py --embedded, that of locus.embedded().
    """

    @classmethod
    def setUpClass(cls):
        if os.environ["LOCUS_EMBEDDED"]:
            cls.client = cls.daemon = locus.embedded(program=os.path.join(BIN, "locusd"), timeout=WAIT_SECONDS)
            cls.addClassCleanup(cls.client.close)
            return
        cls.daemon = Daemon()
        cls.addClassCleanup(cls.daemon.stop)
        cls.client = locus.connect(cls.daemon.address, timeout=WAIT_SECONDS)
        cls.addClassCleanup(cls.client.close)

    def setUp(self):
        self.scene = self._testMethodName[:60].replace("_", "-").lower().rstrip("-")
        self.client.create_scene(self.scene)

    def apply(self, batch):
        return self.client.apply(self.scene, batch)

    def ask(self, batch):
        """Returns the blocks of the answer."""
        return self.client.query(self.scene, batch).blocks

    def command_line(self, *arguments):
        """Runs `locus -o json ...` and returns its output as Python values. If it fails, the test fails with its error text."""
        command = [os.path.join(BIN, "locus"), "--address", self.daemon.address, "-o", "json", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=WAIT_SECONDS)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def assertRefused(self, error, code, reason, field=None):
        self.assertEqual((error.code.name, error.reason.name), (code, reason), str(error))
        if field is not None:
            self.assertEqual(error.field, field)


def example_path(name):
    """Returns the path of the example program `name`."""
    return os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../client/python/examples", name + ".py")


def load_example(path):
    """Returns the example program at `path` as a module, without running it."""
    spec = importlib.util.spec_from_file_location(os.path.basename(path)[:-len(".py")], path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def listed(values):
    """Returns a column, a numpy array or array.array, as a flat list."""
    return values.ravel().tolist() if columns.numpy else values.tolist()


def number(text):
    """Converts a JSON string to a number: a float for inf, -inf and nan, an int (such as an id) for other texts."""
    return float(text) if text in ("inf", "-inf", "nan") else int(text)


def generated_protocol(test_class):
    """Returns the modules that protoc generates from the real files, by name; their files are removed after the class."""
    folder = tempfile.TemporaryDirectory()
    test_class.addClassCleanup(folder.cleanup)
    files = sorted(glob.glob(os.path.join(PROTO, "locus/v1/*.proto")))
    subprocess.run([os.environ["LOCUS_PROTOC"], "-I", PROTO, "--python_out=" + folder.name, *files], check=True,
                   timeout=WAIT_SECONDS)
    locus.__path__.append(os.path.join(folder.name, "locus"))
    names = [os.path.basename(file)[:-len(".proto")] + "_pb2" for file in files]
    return {name: importlib.import_module("locus.v1." + name) for name in names}


def floats(values):
    """Returns the numbers rounded to float32."""
    return memoryview(columns.encode("floats", list(values), columns.FLOAT32)).cast("f").tolist()


def without_numpy():
    return sys.modules.get("numpy") is None
