"""Checks the manifests of deploy/kubernetes without a cluster: kubernetes-models of npm accepts them, no field is misspelt,
nothing refers to what is not there, and every option of locusd that they and the compose files use exists.

    python3 kubernetes_test.py SOURCE_DIRECTORY LOCUSD

Exits 77, which counts as skipped, without Node.js or the models; `deploy/packages.sh manifests` installs both.
"""
import copy
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import unittest

import yaml

SOURCE, LOCUSD = (os.path.abspath(path) for path in sys.argv[1:3])
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)

import references  # noqa: E402

SKIPPED = 77
FOLDERS = ("single", "cluster", "engine")
COMPOSE_FILES = ("compose.yaml", "edge/compose.yaml", "cluster/compose.yaml")
# Options of a cluster that the manifests use before locusd has them. As soon as it has --cluster, this list is not used.
COMING_OPTIONS = ("cluster", "advertise", "zone", "engine-replication")
CLIENT_VARIABLES = {"LOCUS_ADDRESS"}  # read by `locus` in health checks
# Maps whose keys are names that the author chooses, so that no name is misspelt.
FREE_MAPS = ("labels", "matchLabels", "selector", "requests", "limits")
# A fault of each kind that the models find by themselves: place, and wrong value.
WRONG_VALUES = (
    ("single", "StatefulSet", "spec.replicas", "one"), ("single", "Service", "spec.ports.0.port", "grpc"),
    ("single", "StatefulSet", "spec.template.spec.containers.0.resources.limits.memory", "2 GiB"),
    ("single", "StatefulSet", "spec.template.spec.containers.0.name", None),
    ("single", "StatefulSet", "kind", "StatefullSet"), ("single", "StatefulSet", "apiVersion", "apps/v2"),
    ("cluster", "PodDisruptionBudget", "apiVersion", "policy/v2"),
    ("cluster", "HorizontalPodAutoscaler", "spec.maxReplicas", None), ("engine", "RoleBinding", "roleRef", None))
# A fault of each kind that `references` finds.
WRONG_REFERENCES = (
    ("single", "StatefulSet", "spec.serviceName", "locus"), ("single", "Service", "spec.selector.app", "locus"),
    ("single", "Service", "spec.ports.0.targetPort", "rpc"), ("single", "NetworkPolicy", "spec.podSelector.matchLabels.app", "x"),
    ("single", "StatefulSet", "spec.template.metadata.labels.app", "x"),
    ("single", "StatefulSet", "spec.volumeClaimTemplates.0.metadata.name", "scenes"),
    ("single", "StatefulSet", "spec.template.spec.containers.0.readinessProbe.httpGet.port", 7577),
    ("single", "StatefulSet", "spec.template.spec.securityContext.runAsNonRoot", False),
    ("single", "StatefulSet", "spec.template.spec.securityContext.seccompProfile", None),
    ("single", "StatefulSet", "spec.template.spec.containers.0.securityContext.readOnlyRootFilesystem", None),
    ("single", "StatefulSet", "spec.template.spec.containers.0.securityContext.capabilities.drop", ["NET_RAW"]),
    ("single", "StatefulSet", "spec.template.spec.containers.0.resources.limits.memory", "4Gi"),
    ("single", "StatefulSet", "spec.template.spec.automountServiceAccountToken", None),
    ("single", "StatefulSet", "spec.template.spec.hostNetwork", True),
    ("cluster", "StatefulSet", "spec.replicas", 3), ("cluster", "HorizontalPodAutoscaler", "spec.scaleTargetRef.name", "locusd"),
    ("cluster", "PodDisruptionBudget", "spec.selector.matchLabels.app", "locusd"),
    ("cluster", "StatefulSet", "spec.template.spec.volumes.0.secret.secretName", "passfile"),
    ("cluster", "StatefulSet", "spec.template.spec.volumes.1.name", "running"),
    ("cluster", "StatefulSet", "spec.template.spec.volumes.2", {"name": "work", "hostPath": {"path": "/var/lib/locus"}}),
    ("cluster", "StatefulSet", "spec.template.spec.initContainers.0.securityContext.allowPrivilegeEscalation", None),
    ("cluster", "StatefulSet", "spec.template.spec.topologySpreadConstraints.0.labelSelector.matchLabels.app", "locusd"),
    ("engine", "RoleBinding", "subjects.0.name", "default"), ("engine", "RoleBinding", "roleRef.name", "engine"),
    ("engine", "StatefulSet", "spec.template.spec.serviceAccountName", "default"),
    ("engine", "StatefulSet", "spec.template.spec.containers.0.envFrom.0.secretRef.name", "engine"),
    ("engine", "NetworkPolicy", "spec.ingress.0.ports.0.port", "sql"))


