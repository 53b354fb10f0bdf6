"""A locusd on free loopback ports, for the time of a `with` block, and the text of its pages."""
import os
import subprocess
import tempfile
import time
import urllib.request

START_SECONDS = 30


class Daemon:
    """A context manager. `address` and `http` are where the daemon listens."""

    def __init__(self, binaries, *options):
        self.binaries, self.options = binaries, options

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory()
        files = [os.path.join(self.folder.name, name) for name in ("port", "http")]
        environment = {name: value for name, value in os.environ.items() if not name.startswith("LOCUS_")}
        self.process = subprocess.Popen(
            [os.path.join(self.binaries, "locusd"), "--listen", "127.0.0.1:0", "--port-file", files[0],
             "--http-listen", "127.0.0.1:0", "--http-port-file", files[1], *self.options],
            env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + START_SECONDS
        while not all(map(os.path.exists, files)):
            if self.process.poll() is not None or time.monotonic() > deadline:
                self.__exit__()
                raise RuntimeError("locusd did not start")
            time.sleep(0.02)
        self.address, self.http = map(self.read_port, files)
        return self

    @staticmethod
    def read_port(path):
        with open(path, encoding="utf-8") as file:
            return "127.0.0.1:" + file.read().strip()

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(START_SECONDS)
        self.folder.cleanup()

    def locus(self, *arguments):
        """Runs the command line; returns its exit code and output."""
        done = subprocess.run([os.path.join(self.binaries, "locus"), "--address", self.address, *arguments],
                              capture_output=True, text=True, timeout=60)
        return done.returncode, done.stdout

    def metrics(self):
        with urllib.request.urlopen(f"http://{self.http}/metrics", timeout=START_SECONDS) as page:
            return page.read().decode()
