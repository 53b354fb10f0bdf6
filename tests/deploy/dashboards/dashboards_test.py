"""Checks the files for Prometheus and Grafana against a real locusd:

    python3 dashboards_test.py DASHBOARDS_DIRECTORY BIN_DIRECTORY

Prometheus's own Python library reads /metrics. Dashboard and alerts may name only metrics that exist there, and README
must name all of locusd's own metrics.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

import yaml
from prometheus_client.parser import text_string_to_metric_families

DASHBOARDS, BIN = sys.argv[1], os.path.abspath(sys.argv[2])
START_SECONDS = 30
METRIC = re.compile(r"\b(?:locus|process)_[a-z_]+")
LABELLED = re.compile(r"\b((?:locus|process)_[a-z_]+)\{([^}]*)\}")
RUNBOOK = "../docs/pages/operations/alerts.md"
RUNBOOK_URL = "file:///usr/share/doc/locus-doc/html/operations/alerts.html"
# Metrics that Prometheus itself provides.
KNOWN_ELSEWHERE = {"up"}


def read(name):
    with open(os.path.join(DASHBOARDS, name), encoding="utf-8") as file:
        return file.read()


def metrics_of_a_cluster():
    """Returns the names of the metrics that only a member of a cluster has, as README lists them.
    tests/e2e/cli/cluster_command_test.cc compares them with a cluster.
    """
    rows = [line.split("|") for line in read("README.md").split("\n") if line.startswith("| `")]
    names = {name for row in rows if row[-2].strip().startswith("in a cluster: ")
             for name in re.findall(r"`(locus_\w+)`", row[1])}
    return names | {name + part for name in names if name.endswith("_seconds") for part in ("_bucket", "_sum", "_count")}


def wait_for(path, daemon):
    deadline = time.monotonic() + START_SECONDS
    while not os.path.exists(path):
        if daemon.poll() is not None or time.monotonic() > deadline:
            raise RuntimeError("locusd did not start")
        time.sleep(0.05)
    with open(path, encoding="utf-8") as file:
        return "127.0.0.1:" + file.read().strip()


class DashboardsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        port_file, http_file = (os.path.join(cls.folder.name, name) for name in ("port", "http"))
        cls.daemon = subprocess.Popen(
            [os.path.join(BIN, "locusd"), "--listen", "127.0.0.1:0", "--port-file", port_file,
             "--http-listen", "127.0.0.1:0", "--http-port-file", http_file],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        cls.address = wait_for(port_file, cls.daemon)
        cls.http = wait_for(http_file, cls.daemon)
        for line in (["scene", "create", "arena", "--history-ticks", "10"],
                     ["generate", "city", "--triangles", "600", "--seed", "1", "--scene", "arena"],
                     ["insert", "arena", "ball", "--id", "7", "--at", "0,0,30", "--radius", "0.5"],
                     ["query", "ray", "arena", "--from", "0,0,100", "--dir", "0,0,-1"],
                     ["query", "ray", "arena", "--from", "9,9,100", "--dir", "0,0,-1"],
                     ["query", "ball", "arena", "--at", "0,0,0", "--radius", "5"]):
            cls.locus(*line)
        cls.locus("query", "ray", "nowhere", "--from", "0,0,1", "--dir", "0,0,1", code=5)
        with urllib.request.urlopen(f"http://{cls.http}/metrics", timeout=START_SECONDS) as page:
            cls.text = page.read().decode()
        cls.families = {family.name: family for family in text_string_to_metric_families(cls.text)}
        cls.samples = [sample for family in cls.families.values() for sample in family.samples]

    @classmethod
    def tearDownClass(cls):
        cls.daemon.terminate()
        cls.daemon.wait(START_SECONDS)
        cls.folder.cleanup()

    @classmethod
    def locus(cls, *arguments, code=0):
        done = subprocess.run([os.path.join(BIN, "locus"), "--address", cls.address, *arguments],
                              capture_output=True, text=True, check=False)
        if done.returncode != code:
            raise RuntimeError(f"locus {arguments}: {done.stderr}")
        return done.stdout

    def value(self, name, **labels):
        found = [sample.value for sample in self.samples if sample.name == name and labels.items() <= sample.labels.items()]
        self.assertEqual(len(found), 1, (name, labels))
        return found[0]

    def names(self):
        return {sample.name for sample in self.samples} | set(self.families) | metrics_of_a_cluster()

    def test_calls_of_the_command_line_are_counted(self):
        self.assertEqual(self.value("locus_queries_total", kind="ray"), 2)
        self.assertEqual(self.value("locus_queries_total", kind="ball"), 1)
        self.assertEqual(self.value("locus_calls_total", rpc="Query", code="OK"), 3)
        self.assertEqual(self.value("locus_calls_total", rpc="Query", code="NOT_FOUND"), 1)
        self.assertEqual(self.value("locus_call_seconds_count", rpc="Query"), 4)
        self.assertEqual(self.value("locus_refusals_total", reason="NOT_FOUND", limit=""), 1)
        self.assertEqual(self.value("locus_update_items_total"), 1)
        self.assertEqual(self.value("locus_update_lag_seconds_count"), 1)
        self.assertEqual(self.value("locus_mesh_build_seconds_count"), 1)
        self.assertEqual(self.value("locus_scene_objects", scene="arena"), 1)
        self.assertEqual(self.value("locus_scene_instances", scene="arena"), 1)

    def test_every_metric_has_help_and_a_type(self):
        for family in self.families.values():
            self.assertTrue(family.documentation.endswith("."), family.name)
            self.assertIn(family.type, ("counter", "gauge", "histogram"), family.name)

    def test_histograms_count_upwards_to_their_count(self):
        for family in self.families.values():
            series = {}
            for sample in family.samples:
                if sample.name.endswith("_bucket"):
                    labels = tuple(sorted((k, v) for k, v in sample.labels.items() if k != "le"))
                    series.setdefault(labels, []).append((float(sample.labels["le"]), sample.value))
            for labels, buckets in series.items():
                self.assertEqual(buckets, sorted(buckets), family.name)
                self.assertEqual(buckets[-1][0], float("inf"), family.name)
                self.assertEqual(buckets[-1][1], self.value(family.name + "_count", **dict(labels)), family.name)

    @staticmethod
    def expressions():
        dashboard = json.loads(read("grafana.json"))
        shown = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
        alerts = yaml.safe_load(read("alerts.yml"))
        return shown + [rule["expr"] for group in alerts["groups"] for rule in group["rules"]]

    def test_dashboard_and_alerts_name_only_existing_metrics(self):
        expressions = self.expressions()
        self.assertGreater(len(expressions), 20)
        labels = {}
        for sample in self.samples:
            labels.setdefault(sample.name, set()).update(sample.labels)
        for expression in expressions:
            names = set(METRIC.findall(expression))
            self.assertTrue(names or KNOWN_ELSEWHERE & set(re.findall(r"\w+", expression)), expression)
            self.assertLessEqual(names, self.names(), expression)
            for name, inside in LABELLED.findall(expression):
                used = set(re.findall(r"(\w+)\s*[=!]", inside)) - {"instance", "job"}
                self.assertLessEqual(used, set() if name in metrics_of_a_cluster() else labels[name], expression)

    def test_a_daemon_alone_has_no_metrics_of_a_cluster(self):
        self.assertGreater(len(metrics_of_a_cluster()), 5)
        self.assertFalse(metrics_of_a_cluster() & ({sample.name for sample in self.samples} | set(self.families)))

    def test_files_that_cannot_be_reloaded_raise_an_alert(self):
        rules = [rule for group in yaml.safe_load(read("alerts.yml"))["groups"] for rule in group["rules"]]
        self.assertEqual([rule["expr"] for rule in rules if "locus_files_refused" in rule["expr"]],
                         ["locus_files_refused > 0"])
        for files in ("access", "tls"):
            self.assertEqual(self.value("locus_files_refused", files=files), 0)

    def test_panels_lie_side_by_side_and_have_numbers_of_their_own(self):
        panels = json.loads(read("grafana.json"))["panels"]
        self.assertEqual(len({panel["id"] for panel in panels}), len(panels))
        places = set()
        for panel in panels:
            grid = panel["gridPos"]
            cells = {(x, y) for x in range(grid["x"], grid["x"] + grid["w"]) for y in range(grid["y"], grid["y"] + grid["h"])}
            self.assertFalse(cells & places, panel["title"])
            self.assertLessEqual(grid["x"] + grid["w"], 24, panel["title"])
            places |= cells

    def test_every_alert_says_what_happened_and_what_to_do(self):
        for group in yaml.safe_load(read("alerts.yml"))["groups"]:
            for rule in group["rules"]:
                self.assertEqual(set(rule["annotations"]), {"summary", "action", "runbook_url"}, rule["alert"])
                self.assertIn(rule["labels"]["severity"], ("page", "warn"), rule["alert"])

    def test_every_alert_has_a_section_in_the_runbook_and_links_to_it(self):
        rules = [rule for group in yaml.safe_load(read("alerts.yml"))["groups"] for rule in group["rules"]]
        sections = re.findall(r"^## (\w+)$", read(RUNBOOK), re.MULTILINE)
        self.assertEqual(sections, [rule["alert"] for rule in rules])
        for rule in rules:
            self.assertEqual(rule["annotations"]["runbook_url"], RUNBOOK_URL + "#" + rule["alert"].lower())

    def test_the_runbook_names_the_severity_of_each_alert_and_only_existing_metrics(self):
        text = read(RUNBOOK)
        severities = {rule["alert"]: rule["labels"]["severity"]
                      for group in yaml.safe_load(read("alerts.yml"))["groups"] for rule in group["rules"]}
        for section in text.split("\n## ")[1:]:
            self.assertIn(f"**{severities[section.split()[0]].capitalize()}", section)
        self.assertLessEqual(set(METRIC.findall(text)), self.names())

    def test_the_example_scrapes_the_default_port_and_loads_the_alerts(self):
        example = yaml.safe_load(read("prometheus.yml"))
        self.assertEqual(example["rule_files"], ["alerts.yml"])
        self.assertEqual(example["scrape_configs"][0]["static_configs"][0]["targets"], ["127.0.0.1:7576"])

    def test_the_readme_lists_every_metric_of_ours(self):
        text = read("README.md")
        for name in self.families:
            if name.startswith("locus_"):
                shown = (name, name + "_total", re.sub(r"^locus_scene", "", name))
                self.assertTrue(any(f"`{word}`" in text for word in shown), name)

    def test_top_shows_the_scene_without_a_terminal(self):
        top = json.loads(self.locus("top", "--metrics-address", self.http, "--once", "--json", "--interval", "0.1"))
        self.assertEqual([scene["scene"] for scene in top["scenes"]], ["arena"])
        self.assertTrue(top["server"]["ready"])

    def test_config_shows_where_values_come_from(self):
        rows = json.loads(subprocess.run(
            [os.path.join(BIN, "locusd"), "config", "--json", "--max-scenes", "3"], capture_output=True, text=True,
            check=True).stdout)["options"]
        by_name = {row["option"]: row for row in rows}
        self.assertEqual(by_name["max-scenes"], {"option": "max-scenes", "value": "3", "origin": "flag",
                                                 "place": "--max-scenes"})
        self.assertEqual(by_name["max-calls"]["origin"], "default")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
