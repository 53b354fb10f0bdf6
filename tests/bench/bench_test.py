"""Tests of the program locus-bench: python3 bench_test.py PROGRAM PEER..., with the peers built into PROGRAM."""

import glob
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from xml.etree import ElementTree

PROGRAM = os.path.abspath(sys.argv[1])
PEERS = set(sys.argv[2:])
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
FIELDS = {"suite": str, "case": str, "metric": str, "ours": float, "peer": float, "peer_name": str, "ratio": float,
          "spread": float, "results_hash": str}
MESHES = ("city-2k", "blob-5k")
RAYS = {"embree": {"embree_intersect1", "embree_robust", "embree_intersect1m"}, "bullet": {"bullet"}, "cgal": {"cgal"}}
ANY = {**RAYS, "embree": {"embree_occluded1", "embree_robust"}}
CAMERA = {**RAYS, "embree": RAYS["embree"] | {"embree_intersect8", "embree_intersect16"}}
BALLS = {"embree": {"embree_point_query"}, "bullet": {"bullet"}, "boost": {"boost_rtree"}}
BOXES = {**BALLS, "embree": {"embree_point_query", "embree_collide"}, "cgal": {"cgal"}}
CASES = {"ray/incoherent/first": RAYS, "ray/incoherent/any": ANY, "ray/short/first": RAYS, "ray/short/any": ANY,
         "ray/camera/first": CAMERA, "ray/incoherent/all": {"embree": {"embree_robust"}}, "ball/0.5": BALLS,
         "ball/2": BALLS, "ball/10": BALLS, "box/0.5": BOXES, "box/2": BOXES, "box/10": BOXES,
         "build": {"embree": {"embree_medium"}}, "memory": {"embree": {"embree_medium"}}}

# Peers of the suite dynamic, by library. The peers in "ours" need no library.
DYNAMIC_PEERS = {"bullet": {"bullet"}, "boost": {"boost_rtree"}, "nanoflann": {"nanoflann"},
                 "ours": {"flat_hash_map", "sorted_rebuild"}}
ONE_SIZE_ONLY = {"boost_rtree", "nanoflann", "flat_hash_map"}
NOT_ASKED = {"box": {"nanoflann"}, "ray": {"nanoflann", "boost_rtree"}, "nearest": {"bullet", "flat_hash_map"},
             "reinsert": {"nanoflann", "sorted_rebuild"}}
HUBS = ("hub20", "hub60", "hub200")
KINDS = ("uniform", "clustered", "far", "onecell", "border", "giant", "mixed", *HUBS)

# Expected cells of the suite serving: (case, peer).
SERVING = {(f"rays/{cost}/{size}", "in_process") for cost in ("90ns", "270ns") for size in (1024, 8192)}
SERVING |= {("scan/1024", "whole_query"), ("sight/100x100x3", "any_rays")}
SERVING |= {(f"step/shooter_{form}", "two_calls") for form in ("unary", "stream")}
SERVING |= {(f"one_stream/{size}", "two_streams") for size in (1024, 8192)}
SERVING |= {(f"{case}/{size}", "raw_tcp") for size in (1024, 8192) for case in ("echo", "empty")}
SERVING |= {(f"{case}/{size}", peer) for size in (256, 4096)
            for case, peer in (("moves", "raw_tcp"), ("moves_applied", "in_process"))}
SERVING |= {("mixed_p50/16", "idle"), ("mixed_p99/16", "idle"), ("overload/10x/as_told", "peak"),
            ("overload/10x/at_once", "peak"), ("silent_reader/1", "idle"), ("silent_reader/8", "idle"),
            ("churn/50", "idle"), ("deadline/1ms", "whole_job"), ("cancel/1000", "whole_job")}
SERVING |= {("durable/256", "memory_acks"), ("durable_queries/256", "beside_memory_acks"), ("restart/1M", "bar")}
SERVING |= {(f"tls/{case}", "plain") for case in ("8192", "16", "handshake", "mutual_handshake")}
LOG = {(f"commit/{size}", peer) for size in (16, 256, 4096) for peer in ("append", "overwrite")}
LOG |= {(f"writers/8/{size}", "one_writer") for size in (16, 256, 4096)}
LOG |= {("mesh/2M", "built")}
CLUSTER = {(f"append/{scenes}/{moves}", "bare") for scenes in (1, 8) for moves in (16, 256, 4096)}
CLUSTER |= {("scenes/128/16", "8_scenes"), ("quorum/256", "local_disk")}
HAS_POSTGRES = os.access("/usr/lib/postgresql/15/bin/initdb", os.X_OK)
REDIS = {("moves/10k", "redis"), ("ball/10k", "redis")}
HAS_REDIS = any(shutil.which(name) for name in ("redis-server", "redis-check-rdb"))
CHANGEABLE_STRUCTURES = {"hash_grid", "grid", "grid_morton", "kd_tree", "kd_tree_at_node", "octree", "octree_at_node",
                         "bsp_tree"}
