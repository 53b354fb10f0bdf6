"""The world of one page while its blocks run: a folder, a fresh locusd, and one shell that all commands of the page share,
so that `cd`, variables and background jobs work as they do for a reader.
"""
import os
import selectors
import shutil
import signal
import subprocess
import tempfile
import time

SHOWN_ADDRESS, SHOWN_HTTP = "127.0.0.1:7575", "127.0.0.1:7576"
START_SECONDS = 30
COMMAND_SECONDS = 180
CCACHE = "/usr/lib/ccache"


def address_in(port_file):
    with open(port_file, encoding="utf-8") as file:
        return "127.0.0.1:" + file.read().strip()


class PageShell:
    """A context manager. `options` are those of the page's locusd; None if the page starts its own."""

    def __init__(self, binaries, python, options, prefix=None):
        self.binaries, self.options = binaries, options
        self.folder = tempfile.mkdtemp(prefix="page-")
        self.hidden = tempfile.mkdtemp(prefix="page-run-")
        # A daemon of the page's own listens on a unix socket; that of the runner chooses ports. So runs at once cannot meet.
        self.address, self.http = f"unix:{self.hidden}/locus.sock", None
        self.environment = {name: value for name, value in os.environ.items() if not name.startswith("LOCUS_")}
        self.environment.update(
            PATH=":".join([binaries, CCACHE, "/usr/bin", "/bin", os.environ["PATH"]]), PYTHONPATH=python,
            PYTHONDONTWRITEBYTECODE="1", HOME=self.hidden, LC_ALL="C.UTF-8")
        if options is None:
            self.environment.update(LOCUS_LISTEN=self.address, LOCUS_HTTP_LISTEN="")
        if prefix:
            self.environment.update(PKG_CONFIG_PATH=os.path.join(prefix, "lib/pkgconfig"), CMAKE_PREFIX_PATH=prefix)
        self.daemon = self.shell = None
        self.count = 0

    def __enter__(self):
        try:
            if self.options is not None:
                self.start_daemon()
                self.environment.update(LOCUS_METRICS_ADDRESS=self.http)
            self.environment.update(LOCUS_ADDRESS=self.address)
            self.shell = subprocess.Popen(["/bin/bash", "--noprofile", "--norc"], cwd=self.folder, env=self.environment,
                                          stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                          start_new_session=True)
            self.send("set -m")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        if self.shell:
            self.end_jobs()
        if self.daemon:
            self.daemon.terminate()
            try:
                self.daemon.wait(60)
            except subprocess.TimeoutExpired:
                self.daemon.kill()
        shutil.rmtree(self.folder, ignore_errors=True)
        shutil.rmtree(self.hidden, ignore_errors=True)

    def start_daemon(self):
        ports = [os.path.join(self.hidden, name) for name in ("port", "http-port")]
        with open(os.path.join(self.hidden, "log"), "w", encoding="utf-8") as log:
            self.daemon = subprocess.Popen(
                [os.path.join(self.binaries, "locusd"), "--listen", "127.0.0.1:0", "--port-file", ports[0], "--http-listen",
                 "127.0.0.1:0", "--http-port-file", ports[1], *self.options], cwd=self.folder, env=self.environment,
                stdout=log, stderr=log)
        deadline = time.monotonic() + START_SECONDS
        while not all(map(os.path.exists, ports)):
            if self.daemon.poll() is not None or time.monotonic() > deadline:
                with open(os.path.join(self.hidden, "log"), encoding="utf-8") as log:
                    raise RuntimeError(f"locusd did not start: {log.read()}")
            time.sleep(0.02)
        self.address, self.http = map(address_in, ports)

    def send(self, line):
        self.shell.stdin.write(line.encode() + b"\n")
        self.shell.stdin.flush()

    def end_jobs(self):
        """Ends the shell and every job that a command of the page left in the background."""
        self.send('for job in $(jobs -p); do kill -TERM -- "-$job"; done; wait; exit')
        try:
            self.shell.wait(30)
        except subprocess.TimeoutExpired:
            for process in self.members():
                os.kill(process, signal.SIGKILL)
            self.shell.wait()
        self.shell.stdin.close()
        self.shell.stdout.close()

    def members(self):
        """Returns the ids of the processes in the session of the shell."""
        listing = subprocess.run(["ps", "-o", "pid=", "-s", str(self.shell.pid)], capture_output=True, text=True)
        return [int(word) for word in listing.stdout.split()]

    def write(self, name, text):
        """Saves a file of the page, with the daemon's address in it."""
        path = os.path.join(self.folder, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.addressed(text))
        return path

    def addressed(self, text):
        if self.http is None and SHOWN_HTTP in text:
            raise RuntimeError(f"the locusd that a page starts itself has no HTTP port: {text}")
        return text.replace(SHOWN_ADDRESS, self.address).replace(SHOWN_HTTP, self.http or SHOWN_HTTP)

    def shown(self, text):
        return text.replace(self.address, SHOWN_ADDRESS).replace(self.http or SHOWN_HTTP, SHOWN_HTTP)

    def run(self, command):
        """Runs one command in the shell; returns its exit code, output and errors, with the addresses that pages show."""
        self.count += 1
        base = os.path.join(self.hidden, str(self.count))
        with open(base + ".sh", "w", encoding="utf-8") as file:
            file.write(self.addressed(command) + "\n")
        self.send(f"{{ source {base}.sh; }} </dev/null >{base}.out 2>{base}.err; echo $?")
        code = int(self.answer(command))
        texts = []
        for ending in (".out", ".err"):
            with open(base + ending, encoding="utf-8", errors="replace") as file:
                texts.append(self.shown(file.read()))
        return code, texts[0], texts[1]

    def answer(self, command):
        """Reads the line that the shell prints after a command."""
        line, deadline = b"", time.monotonic() + COMMAND_SECONDS
        with selectors.DefaultSelector() as selector:
            selector.register(self.shell.stdout, selectors.EVENT_READ)
            while not line.endswith(b"\n"):
                if not selector.select(max(0, deadline - time.monotonic())):
                    raise RuntimeError(f"did not end within {COMMAND_SECONDS} s: {command}")
                read = os.read(self.shell.stdout.fileno(), 4096)
                if not read:
                    raise RuntimeError(f"ended the shell: {command}")
                line += read
        return line
