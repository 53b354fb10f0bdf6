"""Tests of a character's step: it slides along walls and stays above the floor."""
import math
import os
import subprocess
import sys

from support import WAIT_SECONDS, DaemonTest, example_path, load_example

EXAMPLE = example_path("character_step")


class CharacterStepTest(DaemonTest):
    def test_a_character_slides_along_the_wall_and_stays_above_the_floor(self):
        example = load_example(EXAMPLE)
        example.make_scene(self.client)
        center = [0.0, example.RADIUS + example.HALF, 0.0]
        for _ in range(8):
            center = example.step(self.client, center, [0.6, -0.1, 0.2])
        self.client.delete_scene(example.SCENE)
        self.assertLessEqual(center[0], 3.0 - example.RADIUS + 0.01)
        self.assertGreaterEqual(center[1], example.RADIUS + example.HALF - 0.01)
        self.assertTrue(math.isclose(center[2], 1.6, abs_tol=0.05), center)

    def test_the_program_ends(self):
        done = subprocess.run([sys.executable, "-B", EXAMPLE, self.daemon.address],
                              env=dict(os.environ, PYTHONPATH=os.environ["LOCUS_PACKAGE"]), capture_output=True, text=True,
                              timeout=WAIT_SECONDS)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("tick 7:", done.stdout)
