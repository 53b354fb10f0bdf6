"""Checks the systemd unit by systemd's own tool, without a running systemd:

    python3 unit_test.py DEPLOY_DIRECTORY

Exits 77, which counts as skipped, if this machine has no systemd-analyze.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

DEPLOY = sys.argv[1]
UNIT = os.path.join(DEPLOY, "locusd.service")
SKIPPED = 77
# Maximum exposure in tenths of systemd's scale, on which 0.0 is no exposure and 10.0 is complete exposure.
MAX_EXPOSURE = 11


def analyze(*arguments):
    done = subprocess.run(["systemd-analyze", *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=60, check=False)
    return done.returncode, done.stdout


class UnitTest(unittest.TestCase):
    def test_its_exposure_is_small(self):
        code, output = analyze("security", "--offline=true", f"--threshold={MAX_EXPOSURE}", UNIT)
        self.assertEqual(code, 0, output)
        self.assertIn("Overall exposure level", output)

    def test_it_is_correct_also_with_the_credentials_of_its_comment(self):
        with open(UNIT, encoding="utf-8") as file:
            unit = file.read().replace("/usr/local/bin/locusd", "/bin/true")
        credentials = "\n".join(re.findall(r"^#   (\S+=.+|\[Service\])$", unit, re.MULTILINE))
        self.assertIn("LoadCredential=server.key:", credentials)
        with tempfile.TemporaryDirectory() as folder:
            for text in (unit, unit.replace("[Install]", credentials + "\n[Install]")):
                path = os.path.join(folder, "locusd.service")
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
                code, output = analyze("verify", "--man=no", path)
                self.assertEqual((code, output), (0, ""))


if __name__ == "__main__":
    if shutil.which("systemd-analyze") is None:
        print("SKIPPED: this machine has no systemd-analyze (package systemd)")
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1])
