"""Prints deploy/kubernetes/single/locusd.yaml as podman can play it: podman 4 knows no StatefulSet, so its pod becomes that of a
Deployment, and its claim an object of its own. Ports are published on this machine's loopback.

    python3 podman_manifest.py MANIFEST GRPC_PORT HTTP_PORT [--without-claim]

--without-claim leaves the claim out, because podman refuses to make a volume that exists, where Kubernetes keeps it.
"""
import sys

import yaml


def main():
    path, *ports = sys.argv[1:4]
    with open(path, encoding="utf-8") as file:
        objects = list(yaml.safe_load_all(file))
    workload = next(entry for entry in objects if entry["kind"] == "StatefulSet")
    spec, name = workload["spec"], workload["metadata"]["name"]
    pod = spec["template"]["spec"]
    claims = []
    for template in spec.pop("volumeClaimTemplates"):
        volume = template["metadata"]["name"]
        claim = f"{volume}-{name}-0"
        template["metadata"]["name"] = claim
        claims.append({"apiVersion": "v1", "kind": "PersistentVolumeClaim", **template})
        pod.setdefault("volumes", []).append({"name": volume, "persistentVolumeClaim": {"claimName": claim}})
    del spec["serviceName"]
    workload["kind"] = "Deployment"
    for published, port in zip(ports, pod["containers"][0]["ports"], strict=True):
        port.update(hostIP="127.0.0.1", hostPort=int(published))
    kept = [] if "--without-claim" in sys.argv[4:] else claims
    print(yaml.safe_dump_all(kept + objects))


if __name__ == "__main__":
    main()
