"""Packs a finished build twice, in two folders, and checks the packages without installing them:

    python3 packages_test.py --build DIR --source DIR --out DIR

Leaves the packages in OUT/packages, for the other tests of this folder. Exits 77, which counts as skipped, if the tools of
`./deploy/packages.sh package` are not installed.
"""

import argparse
import filecmp
import glob
import hashlib
import json
import os
import re
import shutil
import sys
import tempfile
import unittest

import debian_root
from debian_root import run

PROGRAMS = {"locusd": "usr/bin/locusd", "locus": "usr/bin/locus"}
CONTENTS = {
    "locusd": ["etc/default/locusd", "etc/locus/locusd.conf", "lib/systemd/system/locusd.service", "usr/bin/locusd",
               "usr/share/man/man8/locusd.8.gz", "usr/share/man/man8/locusd-check.8.gz"],
    "locus": ["usr/bin/locus", "usr/share/bash-completion/completions/locus",
              "usr/share/fish/vendor_completions.d/locus.fish", "usr/share/zsh/vendor-completions/_locus",
              "usr/share/man/man1/locus-query-ray.1.gz", "usr/share/man/man1/locus.1.gz"],
    "liblocus-client-dev": ["usr/include/locus/client/lib/client.h", "usr/include/locus/core/index/bvh/bvh.h",
                            "usr/include/locus/locus/v1/query_service.grpc.pb.h", "usr/lib/{triplet}/liblocus_client.a",
                            "usr/lib/{triplet}/cmake/locus/locusConfig.cmake", "usr/lib/{triplet}/pkgconfig/locus-client.pc",
                            "usr/lib/{triplet}/pkgconfig/locus-index.pc",
                            "usr/share/locus/proto/locus/v1/query_service.proto"],
    "python3-locus": ["usr/lib/python3/dist-packages/locus/__init__.py", "usr/lib/python3/dist-packages/locus/schema.binpb"],
    "locus-doc": ["usr/share/doc/locus-doc/html/index.html", "usr/share/doc/locus-doc/html/operations/alerts.html"],
}
FOLDERS = {"locusd": ("etc/default", "etc/locus", "lib/systemd/system", "usr/bin", "usr/share/man/man8"),
           "locus": ("usr/bin", "usr/share/bash-completion", "usr/share/fish", "usr/share/man/man1", "usr/share/zsh"),
           "liblocus-client-dev": ("usr/include/locus", "usr/lib", "usr/share/locus"),
           "python3-locus": ("usr/lib/python3/dist-packages/locus",),
           "locus-doc": ("usr/share/doc/locus-doc", "usr/share/doc-base")}


def pack(source, out, mask):
    """Packs with an umask; the sources are those of a folder that may be a copy of the clone."""
    run("bash", "-c", 'umask "$1" && shift && exec "$@"', "bash", mask, os.path.join(source, "deploy/package.sh"),
        "--from", OPTIONS.build, "--docs", OPTIONS.out + "/site", "--out", out)


def files_below(folder):
    return {os.path.relpath(os.path.join(place, name), folder) for place, _, names in os.walk(folder) for name in names}


class PackagesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(OPTIONS.out, ignore_errors=True)
        cls.folder = os.path.join(OPTIONS.out, "packages")
        run(os.path.join(OPTIONS.source, "deploy/docs/build.sh"), "--build", OPTIONS.build, "--site", OPTIONS.out + "/site",
            "--pages", OPTIONS.out + "/pages")
        pack(OPTIONS.source, cls.folder, "0022")
        cls.debs = {os.path.basename(path).split("_")[0]: path for path in glob.glob(cls.folder + "/*.deb")}
        os.makedirs(os.path.join(OPTIONS.out, "trees"))
        cls.trees = {}
        for name, path in cls.debs.items():
            cls.trees[name] = os.path.join(OPTIONS.out, "trees", name)
            run("dpkg-deb", "--raw-extract", path, cls.trees[name])
        cls.triplet = run("dpkg-architecture", "--query", "DEB_HOST_MULTIARCH").strip()

    def field(self, package, name):
        return run("dpkg-deb", "--field", self.debs[package], name).strip()

    def sbom(self, package):
        (path,) = glob.glob(f"{self.folder}/{package}_*.spdx.json")
        with open(path, encoding="utf-8") as file:
            return json.load(file)

    def test_every_package_is_there(self):
        self.assertEqual(set(self.debs), set(CONTENTS))

    def test_each_package_has_its_files_in_debians_folders(self):
        for package, tree in self.trees.items():
            files = {path for path in files_below(tree) if not path.startswith("DEBIAN/")}
            for path in CONTENTS.get(package, []):
                self.assertIn(path.format(triplet=self.triplet), files, package)
            common = (f"usr/share/doc/{package}/", "usr/share/lintian/overrides/")
            stray = [path for path in files if not path.startswith(common) and not path.startswith(FOLDERS[package])]
            self.assertEqual(stray, [], package)
            self.assertIn(f"usr/share/doc/{package}/copyright", files)

    def test_files_of_the_administrator_are_conffiles(self):
        with open(os.path.join(self.trees["locusd"], "DEBIAN/conffiles"), encoding="utf-8") as file:
            self.assertEqual(sorted(file.read().split()), ["/etc/default/locusd", "/etc/locus/locusd.conf"])

    def test_packages_that_a_build_installs_are_build_dependencies(self):
        with open(os.path.join(OPTIONS.source, "deploy/debian/control"), encoding="utf-8") as file:
            (field,) = re.findall(r"^Build-Depends:((?:.*\n )*.*)", file.read(), re.MULTILINE)
        depends = {word.split()[0] for word in field.split(",")}
        installed = set(run(os.path.join(OPTIONS.source, "deploy/packages.sh"), "--list", "build", "python").split())
        self.assertEqual(installed - depends - {"g++"}, set())

    def test_programs_need_libraries_only(self):
        for package in PROGRAMS:
            depends = re.split(r", | \| ", self.field(package, "Depends"))
            names = [word.split(" ")[0] for word in depends]
            self.assertGreater(len(names), 10)
            self.assertEqual([name for name in names if not re.match(r"(lib|zlib1g$)", name) or name.endswith("-dev")], [])

    def test_programs_are_hardened(self):
        for package, path in PROGRAMS.items():
            program = os.path.join(self.trees[package], path)
            shown = run("readelf", "--wide", "--file-header", "--program-headers", "--dynamic", program)
            self.assertRegex(shown, r"Type:\s+DYN \(Position-Independent Executable")
            self.assertIn("GNU_RELRO", shown)
            self.assertIn("BIND_NOW", shown)
            self.assertNotRegex(shown, r"\((RPATH|RUNPATH)\)")
            symbols = run("readelf", "--wide", "--dyn-syms", program)
            self.assertIn("__stack_chk_fail@", symbols)
            self.assertRegex(symbols, r"__\w+_chk@")

    def test_no_file_names_the_folders_of_the_build(self):
        rooms = ("core", "server", "client", "proto", "tests", "deploy")
        words = [OPTIONS.build.encode(), *(f"{OPTIONS.source}/{room}/".encode() for room in rooms)]
        for package, tree in self.trees.items():
            for path in files_below(tree):
                with open(os.path.join(tree, path), "rb") as file:
                    content = file.read()
                self.assertEqual([word for word in words if word in content], [], f"{package}: {path}")

    def test_all_folders_and_files_have_usual_rights_and_one_time(self):
        for package, path in self.debs.items():
            for line in run("dpkg-deb", "--contents", path).splitlines():
                rights, owner, _, day, time, name = line.split(maxsplit=5)
                self.assertIn(rights, ("drwxr-xr-x", "-rw-r--r--", "-rwxr-xr-x", "lrwxrwxrwx"), line)
                self.assertEqual(owner, "root/root", line)
                self.assertEqual(rights == "-rwxr-xr-x", name.removeprefix("./") == PROGRAMS.get(package), line)
                self.assertEqual((day, time), self.time_of_the_changelog(), line)

    def time_of_the_changelog(self):
        changelog = os.path.join(OPTIONS.source, "deploy/debian/changelog")
        when = run("dpkg-parsechangelog", "--file", changelog, "--show-field", "Timestamp")
        return tuple(run("date", "--date=@" + when.strip(), "+%F %H:%M").split())

    def test_lintian_has_nothing_to_say(self):
        (changes,) = glob.glob(self.folder + "/*.changes")
        shown = run("lintian", "--allow-root", "--pedantic", "--display-info", "--tag-display-limit", "0", "--fail-on", "none",
                    changes)
        self.assertEqual(shown, "")

    def test_every_exception_from_lintian_is_explained(self):
        overrides = glob.glob(os.path.join(OPTIONS.source, "deploy/debian/*.lintian-overrides"))
        self.assertGreaterEqual(len(overrides), 1)
        for path in overrides:
            with open(path, encoding="utf-8") as file:
                lines = file.read().splitlines()
            self.assertRegex(lines[0], r"^# \w.*\.$", path)

    def test_a_second_packing_elsewhere_and_later_is_equal(self):
        with tempfile.TemporaryDirectory() as folder:
            copy = os.path.join(folder, "another-clone")
            debian_root.copy_sources(OPTIONS.source, copy)
            second = os.path.join(folder, "second")
            pack(copy, second, "0077")
            names = [os.path.basename(path) for path in self.debs.values()]
            self.assertEqual(len(names), 5)
            for name in names:
                if not filecmp.cmp(os.path.join(self.folder, name), os.path.join(second, name), shallow=False):
                    self.fail(run("diffoscope", os.path.join(self.folder, name), os.path.join(second, name), check=False))

    def test_the_list_of_contents_is_complete(self):
        for package, tree in self.trees.items():
            listed = self.sbom(package)
            self.assertEqual((listed["spdxVersion"], listed["dataLicense"]), ("SPDX-2.3", "CC0-1.0"))
            expected = {}
            for path in files_below(tree):
                if not path.startswith("DEBIAN/") and not os.path.islink(os.path.join(tree, path)):
                    with open(os.path.join(tree, path), "rb") as file:
                        expected["./" + path] = hashlib.sha1(file.read()).hexdigest()
            shown = {entry["fileName"]: entry["checksums"][0]["checksumValue"] for entry in listed["files"]}
            self.assertEqual(shown, expected)
            self.check_references(listed)

    def check_references(self, listed):
        """Every relation and every licence refers to an element of the document."""
        known = {"SPDXRef-DOCUMENT"} | {entry["SPDXID"] for key in ("packages", "files") for entry in listed[key]}
        for relation in listed["relationships"]:
            self.assertLessEqual({relation["spdxElementId"], relation["relatedSpdxElement"]}, known)
        extracted = {entry["licenseId"] for entry in listed["hasExtractedLicensingInfos"]}
        named = {word for entry in listed["packages"] for word in re.findall(r"LicenseRef-[\w.-]+", entry["licenseDeclared"])}
        self.assertEqual(named, extracted)

    def test_the_list_of_contents_names_the_libraries_that_programs_link(self):
        for package in PROGRAMS:
            listed = self.sbom(package)
            linked = {relation["relatedSpdxElement"].removeprefix("SPDXRef-Package-") for relation in listed["relationships"]
                      if relation["relationshipType"] == "DYNAMIC_LINK"}
            # dpkg-shlibdeps has a name of its own for spdlog, which the package provides.
            depends = {word.split(" ")[0].removesuffix("-fmt9") for word in self.field(package, "Depends").split(", ")}
            self.assertEqual(linked, {name.replace("+", "-") for name in depends})
            self.assertEqual({entry["licenseDeclared"] for entry in listed["packages"]} & {"NOASSERTION", ""}, set())
            self.assertEqual(listed["packages"][0]["licenseDeclared"], "Apache-2.0")


def options():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("build", "source", "out"):
        parser.add_argument("--" + name, required=True, type=os.path.abspath)
    return parser.parse_args()


if __name__ == "__main__":
    OPTIONS = options()
    if run(os.path.join(OPTIONS.source, "deploy/packages.sh"), "--check", "package", "docs", check=False):
        print("SKIPPED: packages are missing: ./deploy/packages.sh package docs")
        sys.exit(debian_root.SKIPPED)
    unittest.main(argv=sys.argv[:1], verbosity=2)
