"""Tests of the game example: every tick makes one revision, which that tick's queries see."""
import math
import os
import subprocess
import sys

import locus
from support import WAIT_SECONDS, DaemonTest, example_path, listed, load_example

EXAMPLE = example_path("game_tick")
PLAYERS, TICKS, RATE = 12, 10, 200.0


class GameTickTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.example = load_example(EXAMPLE)

    def test_every_tick_makes_one_revision(self):
        ticks = self.example.run(self.client, self.scene, PLAYERS, TICKS, RATE)
        self.assertEqual([tick.revision for tick in ticks], list(range(2, TICKS + 2)))
        self.assertEqual(self.client.scene(self.scene).tick, TICKS)

    def test_players_are_at_the_positions_of_the_last_tick(self):
        self.example.run(self.client, self.scene, PLAYERS, TICKS, RATE)
        ids = list(range(self.example.FIRST, self.example.FIRST + PLAYERS))
        (block,) = self.ask(locus.QueryBatch().lookup(ids))
        self.assertEqual(listed(block.positions), self.example.positions(PLAYERS, TICKS).tolist())

    def test_neighbours_in_a_tick_equal_those_computed_directly(self):
        game = self.example.Game(self.client, self.scene, PLAYERS)
        tick = game.step(1)
        game.close()
        column = self.example.positions(PLAYERS, 1)
        places = [column[begin:begin + 3] for begin in range(0, len(column), 3)]
        near = sum(1 for one in places for other in places
                   if one is not other and math.dist(one, other) <= self.example.REACH + self.example.RADIUS)
        self.assertEqual(tick.in_reach, near)
        self.assertLessEqual(tick.seen, PLAYERS)
        self.assertGreater(tick.seen, 0)

    def test_the_program_ends_and_deletes_its_scene(self):
        command = [sys.executable, "-B", EXAMPLE, "--address", self.daemon.address, "--players", str(PLAYERS),
                   "--ticks", str(TICKS), "--rate", str(RATE)]
        done = subprocess.run(command, env=dict(os.environ, PYTHONPATH=os.environ["LOCUS_PACKAGE"]), capture_output=True,
                              text=True, timeout=WAIT_SECONDS)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(f"{TICKS} of {PLAYERS} players, the last at revision {TICKS + 1}", done.stdout)
        self.assertNotIn("game-ring", [scene.name for scene in self.client.scenes()])
