"""Tests of the hit boxes: a rewound shot names the part that it hits, in the pose of its tick."""
import os
import subprocess
import sys

from support import WAIT_SECONDS, DaemonTest, example_path, load_example

EXAMPLE = example_path("hit_boxes")


class HitBoxesTest(DaemonTest):
    def test_a_rewound_shot_hits_the_part_that_was_there_then(self):
        example = load_example(EXAMPLE)
        self.assertEqual(len(example.PARTS), 16)
        everything = example.BODY | example.HEAD
        seen = example.play(self.client)
        for player in range(0, example.PLAYERS, 7):
            standing, ducking = (9, 21), (12, 19)
            for tick in standing:
                shots = [(player, tick, 1.65, everything), (player, tick, 1.65, example.BODY), (player, tick, 1.25, everything)]
                self.assertEqual(example.shoot(self.client, seen, shots)[:2], ["head", "nothing"], (player, tick))
            for tick in ducking:
                shots = [(player, tick, 1.65, everything), (player, tick, 1.25, everything), (player, tick, 1.25, example.BODY)]
                self.assertEqual(example.shoot(self.client, seen, shots), ["nothing", "head", "nothing"], (player, tick))
        self.client.delete_scene(example.SCENE)

    def test_the_program_ends(self):
        done = subprocess.run([sys.executable, "-B", EXAMPLE, self.daemon.address],
                              env=dict(os.environ, PYTHONPATH=os.environ["LOCUS_PACKAGE"]), capture_output=True, text=True,
                              timeout=WAIT_SECONDS)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("a shot at player 27, tick 9, height 1.65: head", done.stdout)
        self.assertIn("a shot at player 27, tick 12, height 1.65: nothing", done.stdout)
        self.assertIn("a shot at player 27, tick 12, height 1.25: head", done.stdout)