STRUCTURES = CHANGEABLE_STRUCTURES | {"bvh", "sphere_tree"}
TUNING = {(f"{case}/{scene}/1k/from_chosen", peer) for case, peer in (("named", "best_of_sweep"), ("promise", "promised"))
          for scene in ("uniform", "hub60", "mixed", "balls100", "level")}
STRUCTURE_QUERIES = ("ray", "ray_short", "any", "ball", "box", "nearest")
STRUCTURE_SCENES = {"uniform": ("1e3", "1e4"), **{name: ("1e3",) for name in ("hub", "city1", "city100", "giant")}}


def run(*arguments, **environment):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=600,
                          env={**os.environ, **environment})


def drawn_parts(picture):
    """Returns a picture without what depends on the version of gnuplot."""
    return re.sub(r"Produced by GNUPLOT[^>]*", "", picture)


def expected_cells():
    cells = {("threads2/" + mesh, "one_thread") for mesh in MESHES}
    for mesh in MESHES:
        for case, by_library in CASES.items():
            for library in PEERS & set(by_library):
                cells |= {(f"{case}/{mesh}", name) for name in by_library[library]}
    return cells


def expected_dynamic_cells():
    peers = set().union(*(DYNAMIC_PEERS[library] for library in (PEERS | {"ours"}) & set(DYNAMIC_PEERS)))
    cells = {("growth/ball", "10k"), ("concurrent_moves/3readers/10k", "paced"),
             ("concurrent_moves/3readers_below/10k", "paced")}
    cells |= {(f"concurrent_{share}/1reader/10k", peer) for share in ("p50", "p99", "p999")
              for peer in ("no_writer", "spinning")}
    cells |= {("unpaced/1reader/10k" + batch, "no_reader") for batch in ("", "/batch100", "/batch10000")}
    cells |= {(f"rewind/{age}/10k", "now") for age in ("1tick", "10ticks", "30ticks")}
    cells |= {(f"country/{case}/{hub}/10k", "uniform") for case in ("ball", "box", "ray", "nearest", "memory")
              for hub in HUBS}
    cells |= {(f"instances/{change}_{share}/10k", "place_all") for change in ("move", "place", "remove")
              for share in ("one", "1%")}
    cells |= {("doors/1reader", "required")}
    cells |= {(f"compounds/{case}/10k", "balls") for case in ("move", "turn", "pose")}
    cells |= {(f"compounds/{case}/10k", "parts") for case in ("ray", "ball")}
    for kind in KINDS:
        for case in ("move", "ball", "ball_batch", "box", "box_batch", "ray", "ray_batch", "nearest", "nearest_batch",
                     "insert", "reinsert", "memory"):
            left_out = NOT_ASKED.get(case.replace("_batch", ""), set()) | (
                ONE_SIZE_ONLY if kind in ("giant", "mixed") else set())
            cells |= {(f"{case}/{kind}/10k", peer) for peer in peers - left_out}
    return cells


def expected_structure_cells():
    cells = set()
    for structure in STRUCTURES:
        changes = ("insert", "remove") if structure in CHANGEABLE_STRUCTURES else ()
        figures = (*STRUCTURE_QUERIES, *("work/" + query for query in STRUCTURE_QUERIES), "build", "memory", *changes)
        cells |= {(f"{figure}/{structure}/{scene}/{count}", "list") for figure in figures
                  for scene, counts in STRUCTURE_SCENES.items() for count in counts}
        cells |= {(f"exponent/{query}/{structure}/uniform", "list") for query in STRUCTURE_QUERIES}
        cells.add((f"exponent/memory/{structure}/uniform", "linear"))
    return cells | {(f"exponent/{query}/list/uniform", "linear") for query in STRUCTURE_QUERIES}


class BenchTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.answers, cls.lists = [], []
        for number in range(2):
            path = os.path.join(cls.folder.name, f"{number}.json")
            cls.answers.append(run("static", "--quick", "--json", path))
            with open(path, encoding="utf-8") as file:
                cls.lists.append(json.load(file))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def test_everything_agrees(self):
        for answer in self.answers:
            self.assertEqual(answer.returncode, 0, answer.stdout + answer.stderr)
            self.assertNotIn("DISAGREEMENT", answer.stdout)

    def test_every_expected_cell_is_there_once(self):
        found = [(cell["case"], cell["peer_name"]) for cell in self.lists[0]]
        self.assertEqual(len(found), len(set(found)))
        self.assertEqual(set(found), expected_cells())

    def test_cells_have_every_field_and_no_other(self):
        for cell in self.lists[0]:
            self.assertEqual({name: type(value) for name, value in cell.items()}, FIELDS)
            self.assertEqual(cell["suite"], "static")

    def test_figures_are_finite_and_positive(self):
        for cell in self.lists[0]:
            for field in ("ours", "peer", "ratio"):
                self.assertTrue(math.isfinite(cell[field]) and cell[field] > 0, cell)
            self.assertTrue(math.isfinite(cell["spread"]) and cell["spread"] >= 0, cell)

    def test_two_runs_have_the_same_results(self):
        first, second = ({(cell["case"], cell["peer_name"]): cell["results_hash"] for cell in cells} for cells in self.lists)
        self.assertEqual(first, second)
        for value in first.values():
            self.assertRegex(value, "^[0-9a-f]{16}$")

    def test_missing_peers_are_reported(self):
        said = self.answers[0].stdout.count("a peer is missing")
        self.assertEqual(said, 4 - len(PEERS & {"embree", "bullet", "boost", "cgal"}))

    def test_a_filter_leaves_the_other_cases_out(self):
        answer = run("static", "--quick", "--filter", "^threads2/", "--mesh", "city:500")
        self.assertEqual(answer.returncode, 0)
        self.assertIn("threads2/city-500", answer.stdout)
        self.assertNotIn("ray/", answer.stdout)

    def test_wrong_use_is_status_2(self):
        for arguments in ((), ("unknown",), ("static", "--rounds", "2"), ("static", "--filter", "("), ("static", "--nothing"),
                          ("--from", "a.json"), ("static", "--from", "a.json", "--plot", "plots")):
            answer = run(*arguments)
            self.assertEqual(answer.returncode, 2, arguments)
            self.assertNotEqual(answer.stderr, "", arguments)

    def test_a_missing_gnuplot_is_status_1_and_its_package_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            answer = run("static", "--quick", "--plot", folder, PATH=folder)
            self.assertEqual(answer.returncode, 1)
            self.assertIn("gnuplot-nox", answer.stderr)
            self.assertEqual(answer.stdout, "")
            self.assertEqual(os.listdir(folder), [])

    @unittest.skipUnless(shutil.which("gnuplot"), "gnuplot is missing: ./deploy/packages.sh bench")
    def test_pictures_of_a_run_are_drawn_again_from_its_record(self):
        with tempfile.TemporaryDirectory() as folder:
            first, second = (os.path.join(folder, name) for name in ("first", "second"))
            ran = run("static", "--quick", "--filter", "^ball/2/", "--mesh", "city:500", "--plot", first)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            self.assertEqual(set(os.listdir(first)), {"static.json", "static-ratios.svg"})
            with open(os.path.join(first, "static.json"), encoding="utf-8") as file:
                record = json.load(file)
            self.assertEqual(record["arguments"], "static --quick --filter ^ball/2/ --mesh city:500")
            self.assertRegex(record["date"], r"^\d{4}-\d\d-\d\d$")
            self.assertRegex(record["machine"], r", \d+ cores?$")
            self.assertEqual({cell["case"] for cell in record["cells"]}, {"ball/2/city-500"} if PEERS else set())
            drawn = run("--from", os.path.join(first, "static.json"), "--plot", second)
            self.assertEqual(drawn.returncode, 0, drawn.stderr)
            with open(os.path.join(first, "static-ratios.svg"), encoding="utf-8") as one, \
                    open(os.path.join(second, "static-ratios.svg"), encoding="utf-8") as other:
                picture = one.read()
                self.assertEqual(picture, other.read())
            texts = "".join(ElementTree.fromstring(picture).itertext())
            for word in ("ball/2/city-500", record["date"], record["machine"], *(cell["peer_name"] for cell in record["cells"])):
                self.assertIn(word, texts)

    @unittest.skipUnless(shutil.which("gnuplot"), "gnuplot is missing: ./deploy/packages.sh bench")
    def test_committed_pictures_are_those_of_the_committed_results(self):
        with tempfile.TemporaryDirectory() as folder:
            drawn = subprocess.run([os.path.join(ROOT, "deploy/docs/performance-results/draw.sh"), "--bench", PROGRAM, "--top",
                                    folder], capture_output=True, text=True, timeout=300)
            self.assertEqual(drawn.returncode, 0, drawn.stderr)
            pictures = [os.path.relpath(path, folder) for path in glob.glob(os.path.join(folder, "**/*.svg"), recursive=True)]
            self.assertIn("deploy/docs/pages/performance/sizing-ticks.svg", pictures)
            for path in pictures:
                with open(os.path.join(folder, path), encoding="utf-8") as one, \
                        open(os.path.join(ROOT, path), encoding="utf-8") as other:
                    self.assertEqual(drawn_parts(one.read()), drawn_parts(other.read()), path)

    def test_a_missing_mesh_is_status_1_and_named(self):
        answer = run("static", "--quick", "--mesh", "/no/such/level.obj")
        self.assertEqual(answer.returncode, 1)
        self.assertIn("/no/such/level.obj", answer.stderr)

    def test_help_has_examples(self):
        answer = run("--help")
        self.assertEqual(answer.returncode, 0)
        self.assertIn("locus-bench static --quick", answer.stdout)


