"""Installs the packages in a bare Debian root, as a new user would, up to the first right answers, and removes them:

    python3 root_test.py --packages DIR --work DIR --cache DIR [--compile SOURCE] [TEST...]

A root without systemd cannot start a unit, so the test starts locusd by hand with the variables of the unit; upgrade_test.py
starts it by systemd. --compile also installs the libraries for C++ and builds the programs of tests/e2e/install with them.
Exits 77, which counts as skipped, if a root cannot be made here.
"""

import argparse
import os
import re
import shutil
import sys
import time
import unittest

import debian_root

DEBIAN_PACKAGES = 70  # maximum number of packages from Debian; 59 when the packages were made
OURS = ("locusd", "locus", "python3-locus")
LOGS = ("./var/log/dpkg.log", "./var/log/apt/", "./var/log/alternatives.log", "./var/cache/", "./var/lib/apt/", "./var/lib/dpkg/",
        "./tmp/", "./debs", "./etc/ld.so.cache")
# Starts the daemon as the unit would, waits for it and runs the commands in `$@`.
WITH_DAEMON = r"""
set -eu
eval "$(sed -n 's/^Environment=\(.*\)$/export \1/p' /lib/systemd/system/locusd.service | grep -v %d)"
set -a; . /etc/default/locusd; set +a
mkdir -p "$LOCUS_DATA_DIR" "$(dirname "$LOCUS_AUDIT_FILE")"
"$(sed -n 's/^ExecStart=//p' /lib/systemd/system/locusd.service)" > /tmp/locusd.log 2>&1 &
daemon=$!
for _ in $(seq 200); do locus health > /dev/null 2>&1 && break; sleep 0.05; done
code=0
"$@" || code=$?
kill "$daemon"
wait "$daemon"
exit "$code"
"""
FIRST_RAY = """
import locus
with locus.connect("127.0.0.1:7575") as client:
    client.create_scene("yard")
    ack = client.apply("yard", locus.UpdateBatch().insert_balls(ids=[9], positions=[[0, 0, 30]], radii=0.5))
    hits = client.query("yard", locus.QueryBatch(at_least=ack).rays(origins=[[0, 0, 100]], directions=[[0, 0, -1]])).blocks[0]
    print("hit", hits.ids[0], "at t =", hits.t[0])
"""


class RootTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.root = os.path.join(OPTIONS.work, "root")
        debian_root.unpack(debian_root.archive(OPTIONS.cache), cls.root)
        cls.before = debian_root.installed(cls.root)
        cls.debs = debian_root.add_packages(cls.root, debian_root.newest(OPTIONS.packages, *OURS))
        began = time.monotonic()
        cls.inside("apt-get", "update")
        cls.inside("apt-get", "install", "--yes", "--no-install-recommends", *cls.debs)
        installed = time.monotonic()
        cls.demo = cls.with_daemon("locus", "demo", "--seconds", "1", "--objects", "1000")
        cls.python = cls.with_daemon("python3", "-c", FIRST_RAY)
        cls.seconds = time.monotonic() - began
        cls.new = debian_root.installed(cls.root) - cls.before
        print(f"bare root to first answers: {cls.seconds:.0f} s, of which apt-get {installed - began:.0f} s; "
              f"{len(cls.new)} packages, {len(cls.new) - len(OURS)} of them from Debian", flush=True)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.root)

    @classmethod
    def inside(cls, *command, **more):
        return debian_root.inside(cls.root, *command, **more)

    @classmethod
    def with_daemon(cls, *command):
        return cls.inside("sh", "-c", WITH_DAEMON, "sh", *command, network=False)

    def paths(self):
        """Returns all paths of the root, but for logs and caches of dpkg and apt."""
        found = self.inside("find", ".", "-xdev").splitlines()
        return {path for path in found if not path.startswith(LOGS)}

    def test_the_first_answers_are_right(self):
        rows = [line.split() for line in self.demo.splitlines() if re.search(r"\s\d+\s+\d+$", line)]
        self.assertGreaterEqual(len(rows), 5, self.demo)
        self.assertEqual({row[-1] for row in rows}, {"0"}, self.demo)
        self.assertGreater(sum(int(row[-2]) for row in rows), 0, self.demo)
        self.assertEqual(self.python, "hit 9 at t = 69.5\n")

    def test_few_packages_are_needed_and_no_compiler(self):
        self.assertLessEqual(set(OURS), self.new)
        self.assertLessEqual(len(self.new) - len(OURS), DEBIAN_PACKAGES)
        shown = self.inside("sh", "-c", "for tool in cc c++ gcc g++ clang ld as cmake; do command -v $tool; done; true")
        self.assertEqual(shown, "")

    def test_all_packages_come_from_debian(self):
        lines = self.inside("sh", "-c", "cat /etc/apt/sources.list /etc/apt/sources.list.d/* 2> /dev/null | grep -v '^#'; true")
        sources = [line for line in lines.splitlines() if line.strip()]
        self.assertGreaterEqual(len(sources), 1)
        self.assertEqual(sorted(sources), debian_root.sources())

    def test_removing_keeps_scenes_and_options_and_purging_leaves_nothing(self):
        self.inside("apt-get", "purge", "--yes", *OURS)
        bare = self.paths()
        self.assertEqual([path for path in bare if "locus" in path], [])
        self.inside("dpkg", "--install", *self.debs)
        self.with_daemon("python3", "-c", FIRST_RAY)
        stored = self.paths()
        self.assertIn("./var/log/locus/audit.json", stored)
        self.inside("apt-get", "remove", "--yes", *OURS)
        kept = {path for path in self.paths() if "locus" in path}
        self.assertNotIn("./usr/bin/locusd", kept)
        folders = ("./var/lib/locus", "./var/log/locus", "./etc/locus", "./etc/default/locusd")
        data = {path for path in stored if path.startswith(folders)}
        self.assertGreater(len(data), 8)
        self.assertLessEqual(data, kept)
        # The scene is there again when the package is.
        self.inside("dpkg", "--install", *self.debs)
        self.assertIn("yard", self.with_daemon("locus", "scene", "list"))
        self.inside("apt-get", "purge", "--yes", *OURS)
        self.assertEqual(self.paths() ^ bare, set())

    def test_programs_are_built_with_the_packages_for_cpp(self):
        if OPTIONS.compile is None:
            self.skipTest("compiling is tested with --compile")
        folder = os.path.join(self.root, "tmp/programs")
        shutil.copytree(os.path.join(OPTIONS.compile, "tests/e2e/install"), folder)
        (deb,) = debian_root.add_packages(self.root, debian_root.newest(OPTIONS.packages, "liblocus-client-dev"))
        self.inside("apt-get", "install", "--yes", "--no-install-recommends", deb, "g++", "cmake", "ninja-build")
        build = "g++ -std=c++20 {0}.cc -o {0} $(pkg-config --cflags --libs {1})"
        for program, package in (("program", "locus-client"), ("index_program", "locus-index")):
            self.inside("sh", "-c", "cd /tmp/programs && " + build.format(program, package))
        self.inside("sh", "-c", "cd /tmp/programs && cmake -S project -B build -G Ninja -DPROGRAM=/tmp/programs/program.cc "
                    "-DLIBRARY=client && cmake --build build")
        self.inside("dpkg", "--install", *self.debs)
        for program, writer in (("./program", "by-pkg-config"), ("build/program", "by-cmake")):
            shown = self.with_daemon("sh", "-c", f"cd /tmp/programs && {program} 127.0.0.1:7575 {writer}")
            self.assertEqual(shown, "hit 8 at t = 59.5\n")
        self.assertIn("nearest to the door: 9", self.inside("/tmp/programs/index_program"))


def options():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("packages", "work", "cache"):
        parser.add_argument("--" + name, required=True, type=os.path.abspath)
    parser.add_argument("--compile", type=os.path.abspath)
    parser.add_argument("tests", nargs="*")
    return parser.parse_args()


if __name__ == "__main__":
    OPTIONS = options()
    REASON = debian_root.missing(OPTIONS.packages)
    if REASON:
        print("SKIPPED:", REASON)
        sys.exit(debian_root.SKIPPED)
    unittest.main(argv=[sys.argv[0], *OPTIONS.tests], verbosity=2)
