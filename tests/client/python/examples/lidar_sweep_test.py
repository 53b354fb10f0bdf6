"""Tests of the lidar example: its answers equal those of the command line, and the program runs."""
import array
import importlib.util
import math
import os
import subprocess
import sys

import locus
from support import WAIT_SECONDS, DaemonTest, listed, number

EXAMPLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../../client/python/examples/lidar_sweep.py")
RAYS = 8192


def loaded():
    spec = importlib.util.spec_from_file_location("lidar_sweep", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def text(vector):
    return ",".join(repr(value) for value in vector)


class LidarSweepTest(DaemonTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.example = loaded()

    def test_directions_are_unit_vectors_all_around(self):
        column = self.example.directions(RAYS)
        self.assertEqual(len(column), 3 * RAYS)
        vectors = [column[begin:begin + 3] for begin in range(0, len(column), 3)]
        self.assertTrue(all(abs(math.hypot(*vector) - 1) < 1e-6 for vector in vectors))
        self.assertEqual({(x > 0, y > 0) for x, y, _ in vectors}, {(a, b) for a in (True, False) for b in (True, False)})

    def test_answers_of_a_sweep_equal_those_of_the_command_line(self):
        scene = "street"
        built = self.example.build_street(self.client, scene)
        zeros, directed = array.array("f", bytes(12 * RAYS)), self.example.directions(RAYS)
        hits, cost = self.example.measured_sweep(self.client, scene, 9, zeros, directed, built)
        self.assertTrue(all(part > 0 for part in cost))
        start = text(self.example.position(9))
        options = [word for begin in range(0, 3 * RAYS, 3)
                   for word in (f"--from={start}", f"--dir={text(directed[begin:begin + 3])}")]
        report = self.command_line("query", "ray", scene, *options, f"--t-max={self.example.RANGE}", "--columns", "triangle")
        shown = [(number(row["id"]) if row["hit"] else 0, row["t"] if row["hit"] else math.inf) for row in report["hits"]]
        self.assertEqual([one for one, _ in shown], listed(hits.ids))
        self.assertEqual(array.array("f", [t for _, t in shown]).tolist(), listed(hits.t))
        self.assertGreater(len(set(listed(hits.ids))), 10)
        self.assertIn(0, listed(hits.ids))

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
