"""Runs the programs of packages without installing them."""

import contextlib
import os
import subprocess
import tempfile
import time

import debian_root
import golden_pictures

START_SECONDS = 30


def unpack(packages, folder):
    """Unpacks locusd and locus of the packages in a folder, and returns the folder of the two programs."""
    for path in debian_root.newest(packages, "locusd", "locus"):
        debian_root.run("dpkg-deb", "--extract", path, folder)
    return os.path.join(folder, "usr/bin")


@contextlib.contextmanager
def daemon(programs, folder):
    """Runs the daemon of a folder of programs on a free port of loopback, and returns its address."""
    program, port_file = os.path.join(programs, "locusd"), os.path.join(folder, "port")
    process = subprocess.Popen([program, "--listen", "127.0.0.1:0", "--http-listen", "", "--port-file", port_file],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + START_SECONDS
        while not os.path.exists(port_file):
            if process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"{program} did not start")
            time.sleep(0.05)
        with open(port_file, encoding="utf-8") as file:
            yield "127.0.0.1:" + file.read().strip()
    finally:
        process.terminate()
        process.wait(timeout=60)


def golden_differences(source, programs, work):
    """Returns how many golden pictures there are, and a line for each that the programs draw otherwise."""
    with tempfile.TemporaryDirectory(dir=work) as folder, daemon(programs, folder) as address:
        return golden_pictures.differences(source, os.path.join(programs, "locus"), address, folder)
