"""Tests of the lidar example: its answers equal those of the command line, and the program runs."""
import array
import math
import os
import subprocess
import sys

import locus
from support import WAIT_SECONDS, DaemonTest, example_path, listed, load_example, number

EXAMPLE = example_path("lidar_sweep")
RAYS = 8192


def text(vector):
    return ",".join(repr(value) for value in vector)


class LidarSweepTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.example = load_example(EXAMPLE)

    def test_directions_are_unit_vectors_all_around(self):
        column = self.example.directions(RAYS)
        self.assertEqual(len(column), 3 * RAYS)
        vectors = [column[begin:begin + 3] for begin in range(0, len(column), 3)]
        self.assertTrue(all(abs(math.hypot(*vector) - 1) < 1e-6 for vector in vectors))
        self.assertEqual({(x > 0, y > 0) for x, y, _ in vectors}, {(a, b) for a in (True, False) for b in (True, False)})

    def test_answers_of_a_sweep_equal_those_of_the_command_line(self):
        scene = "street"
        built = self.example.build_street(self.client, scene)
        directed = self.example.directions(RAYS)
        hits, cost = self.example.measured_sweep(self.client, scene, 9, directed, built)
        self.assertTrue(all(part > 0 for part in cost))
        start = text(self.example.position(9))
        options = [f"--dir={text(directed[begin:begin + 3])}" for begin in range(0, 3 * RAYS, 3)]
        options += [f"--from={start}", f"--rotation={text(self.example.orientation(9))}"]
        report = self.command_line("query", "ray", scene, *options, f"--t-max={self.example.RANGE}", "--columns", "triangle")
        shown = [(number(row["id"]) if row["hit"] else 0, row["t"] if row["hit"] else math.inf) for row in report["hits"]]
        self.assertEqual([one for one, _ in shown], listed(hits.ids))
        self.assertEqual(array.array("f", [t for _, t in shown]).tolist(), listed(hits.t))
        self.assertGreater(len(set(listed(hits.ids))), 10)
        self.assertIn(0, listed(hits.ids))

    def test_a_rotated_pattern_hits_what_rotated_directions_hit(self):
        built = self.example.build_street(self.client, "turned-street")
        directed = self.example.directions(RAYS)
        hits, _ = self.example.measured_sweep(self.client, "turned-street", 9, directed, built)
        _, _, z, w = self.example.orientation(9)
        cosine, sine = w * w - z * z, 2 * w * z
        rotated = array.array("f")
        for begin in range(0, 3 * RAYS, 3):
            x, y, up = directed[begin:begin + 3]
            rotated.extend((cosine * x - sine * y, sine * x + cosine * y, up))
        batch = locus.QueryBatch().rays([0, 0, 0], rotated, t_max=self.example.RANGE,
                                        block=locus.Block(frame=self.example.position(9)))
        wanted = self.client.query("turned-street", batch).blocks[0]
        near = sum(abs(got - exact) <= 1e-3 * exact or got == exact for got, exact in zip(listed(hits.t), listed(wanted.t)))
        self.assertGreater(near, 0.99 * RAYS)  # rays along an edge may hit either side of it
        straight = self.client.query("turned-street", locus.QueryBatch().rays(
            [0, 0, 0], directed, t_max=self.example.RANGE, block=locus.Block(frame=self.example.position(9)))).blocks[0]
        self.assertNotEqual(listed(straight.t), listed(hits.t))

    def test_the_largest_sweep_is_answered_whole(self):
        built = self.example.build_street(self.client, "wide-street")
        most = int(self.client.server().limits["rays"].value)
        self.assertEqual(most, 262_144)
        hits, _ = self.example.measured_sweep(self.client, "wide-street", 3, self.example.directions(most), built)
        self.assertEqual((len(hits.t), len(hits.ids), listed(hits.truncated)), (most, most, []))

    def test_the_program_prints_the_cost_of_a_ray_and_deletes_its_scene(self):
        command = [sys.executable, "-B", EXAMPLE, "--address", self.daemon.address, "--rays", "256", "--sweeps", "3"]
        done = subprocess.run(command, env=dict(os.environ, PYTHONPATH=os.environ["LOCUS_PACKAGE"]), capture_output=True,
                              text=True, timeout=WAIT_SECONDS)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"(?m)^client time, ns a ray +\d+\.\d\d$")
        self.assertRegex(done.stdout, r"(?m)^rays a sweep +256$")
        self.assertNotIn("lidar-street", [scene.name for scene in self.client.scenes()])

    def test_the_report_divides_medians_by_rays(self):
        costs = [self.example.Cost(1000, 5000, 3000), self.example.Cost(2000, 5000, 3000), self.example.Cost(9000, 6000, 9000)]
        lines = dict(line.rsplit(maxsplit=1) for line in self.example.report(costs, 100, 42))
        self.assertEqual((lines["encode, ns a ray"], lines["decode, ns a ray"]), ("20.00", "30.00"))
        self.assertEqual((lines["client time, ns a ray"], lines["wait, ns a ray"], lines["hits"]), ("50.00", "50.0", "42"))
        self.assertIn("sweeps", lines)

    def test_columns_are_numpy_arrays_only_if_numpy_is_installed(self):
        lines = "\n".join(self.example.report([self.example.Cost(1, 1, 1)], 1, 0))
        self.assertIn("numpy" if locus.columns.numpy else "array.array", lines)
