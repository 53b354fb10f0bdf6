"""Tests of the wallhack filter: a player behind a wall is not sent."""
import os
import subprocess
import sys

from support import WAIT_SECONDS, DaemonTest, example_path, load_example

EXAMPLE = example_path("anti_wallhack")


class AntiWallhackTest(DaemonTest):
    def test_a_player_behind_a_wall_is_not_sent(self):
        example = load_example(EXAMPLE)
        positions = [[0.0, 0.0, 10.0], [2.0, 0.0, 11.0], [0.0, 0.0, -10.0]] + [[40.0 + 9 * i, 0.0, 40.0] for i in range(5)]
        known = example.visible(self.client, example.make_scene(self.client, positions), positions)
        self.client.delete_scene(example.SCENE)
        self.assertIn(1, known[0])
        self.assertIn(0, known[1])
        self.assertNotIn(2, known[0])
        self.assertNotIn(0, known[2])

    def test_the_program_ends(self):
        done = subprocess.run([sys.executable, "-B", EXAMPLE, self.daemon.address],
                              env=dict(os.environ, PYTHONPATH=os.environ["LOCUS_PACKAGE"]), capture_output=True, text=True,
                              timeout=WAIT_SECONDS)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("player 7 is sent", done.stdout)
