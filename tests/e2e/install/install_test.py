"""Installs the build into a folder, moves it, and uses it as a user would: install_test.py --build DIR --source DIR
--cmake PROGRAM --compiler PROGRAM --folder DIR.

The user's program is built twice, through find_package and through pkg-config, and run against the installed locusd.
"""

import argparse
import concurrent.futures
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import time
import unittest

START_SECONDS = 30
HERE = os.path.dirname(os.path.abspath(__file__))
PROGRAM = os.path.join(HERE, "program.cc")
EMBEDDED_PROGRAM = os.path.join(HERE, "embedded_program.cc")
INDEX_PROGRAM = os.path.join(HERE, "index_program.cc")
INDEX_OUTPUT = "the shot hits monster 7 at 9.5\nnear the explosion: 7 9\nnearest to the door: 9\n"
WANTED = "hit 8 at t = 59.5\n"


def run(*command, **environment):
    done = subprocess.run(command, env=dict(os.environ, **environment), capture_output=True, text=True, timeout=300)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(command)}\nexited with {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def files_below(folder):
    return {os.path.relpath(os.path.join(place, name), folder) for place, _, names in os.walk(folder) for name in names}


def install(component, prefix, **environment):
    parts = ["--component", component] if component else []
    run(OPTIONS.cmake, "--install", OPTIONS.build, "--prefix", prefix, *parts, **environment)


class InstallTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(OPTIONS.folder, ignore_errors=True)
        cls.components = {}
        for component in ("runtime", "dev", "python"):
            install(component, os.path.join(OPTIONS.folder, component))
            cls.components[component] = files_below(os.path.join(OPTIONS.folder, component))
        install(None, os.path.join(OPTIONS.folder, "first"))
        cls.tree = os.path.join(OPTIONS.folder, "moved")
        os.rename(os.path.join(OPTIONS.folder, "first"), cls.tree)
        cls.files = files_below(cls.tree)
        (library,) = glob.glob(os.path.join(cls.tree, "**", "pkgconfig"), recursive=True)
        cls.pkgconfig = {"PKG_CONFIG_PATH": library}
        cls.start_daemon()

    @classmethod
    def start_daemon(cls):
        port_file = os.path.join(OPTIONS.folder, "port")
        command = [os.path.join(cls.tree, "bin/locusd"), "--listen", "127.0.0.1:0", "--port-file", port_file]
        cls.daemon = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + START_SECONDS
        while not os.path.exists(port_file):
            if cls.daemon.poll() is not None or time.monotonic() > deadline:
                cls.daemon.kill()
                raise RuntimeError("locusd did not start")
            time.sleep(0.05)
        with open(port_file, encoding="utf-8") as file:
            cls.address = "127.0.0.1:" + file.read().strip()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.terminate()
        code = cls.daemon.wait(timeout=60)
        shutil.rmtree(OPTIONS.folder, ignore_errors=True)
        if code != 0:
            raise RuntimeError(f"locusd ended with {code}")

    def test_the_quickstart_builds_everything_that_is_installed(self):
        with open(os.path.join(OPTIONS.source, "deploy/quickstart.sh"), encoding="utf-8") as file:
            targets = re.search(r'^cmake --build "\$build" --target (.*)$', file.read(), re.MULTILINE).group(1).split()
        commands = run("ninja", "-C", OPTIONS.build, "-t", "commands", *targets)
        outputs = {line.split(": ")[0] for line in run("ninja", "-C", OPTIONS.build, "-t", "targets", "all").splitlines()}
        installed = {"deploy/manual/pages.stamp"}
        for script in glob.glob(os.path.join(OPTIONS.build, "**", "cmake_install.cmake"), recursive=True):
            with open(script, encoding="utf-8") as file:
                found = re.findall(rf'"{re.escape(OPTIONS.build)}/([^"]+)"', file.read())
            installed.update(path for path in found if path in outputs and not path.endswith("cmake_install.cmake"))
        self.assertIn("deploy/install/bash/locus", installed)
        unbuilt = [path for path in installed if not re.search(rf"\b{re.escape(path)}(\s|$)", commands)]
        self.assertEqual(unbuilt, [])

    def flags(self, *what, package="locus-client"):
        return run("pkg-config", *what, package, **self.pkgconfig).split()

    def test_every_file_belongs_to_exactly_one_component(self):
        self.assertEqual(sorted(path for paths in self.components.values() for path in paths), sorted(self.files))
        self.assertEqual({path for path in self.components["dev"] if path.startswith("bin/")}, set())
        self.assertEqual({path for path in self.components["runtime"] if path.endswith((".h", ".a", ".cmake", ".pc"))}, set())

    def test_the_expected_files_are_installed(self):
        for path in ("bin/locus", "bin/locusd", "share/doc/locus/README.md", "share/doc/locus/LICENSE",
                     "share/man/man1/locus.1", "share/man/man1/locus-query-ray.1", "share/man/man8/locusd.8",
                     "share/bash-completion/completions/locus", "share/zsh/site-functions/_locus",
                     "share/fish/vendor_completions.d/locus.fish", "share/doc/locus/locusd.conf.example",
                     "share/locus/proto/locus/v1/query_service.proto",
                     "include/locus/client/lib/client.h", "include/locus/core/index/bvh/bvh.h",
                     "include/locus/client/embedded/embedded_server.h",
                     "include/locus/locus/v1/query_service.grpc.pb.h"):
            self.assertIn(path, self.files)

    def test_all_headers_are_in_the_folder_of_the_project(self):
        outside = {path for path in self.files if path.startswith("include/") and not path.startswith("include/locus/")}
        self.assertEqual(outside, set())

    def test_no_installed_text_names_the_build_folders(self):
        for path in sorted(self.files):
            if path.endswith((".cmake", ".pc", ".h", ".conf.example")):
                with open(os.path.join(self.tree, path), encoding="utf-8") as file:
                    text = file.read()
                for folder in (OPTIONS.build, OPTIONS.source + "/"):
                    self.assertNotIn(folder, text, path)

    def test_the_unit_starts_the_daemon_where_it_was_installed(self):
        with open(os.path.join(self.tree, "lib/systemd/system/locusd.service"), encoding="utf-8") as file:
            self.assertIn(f"\nExecStart={os.path.join(OPTIONS.folder, 'first')}/bin/locusd\n", file.read())

    def test_a_packager_can_stage_the_tree_elsewhere(self):
        stage = os.path.join(OPTIONS.folder, "stage")
        install(None, "/usr", DESTDIR=stage)
        self.assertEqual(files_below(os.path.join(stage, "usr")), self.files)
        self.assertEqual(os.listdir(stage), ["usr"])

    def test_every_header_can_be_included_alone(self):
        include = os.path.join(self.tree, "include/locus")
        headers = sorted(path for room in ("client", "core") for path in
                         glob.glob(os.path.join(include, room, "**/*.h"), recursive=True))
        generated = sorted(glob.glob(os.path.join(include, "locus/v1/*.pb.h")))
        self.assertGreaterEqual(len(headers), 80)
        self.assertGreaterEqual(len(generated), 16)
        flags = ["-std=c++20", "-fsyntax-only", *self.flags("--cflags")]
        calls = [[OPTIONS.compiler, *flags, "-x", "c++", header] for header in headers]
        together = [word for header in generated for word in ("-include", header)]
        calls.append([OPTIONS.compiler, *flags, *together, "-x", "c++", "/dev/null"])
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            list(pool.map(lambda call: run(*call), calls))

    def build_project(self, library, program):
        """Builds a user's project with a library of the installed tree and returns the folder of the build."""
        build = os.path.join(OPTIONS.folder, "project-" + library)
        run(OPTIONS.cmake, "-S", os.path.join(HERE, "project"), "-B", build, "-G", "Ninja", f"-DPROGRAM={program}",
            f"-DLIBRARY={library}", f"-DCMAKE_PREFIX_PATH={self.tree}", f"-DCMAKE_CXX_COMPILER={OPTIONS.compiler}",
            "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON")
        run(OPTIONS.cmake, "--build", build)
        return build

    def test_a_program_with_an_embedded_server_is_built_through_find_package(self):
        build = self.build_project("embedded", EMBEDDED_PROGRAM)
        self.assertEqual(run(os.path.join(build, "program")), WANTED)

    def test_a_program_is_built_through_find_package(self):
        build = self.build_project("client", PROGRAM)
        with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
            (entry,) = json.load(file)
        for ours in ("-Werror", "-Wall", "-ffp-contract", "-fno-tree-slp-vectorize"):
            self.assertNotIn(ours, entry["command"])
        self.assertEqual(run(os.path.join(build, "program"), self.address, "through-cmake"), WANTED)

    def test_a_program_is_built_through_pkg_config(self):
        program = os.path.join(OPTIONS.folder, "program")
        run(OPTIONS.compiler, "-std=c++20", PROGRAM, "-o", program, *self.flags("--cflags", "--libs"))
        self.assertEqual(run(program, self.address, "through-pkg-config"), WANTED)

    def test_a_program_with_its_own_values_is_built_through_find_package_without_grpc(self):
        build = self.build_project("index", INDEX_PROGRAM)
        self.assertEqual(run(os.path.join(build, "program")), INDEX_OUTPUT)
        with open(os.path.join(build, "CMakeCache.txt"), encoding="utf-8") as file:
            self.assertNotIn("gRPC_DIR", file.read())

    def test_a_program_with_its_own_values_is_built_through_pkg_config(self):
        program = os.path.join(OPTIONS.folder, "index-program")
        flags = self.flags("--cflags", "--libs", package="locus-index")
        run(OPTIONS.compiler, "-std=c++20", INDEX_PROGRAM, "-o", program, *flags)
        self.assertEqual(run(program), INDEX_OUTPUT)

    def test_the_python_package_works_where_it_is_installed(self):
        folders = glob.glob(os.path.join(self.tree, "lib/python3*/dist-packages"))
        if not folders:
            self.skipTest("built without the Python package")
        script = f"import locus; print(locus.connect({self.address!r}).healthy())"
        self.assertEqual(run("/usr/bin/python3", "-B", "-c", script, PYTHONPATH=folders[0]), "True\n")

    def test_both_packages_have_the_version_of_the_program(self):
        version = self.flags("--modversion")
        self.assertEqual(run(os.path.join(self.tree, "bin/locus"), "--version").split(), ["locus", *version])


def options():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("build", "source", "cmake", "compiler", "folder"):
        parser.add_argument("--" + name, required=True)
    return parser.parse_args()


if __name__ == "__main__":
    OPTIONS = options()
    unittest.main(argv=sys.argv[:1], verbosity=2)
