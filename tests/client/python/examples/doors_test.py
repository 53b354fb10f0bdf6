"""Tests of the doors: a rewound shot is stopped by the door that was closed at its time."""
import os
import subprocess
import sys

from support import WAIT_SECONDS, DaemonTest, example_path, load_example

EXAMPLE = example_path("doors")


class DoorsTest(DaemonTest):
    def test_a_rewound_shot_is_stopped_by_the_door_that_was_closed_then(self):
        example = load_example(EXAMPLE)
        example.make_scene(self.client)
        ack = example.play(self.client)
        # The door covers x = 1 until it is open by half, in the middle of its way.
        closed, open_ = example.DOOR, example.PLAYER
        times = [(2, 0.0), (4, 0.9), (5, 0.1), (9, 0.0), (12, 0.9), (13, 0.1), (16, 0.0)]
        hits = example.shoot(self.client, ack, times)
        self.client.delete_scene(example.SCENE)
        self.client.delete_mesh(example.MESH)
        self.assertEqual(hits, [closed, closed, open_, open_, open_, closed, closed])

    def test_the_program_ends(self):
        done = subprocess.run([sys.executable, "-B", EXAMPLE, self.daemon.address],
                              env=dict(os.environ, PYTHONPATH=os.environ["LOCUS_PACKAGE"]), capture_output=True, text=True,
                              timeout=WAIT_SECONDS)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("a shot at tick 2.0: stopped by the door", done.stdout)
        self.assertIn("a shot at tick 9.0: hits the player", done.stdout)
