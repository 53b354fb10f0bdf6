"""Finds what refers to something that is not there, and rights that are not needed, in a set of Kubernetes objects."""

SHARED_SECRETS = {"locus-engine", "locus-engine-passfile"}  # made by the commands at the head of engine/postgresql.yaml
WORKLOADS = ("StatefulSet", "Deployment")


def named(objects, kind):
    return {entry["metadata"]["name"]: entry for entry in objects if entry["kind"] == kind}


def matches(selector, labels):
    return bool(selector) and all(labels.get(name) == value for name, value in selector.items())


def label_problems(objects, pods):
    """Checks that each selector finds the pods of the set, and each service and target exists."""
    problems = []
    for entry in objects:
        name, spec = f"{entry['kind']} {entry['metadata']['name']}", entry.get("spec", {})
        labels = [pod["metadata"]["labels"] for pod in pods.values()]
        selector = {"Service": spec.get("selector"), "PodDisruptionBudget": spec.get("selector", {}).get("matchLabels"),
                    "NetworkPolicy": spec.get("podSelector", {}).get("matchLabels")}.get(entry["kind"], "")
        if entry["kind"] in WORKLOADS:
            selector, labels = spec["selector"].get("matchLabels"), [spec["template"]["metadata"]["labels"]]
            constraints = spec["template"]["spec"].get("topologySpreadConstraints", [])
            problems += [f"{name}: spreads other pods than its own" for constraint in constraints
                         if not matches(constraint["labelSelector"].get("matchLabels"), labels[0])]
            if entry["kind"] == "StatefulSet" and spec["serviceName"] not in named(objects, "Service"):
                problems.append(f"{name}: there is no service {spec['serviceName']}")
        if selector != "" and not any(matches(selector, found) for found in labels):
            problems.append(f"{name}: selects no pod")
        if entry["kind"] == "HorizontalPodAutoscaler":
            target = spec["scaleTargetRef"]
            if target["name"] not in named(objects, target["kind"]):
                problems.append(f"{name}: there is no {target['kind']} {target['name']}")
            elif "replicas" in named(objects, target["kind"])[target["name"]]["spec"]:
                problems.append(f"{name}: the {target['kind']} sets the replicas, too")
        if entry["kind"] == "RoleBinding":
            problems += [f"{name}: there is no {reference['kind']} {reference['name']}"
                         for reference in (entry["roleRef"], *entry["subjects"])
                         if reference["name"] not in named(objects, reference["kind"])]
    return problems


def port_problems(objects, pods):
    """Checks that services and policies name ports of the pods that they select."""
    problems = []
    for entry in objects:
        name, spec = f"{entry['kind']} {entry['metadata']['name']}", entry.get("spec", {})
        if entry["kind"] == "Service":
            selector, ports = spec["selector"], [port["targetPort"] for port in spec["ports"]]
        elif entry["kind"] == "NetworkPolicy":
            selector = spec["podSelector"]["matchLabels"]
            ports = [port["port"] for rule in spec["ingress"] for port in rule.get("ports", ())]
        else:
            continue
        for pod in pods.values():
            if matches(selector, pod["metadata"]["labels"]):
                known = {value for container in pod["spec"]["containers"] for port in container["ports"]
                         for value in (port["name"], port["containerPort"])}
                problems += [f"{name}: the pod has no port {port}" for port in ports if port not in known]
    return problems


def container_problems(name, pod, container, claims):
    """Checks the volumes, probes, secrets and rights of one container."""
    problems = []
    volumes = {volume["name"] for volume in pod["spec"].get("volumes", ())} | claims
    problems += [f"{name}: there is no volume {mount['name']}" for mount in container.get("volumeMounts", ())
                 if mount["name"] not in volumes]
    ports = {port["containerPort"] for port in container.get("ports", ())}
    problems += [f"{name}: {probe} asks a port that it has not" for probe in ("readinessProbe", "livenessProbe")
                 if probe in container and container[probe]["httpGet"]["port"] not in ports]
    problems += [f"{name}: there is no secret {source['secretRef']['name']}" for source in container.get("envFrom", ())
                 if source["secretRef"]["name"] not in SHARED_SECRETS]
    rights = container.get("securityContext", {})
    if rights.get("allowPrivilegeEscalation") is not False or rights.get("capabilities", {}).get("drop") != ["ALL"] or \
            rights.get("privileged") or rights["capabilities"].get("add"):
        problems.append(f"{name}: has rights that it does not need")
    if rights.get("readOnlyRootFilesystem") is not True:
        problems.append(f"{name}: its root is not read-only")
    limits = container.get("resources", {})
    if set(limits.get("limits", ())) != {"cpu", "memory"} or limits["limits"]["memory"] != limits["requests"]["memory"]:
        problems.append(f"{name}: has no limits, or asks for less memory than it may take")
    return problems


def pod_problems(name, pod, claims):
    spec = pod["spec"]
    problems = []
    context = spec.get("securityContext", {})
    if context.get("runAsNonRoot") is not True or not context.get("runAsUser") or \
            context.get("seccompProfile", {}).get("type") != "RuntimeDefault":
        problems.append(f"{name}: runs as root or without seccomp")
    if any(spec.get(field) for field in ("hostNetwork", "hostPID", "hostIPC")):
        problems.append(f"{name}: shares a namespace of the node")
    if spec.get("automountServiceAccountToken") is not False and "serviceAccountName" not in spec:
        problems.append(f"{name}: has a token of Kubernetes that it does not need")
    for volume in spec.get("volumes", ()):
        if not set(volume) <= {"name", "emptyDir", "secret"}:
            problems.append(f"{name}: volume {volume['name']} is neither empty nor a secret")
        if volume.get("secret", {}).get("secretName", "locus-engine") not in SHARED_SECRETS:
            problems.append(f"{name}: there is no secret {volume['secret']['secretName']}")
    for container in spec.get("initContainers", []) + spec["containers"]:
        problems += container_problems(f"{name}, container {container['name']}", pod, container, claims)
    return problems


def problems_of(objects):
    """Returns all problems of the objects of one folder as sentences."""
    workloads = {name: entry for kind in WORKLOADS for name, entry in named(objects, kind).items()}
    pods = {name: entry["spec"]["template"] for name, entry in workloads.items()}
    problems = label_problems(objects, pods) + port_problems(objects, pods)
    for name, pod in pods.items():
        claims = {claim["metadata"]["name"] for claim in workloads[name]["spec"].get("volumeClaimTemplates", ())}
        problems += pod_problems(name, pod, claims)
        account = pod["spec"].get("serviceAccountName")
        if account and account not in named(objects, "ServiceAccount"):
            problems.append(f"{name}: there is no service account {account}")
    return problems