class SuiteRun:
    """Makes one quick run of SUITE, whose cells must be those of expected()."""

    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "cells.json")
            cls.answer = run(cls.SUITE, "--quick", "--json", path)
            if not os.path.exists(path):
                raise AssertionError(f"{cls.SUITE} wrote no cells:\n{cls.answer.stdout}{cls.answer.stderr}")
            with open(path, encoding="utf-8") as file:
                cls.cells = json.load(file)

    def test_everything_agrees(self):
        self.assertEqual(self.answer.returncode, 0, self.answer.stdout + self.answer.stderr)
        self.assertNotIn("DISAGREEMENT", self.answer.stdout)

    def test_every_expected_cell_is_there_once(self):
        found = [(cell["case"], cell["peer_name"]) for cell in self.cells]
        self.assertEqual(len(found), len(set(found)))
        self.assertEqual(set(found), self.expected())

    def test_cells_have_every_field_and_figures_above_zero(self):
        for cell in self.cells:
            self.assertEqual({name: type(value) for name, value in cell.items()}, FIELDS)
            self.assertEqual(cell["suite"], self.SUITE)
            for field in ("ours", "peer", "ratio"):
                self.assertTrue(math.isfinite(cell[field]) and cell[field] > 0, cell)
            self.assertRegex(cell["results_hash"], "^[0-9a-f]{16}$")


class DynamicTest(SuiteRun, unittest.TestCase):
    SUITE = "dynamic"

    def expected(self):
        return expected_dynamic_cells()

    def test_missing_peers_are_reported(self):
        said = self.answer.stdout.count("a peer is missing")
        self.assertEqual(said, 3 - len(PEERS & {"bullet", "boost", "nanoflann"}))


class ServingTest(SuiteRun, unittest.TestCase):
    SUITE = "serving"

    def expected(self):
        return SERVING | (REDIS if HAS_REDIS else set())

    def test_a_missing_redis_is_reported(self):
        self.assertEqual("a peer is missing: redis" in self.answer.stdout, not HAS_REDIS)

    def test_the_required_ratio_is_noted_beside_the_measured_one(self):
        self.assertRegex(self.answer.stdout, r"note: rays/90ns/1024 beside in_process: .* required .*c/\(c\+45\)")


class LogTest(SuiteRun, unittest.TestCase):
    SUITE = "log"

    def expected(self):
        return LOG

    def test_the_required_ratio_is_noted_beside_the_measured_one(self):
        self.assertRegex(self.answer.stdout, r"note: commit/256 beside append: .* required 0\.800")


@unittest.skipUnless(HAS_POSTGRES, "PostgreSQL 15 is not installed: deploy/packages.sh test installs it")
class ClusterTest(SuiteRun, unittest.TestCase):
    SUITE = "cluster"

    def expected(self):
        return CLUSTER

    def test_the_required_ratios_are_noted_beside_the_measured_ones(self):
        for case, peer, bar in (("append/8/256", "bare", "0.800"), ("scenes/128/16", "8_scenes", "2.000"),
                                ("quorum/256", "local_disk", "0.700")):
            self.assertRegex(self.answer.stdout, rf"note: {case} beside {peer}: .* required {bar}")


class TuningTest(SuiteRun, unittest.TestCase):
    SUITE = "tuning"

    def expected(self):
        return TUNING

    def test_the_required_ratios_are_noted_beside_the_measured_ones(self):
        for case in ("named", "promise"):
            self.assertRegex(self.answer.stdout, rf"note: {case}/uniform/1k/from_chosen beside .* required 0\.833")

    def test_no_named_size_is_better_than_the_best_of_the_sweep(self):
        for cell in self.cells:
            if cell["case"].startswith("named/"):
                self.assertLessEqual(cell["ratio"], 1, cell)


class StructuresTest(SuiteRun, unittest.TestCase):
    SUITE = "structures"

    def expected(self):
        return expected_structure_cells()

    def test_cells_have_every_field_and_figures_above_zero(self):
        # An exponent may be zero or less: the work of a grid does not grow.
        for cell in self.cells:
            self.assertEqual({name: type(value) for name, value in cell.items()}, FIELDS)
            for field in ("peer", "ratio") if cell["metric"] == "exponent" else ("ours", "peer", "ratio"):
                self.assertTrue(math.isfinite(cell[field]) and cell[field] > 0, cell)

    def test_the_work_of_a_list_is_linear(self):
        for cell in self.cells:
            if cell["case"].startswith("exponent/ball/list/"):
                self.assertAlmostEqual(cell["ours"], 1, places=6)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
