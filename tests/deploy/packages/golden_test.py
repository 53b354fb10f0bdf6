"""Draws the golden pictures with the programs of packages:

    python3 golden_test.py --packages DIR --source DIR --work DIR

Exits 77, which counts as skipped, if nothing was packed.
"""

import argparse
import glob
import os
import shutil
import sys
import unittest

import debian_root
import golden_pictures
import packaged_programs


class GoldenTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(OPTIONS.work, ignore_errors=True)
        os.makedirs(OPTIONS.work)
        cls.programs = packaged_programs.unpack(OPTIONS.packages, os.path.join(OPTIONS.work, "unpacked"))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(OPTIONS.work, ignore_errors=True)

    def test_packaged_programs_draw_the_golden_pictures(self):
        self.assertEqual(packaged_programs.golden_differences(OPTIONS.source, self.programs, OPTIONS.work), (9, []))

    def test_moving_one_object_changes_a_picture(self):
        folder = os.path.join(OPTIONS.work, "moved")
        os.makedirs(folder)
        with packaged_programs.daemon(self.programs, folder) as address:
            artist = golden_pictures.Artist(os.path.join(self.programs, "locus"), address)
            artist.make_scenes()
            view = ("city", ["--eye", "-20,-70,12", "--look-at", "10,0,6", "--fov", "60"], os.path.join(folder, "view.png"))
            before, again = artist.hashes(*view), artist.hashes(*view)
            artist.run("move", "city", "--id", "1000", "--to", "5,-10,10")
            after = artist.hashes(*view)
        self.assertEqual(before, again)
        self.assertNotEqual(before, after)


def options():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("packages", "source", "work"):
        parser.add_argument("--" + name, required=True, type=os.path.abspath)
    return parser.parse_args()


if __name__ == "__main__":
    OPTIONS = options()
    if not glob.glob(os.path.join(OPTIONS.packages, "*.deb")):
        print("SKIPPED: nothing was packed: ./deploy/packages.sh package docs")
        sys.exit(debian_root.SKIPPED)
    unittest.main(argv=sys.argv[:1], verbosity=2)