class UniqueKeys(yaml.SafeLoader):
    """A loader that refuses a key that occurs twice, of which Kubernetes would take one."""

    def construct_mapping(self, node, deep=False):
        keys = [key.value for key, _ in node.value if key.tag != "tag:yaml.org,2002:merge"]
        if len(keys) != len(set(keys)):
            raise yaml.constructor.ConstructorError(None, None, f"a key occurs twice among {keys}", node.start_mark)
        return super().construct_mapping(node, deep)


def load(folder):
    """Returns the objects of all files of a folder, without shared parts, so that a change reaches one place."""
    objects = []
    for path in sorted(glob.glob(os.path.join(SOURCE, "deploy/kubernetes", folder, "*.yaml"))):
        with open(path, encoding="utf-8") as file:
            objects += json.loads(json.dumps(list(yaml.load_all(file, UniqueKeys))))
    return objects


def changed(objects, kind, path, value):
    """Returns a copy of the objects in which a field of the first object of that kind has another value; None removes it."""
    objects = copy.deepcopy(objects)
    place = next(entry for entry in objects if entry["kind"] == kind)
    *above, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    for part in above:
        place = place[part]
    if value is None:
        del place[last]
    else:
        place[last] = value
    return objects


def misspellings(value, path=()):
    """Yields the path of each field of an object that has a fixed name, and of none whose name the author chooses."""
    if isinstance(value, dict):
        for name in value:
            is_free = path and path[-1] in FREE_MAPS and isinstance(value[name], str)
            if not is_free and path + (name,) not in (("kind",), ("apiVersion",)):
                yield path + (name,)
            yield from misspellings(value[name], path + (name,))
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from misspellings(item, path + (index,))


def misspelt(entry, path):
    entry = copy.deepcopy(entry)
    place = entry
    for part in path[:-1]:
        place = place[part]
    place[path[-1] + "s"] = place.pop(path[-1])
    return entry


def problems_by_models(lists):
    """Returns the problems that the models find in each list of objects."""
    result = subprocess.run(["node", os.path.join(HERE, "models.js")], input=json.dumps(lists), stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, timeout=120, check=False)
    if result.returncode != 0:
        raise AssertionError(result.stderr)
    return json.loads(result.stdout)


class ManifestsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folders = {folder: load(folder) for folder in FOLDERS}

    def test_the_models_accept_every_object_and_know_every_field(self):
        self.assertEqual(problems_by_models(list(self.folders.values())), [[]] * len(FOLDERS))
        self.assertGreaterEqual(sum(map(len, self.folders.values())), 16)

    def test_a_misspelling_of_any_field_is_found(self):
        planted = [(entry, path) for objects in self.folders.values() for entry in objects for path in misspellings(entry)]
        found = problems_by_models([[misspelt(entry, path)] for entry, path in planted])
        self.assertEqual([(entry["kind"], path) for (entry, path), problems in zip(planted, found) if not problems], [])
        self.assertGreater(len(planted), 400)

    def test_wrong_values_are_found(self):
        found = problems_by_models([changed(self.folders[folder], *change) for folder, *change in WRONG_VALUES])
        self.assertEqual([change for change, problems in zip(WRONG_VALUES, found) if not problems], [])

    def test_nothing_refers_to_what_is_not_there_or_has_needless_rights(self):
        self.assertEqual([references.problems_of(objects) for objects in self.folders.values()], [[]] * len(FOLDERS))

    def test_wrong_references_and_rights_are_found(self):
        for folder, *change in WRONG_REFERENCES:
            with self.subTest(change):
                self.assertNotEqual(references.problems_of(changed(self.folders[folder], *change)), [])

    def test_a_cluster_needs_no_volume_and_a_single_daemon_has_one(self):
        claims = {folder: [entry for entry in self.folders[folder] if "volumeClaimTemplates" in entry.get("spec", {})]
                  for folder in FOLDERS}
        self.assertEqual({folder: len(found) for folder, found in claims.items()}, {"single": 1, "cluster": 0, "engine": 1})

    def test_a_daemon_has_more_time_to_end_than_it_takes(self):
        for folder, seconds in (("single", 30), ("cluster", 60)):
            pod = next(entry for entry in self.folders[folder] if entry["kind"] == "StatefulSet")["spec"]["template"]
            self.assertEqual(pod["spec"]["terminationGracePeriodSeconds"], seconds)


class OptionsTest(unittest.TestCase):
    """Every variable of locusd in manifests and compose files is an option of locusd, with a value that it takes."""

    @classmethod
    def setUpClass(cls):
        answer = subprocess.run([LOCUSD, "--help"], stdout=subprocess.PIPE, text=True, timeout=60, check=True)
        cls.options = set(re.findall(r"^  (?:-\w,)?--([a-z-]+)", answer.stdout, re.MULTILINE))
        cls.has_cluster = "cluster" in cls.options
        cls.known = cls.options | (set() if cls.has_cluster else set(COMING_OPTIONS))

    @staticmethod
    def environments():
        """Yields the place and the variables of each container of locusd's image."""
        for folder in FOLDERS:
            for entry in load(folder):
                for container in entry.get("spec", {}).get("template", {}).get("spec", {}).get("containers", ()):
                    if container["image"] == "localhost/locus":
                        yield f"{folder}, {container['name']}", {variable["name"]: variable.get("value", "")
                                                                 for variable in container["env"]}
        for name in COMPOSE_FILES:
            with open(os.path.join(SOURCE, "deploy", name), encoding="utf-8") as file:
                for service, content in yaml.safe_load(file)["services"].items():
                    if content["image"] == "localhost/locus":
                        yield f"{name}, {service}", content["environment"]

    def unknown(self, variables):
        options = {name: name[len("LOCUS_"):].lower().replace("_", "-") for name in set(variables) - CLIENT_VARIABLES
                   if name.startswith("LOCUS_")}
        return sorted(name for name, option in options.items() if option not in self.known)

    def test_every_variable_is_an_option(self):
        places = dict(self.environments())
        self.assertEqual(len(places), 7, places.keys())
        self.assertEqual({place: self.unknown(variables) for place, variables in places.items() if self.unknown(variables)}, {})

    def test_a_variable_that_is_no_option_is_found(self):
        self.assertEqual(self.unknown({"LOCUS_CLUSTERS": "", "LOCUS_ADRESS": "", "LOCUS_LISTEN": "", "OTHER": ""}),
                         ["LOCUS_ADRESS", "LOCUS_CLUSTERS"])

    def test_locusd_takes_the_values(self):
        for place, variables in self.environments():
            if "LOCUS_CLUSTER" in variables and not self.has_cluster:
                continue
            with self.subTest(place):
                answer = subprocess.run([LOCUSD, "config"], env={name: value for name, value in variables.items()
                                                                 if name not in CLIENT_VARIABLES},
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60, check=False)
                self.assertEqual(answer.returncode, 0, answer.stdout)


if __name__ == "__main__":
    for missing, path in (("Node.js", shutil.which("node")),
                          ("kubernetes-models", os.path.exists(os.path.join(HERE, "node_modules/kubernetes-models")))):
        if not path:
            print(f"SKIPPED: {missing} is missing: ./deploy/packages.sh manifests")
            sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1])
