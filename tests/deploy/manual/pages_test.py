"""Formats the built manual pages and expects no warning: pages_test.py FOLDER. Needs groff and mandoc."""

import glob
import os
import re
import subprocess
import sys
import unittest

FOLDER = sys.argv[1]
# The page has no date, so that equal sources give equal bytes. Accept the warning about it.
ACCEPTED = re.compile(r'missing date')


def complaints(*command):
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    return [line for line in (done.stdout + done.stderr).splitlines() if line and not ACCEPTED.search(line)]


class PagesTest(unittest.TestCase):
    def setUp(self):
        self.pages = sorted(glob.glob(os.path.join(FOLDER, "*.[18]")))

    def test_there_are_pages(self):
        self.assertGreater(len(self.pages), 20)

    def test_groff_formats_them_without_a_warning(self):
        self.assertEqual(complaints("groff", "-man", "-Tutf8", "-ww", "-z", *self.pages), [])

    def test_mandoc_formats_them_without_a_warning(self):
        self.assertEqual(complaints("mandoc", "-Tlint", "-Wwarning", *self.pages), [])

    def test_a_bad_page_is_complained_of(self):
        bad = "/dev/stdin"
        for command in (["groff", "-man", "-Tutf8", "-ww", "-z", bad], ["mandoc", "-Tlint", "-Wwarning", bad]):
            done = subprocess.run(command, input=".TH A 1\n.SH NAME\n.nosuchmacro\n\\fQx", capture_output=True, text=True,
                                  timeout=60, check=False)
            self.assertRegex(done.stdout + done.stderr, "nosuchmacro|unknown macro")

    def test_an_example_reads_as_it_is_typed(self):
        page = os.path.join(FOLDER, "locus-query-ray.1")
        shown = subprocess.run(["mandoc", "-Tascii", page], capture_output=True, text=True, timeout=60, check=True).stdout
        self.assertIn("locus query ray arena --from 0,1,0 --dir 0,0,-1", re.sub(".\b", "", shown))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
