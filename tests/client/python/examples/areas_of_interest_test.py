"""Tests of areas of interest: anchored queries find the objects near each player."""
import importlib.util
import math
import os
import random
import subprocess
import sys

from support import WAIT_SECONDS, DaemonTest

EXAMPLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../../client/python/examples/areas_of_interest.py")


def loaded():
    spec = importlib.util.spec_from_file_location("areas_of_interest", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class AreasOfInterestTest(DaemonTest):
    def test_areas_of_interest_equal_those_computed_directly(self):
        example = loaded()
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
