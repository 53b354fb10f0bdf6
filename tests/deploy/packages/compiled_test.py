"""Compiles the packages twice, in two folders, and compares them with each other and with a finished build:

    python3 compiled_test.py --source DIR --build DIR --work DIR

Each packing compiles everything, without ccache, and groups sources as the build does. The packages must equal those that
are packed from the build, which tests/run.sh has made.
"""

import argparse
import contextlib
import filecmp
import json
import os
import re
import shutil
import unittest

import debian_root
import packaged_programs

PICTURES = {"whole": [], "street": ["--eye", "-20,-70,12", "--look-at", "10,0,6", "--fov", "60"],
            "plan": ["--dir", "0,0,-1", "--ortho", "0", "--cull", "none"]}
COMPILED = ("locusd", "locus", "liblocus-client-dev", "python3-locus")
EXACT = ("-ffp-contract=off", "-fno-tree-slp-vectorize", "-O3", "-DNDEBUG")
HARDENED = ("-D_FORTIFY_SOURCE=2", "-fstack-protector-strong", "-Werror=format-security")


def cache_of_the_build():
    with open(os.path.join(OPTIONS.build, "CMakeCache.txt"), encoding="utf-8") as file:
        return file.read()


def pack(name, **environment):
    clone = os.path.join(OPTIONS.work, name)
    debian_root.copy_sources(OPTIONS.source, clone)
    unity = "OFF" if "LOCUS_UNITY:BOOL=OFF" in cache_of_the_build() else "ON"
    debian_root.run(os.path.join(clone, "deploy/package.sh"), timeout=5400,
                    env=dict(os.environ, LOCUS_UNITY=unity, **environment))
    return os.path.join(clone, "build/package")


class CompiledTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(OPTIONS.work, ignore_errors=True)
        cls.first = pack("one/clone")
        cls.second = pack("another/clone/elsewhere", TZ="Asia/Tokyo")
        cls.programs = packaged_programs.unpack(cls.first, os.path.join(OPTIONS.work, "unpacked"))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(OPTIONS.work, ignore_errors=True)

    def check_equal_to_the_first(self, folder):
        for name in COMPILED:
            (one,), (other,) = debian_root.newest(self.first, name), debian_root.newest(folder, name)
            self.assertEqual(os.path.basename(one), os.path.basename(other))
            if not filecmp.cmp(one, other, shallow=False):
                self.fail(debian_root.run("diffoscope", one, other, check=False, timeout=1800))

    def test_two_builds_are_equal(self):
        self.check_equal_to_the_first(self.second)

    # So what other tests show with programs of the build, such as results and speed, holds for compiled packages.
    def test_packages_packed_from_the_build_are_equal(self):
        folder = os.path.join(OPTIONS.work, "from-build")
        debian_root.run(os.path.join(OPTIONS.source, "deploy/package.sh"), "--from", OPTIONS.build, "--out", folder)
        self.check_equal_to_the_first(folder)

    def commands(self, folder):
        """Returns the command lines of the compiler for the sources in a folder."""
        with open(os.path.join(self.first, "compile_commands.json"), encoding="utf-8") as file:
            return [line for line in file if '"command"' in line and folder in line]

    def test_code_that_parses_what_clients_and_files_contain_has_protected_buffers(self):
        for folder, count in (("/core/scene/log/", 5), ("/server/", 20), ("/client/", 20), ("/proto/", 1)):
            commands = self.commands(folder)
            self.assertGreaterEqual(len(commands), count, folder)
            for command in commands:
                self.assertGreater(command.rfind(" -fstack-protector-strong "), command.rfind(" -fno-stack-protector "), command)
                self.assertGreater(command.rfind(" -D_FORTIFY_SOURCE=2 "), command.rfind(" -U_FORTIFY_SOURCE "), command)

    def test_flags_that_keep_answers_exact_survive(self):
        commands = self.commands("/core/")
        self.assertGreater(len(commands), 20)
        for command in commands:
            for flag in EXACT + HARDENED:
                self.assertIn(" " + flag + " ", command)
            self.assertLess(command.rindex(" -O2 "), command.rindex(" -O3 "))

    def test_packaged_programs_draw_the_golden_pictures(self):
        self.assertEqual(packaged_programs.golden_differences(OPTIONS.source, self.programs, OPTIONS.work), (9, []))

    def test_packaged_programs_answer_and_draw_as_those_of_the_build(self):
        pictures = {}
        with contextlib.ExitStack() as stack:
            addresses = {}
            for name, folder in (("packaged", self.programs), ("built", os.path.join(OPTIONS.build, "bin"))):
                place = os.path.join(OPTIONS.work, name)
                os.makedirs(place)
                addresses[name] = stack.enter_context(packaged_programs.daemon(folder, place))
                locus = [os.path.join(folder, "locus"), "-a", addresses[name]]
                debian_root.run(*locus, "generate", "city", "--triangles", "30000", "--seed", "3", "--scene", "city", "--create")
                for picture, options in PICTURES.items():
                    path = os.path.join(place, picture + ".png")
                    report = json.loads(debian_root.run(*locus, "-o", "json", "render", "city", path, *options))
                    self.assertGreater(report["hits"], 1000, picture)
                    with open(path, "rb") as file:
                        pictures[name, picture] = file.read()
            shown = debian_root.run(os.path.join(self.programs, "locus"), "-a", addresses["packaged"], "demo", "--seconds", "3",
                                    "--compare", addresses["built"])
        for picture in PICTURES:
            self.assertEqual(pictures["packaged", picture], pictures["built", picture], picture)
        rows = [line.split() for line in shown.splitlines() if re.search(r"\s\d+\s+\d+$", line)]
        self.assertGreaterEqual(len(rows), 5, shown)
        self.assertEqual({row[-1] for row in rows}, {"0"}, shown)


def options():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("source", "build", "work"):
        parser.add_argument("--" + name, required=True, type=os.path.abspath)
    return parser.parse_args()


if __name__ == "__main__":
    OPTIONS = options()
    unittest.main(argv=["compiled_test.py"], verbosity=2)
