"""Tests of areas of interest: anchored queries find the objects near each player."""
import math
import os
import random
import subprocess
import sys

from support import WAIT_SECONDS, DaemonTest, example_path, load_example

EXAMPLE = example_path("areas_of_interest")


class AreasOfInterestTest(DaemonTest):
    def test_areas_of_interest_equal_those_computed_directly(self):
        example = load_example(EXAMPLE)
        around, _ = example.interests(self.client, example.make_scene(self.client))
        numbers = random.Random(11)
        places = [[numbers.uniform(-100, 100) for _ in range(3)] for _ in range(example.PLAYERS + example.THINGS)]
        for player, found in enumerate(around):
            near = [1000 + i for i in range(example.THINGS)
                    if math.dist(places[player], places[example.PLAYERS + i]) <= example.RADIUS + 0.5]
            self.assertEqual(sorted(found), near)
        self.assertTrue(any(around))
        self.client.delete_scene(example.SCENE)

    def test_the_program_ends(self):
        done = subprocess.run([sys.executable, "-B", EXAMPLE, self.daemon.address],
                              env=dict(os.environ, PYTHONPATH=os.environ["LOCUS_PACKAGE"]), capture_output=True, text=True,
                              timeout=WAIT_SECONDS)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("player 5:", done.stdout)
