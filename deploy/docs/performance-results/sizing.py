"""Measures what a scene costs: bytes of memory and disk, time to build, and processor time of each query and move.

    PYTHONPATH=build/release/python /usr/bin/python3 deploy/docs/performance-results/sizing.py --bin build/release/bin
    /usr/bin/python3 deploy/docs/performance-results/sizing.py --draw FOLDER

The first form starts a locusd of its own on free loopback ports, measures the parts `memory` and `time` or those that
--parts names, and writes sizing.json beside this file. The second draws the pictures of the page about sizing from
sizing.json, and writes figures and sections into the pages sizing.md and index.md of the folder; it needs the package
gnuplot-nox.
"""
from __future__ import annotations

import argparse
import array
import datetime
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request

RESULTS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "sizing.json")
TICKS = 60
SIDE = 2000.0
KINDS = ("rays", "balls", "boxes", "nearest", "moves")
BENCH_SECONDS = 4


class Daemon:
    """A context manager: a locusd with a data directory of its own."""

    def __init__(self, binaries: str) -> None:
        self.binaries = os.path.abspath(binaries)
        self.folder = tempfile.mkdtemp(prefix="locus-sizing-")
        self.process = None

    def __enter__(self) -> "Daemon":
        port, http = (os.path.join(self.folder, name) for name in ("port", "http"))
        with open(os.path.join(self.folder, "log"), "w", encoding="utf-8") as log:
            self.process = subprocess.Popen(
                [os.path.join(self.binaries, "locusd"), "--listen", "127.0.0.1:0", "--port-file", port, "--http-listen",
                 "127.0.0.1:0", "--http-port-file", http, "--data-dir", os.path.join(self.folder, "data")],
                stdout=log, stderr=log)
        deadline = time.monotonic() + 30
        while not (os.path.exists(port) and os.path.exists(http)):
            if self.process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError("locusd did not start")
            time.sleep(0.05)
        self.address, self.http = (f"127.0.0.1:{open(path, encoding='utf-8').read().strip()}" for path in (port, http))
        return self

    def __exit__(self, *_) -> None:
        self.process.terminate()
        self.process.wait(60)
        shutil.rmtree(self.folder, ignore_errors=True)

    def locus(self, *arguments: str) -> str:
        return subprocess.run([os.path.join(self.binaries, "locus"), "-a", self.address, *arguments], check=True,
                              capture_output=True, text=True).stdout

    def metric(self, name: str, labels: str = "") -> float:
        with urllib.request.urlopen(f"http://{self.http}/metrics", timeout=30) as page:
            found = re.search(rf"^{name}{re.escape(labels)} (\S+)$", page.read().decode(), re.MULTILINE)
        if not found:
            raise RuntimeError(f"there is no metric {name}{labels}")
        return float(found.group(1))


def machine() -> str:
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        found = re.search(r"model name\s*: (.*)", file.read())
    cores = len(os.sched_getaffinity(0))
    return f"{found.group(1) if found else 'unknown processor'}, {cores} {'core' if cores == 1 else 'cores'}"


def scattered(count: int, seed: int) -> "array.array[float]":
    """Returns the positions of `count` objects at random places of a square of SIDE, up to 100 high."""
    chance = random.Random(seed)
    column = array.array("f")
    for _ in range(count):
        column.extend((chance.uniform(0, SIDE), chance.uniform(0, SIDE), chance.uniform(0, 100)))
    return column


def stepped(column: "array.array[float]", chance: random.Random) -> "array.array[float]":
    """Returns the positions a tick later: each object has walked up to 0.1 along each axis."""
    return array.array("f", (value + chance.uniform(-0.1, 0.1) for value in column))


def measure_objects(daemon: Daemon, locus, count: int) -> dict:
    """Returns bytes of an object, of an object's past tick, and of a move in the log."""
    name = f"movers-{count}"
    with locus.connect(daemon.address) as client:
        client.create_scene(name, history_ticks=TICKS)
        places, ids = scattered(count, 1), array.array("Q", range(1, count + 1))
        client.apply(name, locus.UpdateBatch(tick=1).insert_balls(ids=ids, positions=places, radii=0.5))
        bytes_of_an_object = client.scene(name).memory_bytes / count
        turns = [places, stepped(places, random.Random(2))]
        log_before, logged = daemon.metric("locus_scene_log_bytes", f'{{scene="{name}"}}'), 0
        bytes_of_a_move = 0.0
        for tick in range(2, TICKS + 2):
            # Two positions in turns, so that the script itself costs little.
            client.apply(name, locus.UpdateBatch(tick=tick).move(ids=ids, positions=turns[tick % 2]))
            logged += count
            if tick == 3:
                bytes_of_a_move = (daemon.metric("locus_scene_log_bytes", f'{{scene="{name}"}}') - log_before) / logged
        scene = client.scene(name)
        client.delete_scene(name)
    return {"objects": count, "object_bytes": bytes_of_an_object, "kept_ticks": scene.recorded_ticks,
            "tick_bytes": scene.history_bytes / scene.recorded_ticks / count, "move_log_bytes": bytes_of_a_move}


def past_bytes(client, locus, name: str, ids, places, ticks: int) -> float:
    """Moves these objects for `ticks` ticks. Returns bytes of history for each of them and each tick."""
    chance = random.Random(2)
    for tick in range(2, ticks + 2):
        places = stepped(places, chance)
        client.apply(name, locus.UpdateBatch(tick=tick).move(ids=ids, positions=places))
    scene = client.scene(name)
    return scene.history_bytes / scene.recorded_ticks / len(ids)


def measure_few_movers(daemon: Daemon, locus, count: int) -> dict:
    """Returns bytes of a past tick of a moving object if only a tenth of the objects moves."""
    with locus.connect(daemon.address) as client:
        client.create_scene("few", history_ticks=TICKS)
        places, ids = scattered(count, 1), array.array("Q", range(1, count + 1))
        client.apply("few", locus.UpdateBatch(tick=1).insert_balls(ids=ids, positions=places, radii=0.5))
        tick_bytes = past_bytes(client, locus, "few", ids[:count // 10], places[:3 * (count // 10)], 20)
        client.delete_scene("few")
    return {"objects": count, "movers": count // 10, "tick_bytes": tick_bytes}


def measure_compounds(daemon: Daemon, locus, count: int, parts: int) -> dict:
    """Returns bytes of a compound, such as a rig of hit boxes, and of its past tick."""
    rig = locus.Compound().balls(positions=array.array("f", (value for part in range(parts) for value in (0, 0, 0.1 * part))),
                                 radii=0.2)
    with locus.connect(daemon.address) as client:
        client.create_scene("rigs", history_ticks=TICKS)
        places, ids = scattered(count, 1), array.array("Q", range(1, count + 1))
        client.apply("rigs", locus.UpdateBatch(tick=1).insert_compounds(ids=ids, positions=places, compound=rig))
        object_bytes = client.scene("rigs").memory_bytes / count
        tick_bytes = past_bytes(client, locus, "rigs", ids, places, 20)
        client.delete_scene("rigs")
    return {"objects": count, "parts": parts, "object_bytes": object_bytes, "tick_bytes": tick_bytes}


def measure_mesh(daemon: Daemon, triangles: int) -> dict:
    """Returns bytes and build time of a mesh of generated terrain."""
    name = f"terrain-{triangles}"
    before = daemon.metric("locus_mesh_build_seconds_sum")
    daemon.locus("generate", "terrain", "--triangles", str(triangles), "--seed", "1", "--scene", name, "--create")
    scene = json.loads(daemon.locus("-o", "json", "scene", "describe", name))
    seconds = daemon.metric("locus_mesh_build_seconds_sum") - before
    daemon.locus("scene", "delete", name)
    return {"triangles": scene["triangles"], "triangle_bytes": scene["mesh_bytes"] / scene["triangles"],
            "build_ms": 1000 * seconds}


def measure_rates(daemon: Daemon) -> list:
    """Returns for each kind the processor time of the daemon for one query or move, in batches of 256."""
    rows = []
    for kind in KINDS:
        before = daemon.metric("process_cpu_seconds_total")
        report = json.loads(daemon.locus("-o", "json", "bench", "--kinds", kind, "--seconds", str(BENCH_SECONDS)))["kinds"][0]
        seconds = daemon.metric("process_cpu_seconds_total") - before
        rows.append({"kind": kind, "microseconds": 1e6 * seconds / report["items"], "rate_per_s": report["rate_per_s"],
                     "cores": seconds / BENCH_SECONDS})
    return rows


def measure_part(part: str, binaries: str) -> dict:
    with Daemon(binaries) as daemon:
        results = {"date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(), "machine": machine()}
        if part == "time":
            return {**results, "meshes": [measure_mesh(daemon, count) for count in (10_000, 100_000, 1_000_000)],
                    "rates": measure_rates(daemon)}
        import locus  # only this part needs the package

        return {**results, "objects": [measure_objects(daemon, locus, count) for count in (1_000, 10_000, 100_000)],
                "few_movers": measure_few_movers(daemon, locus, 100_000),
                "compounds": measure_compounds(daemon, locus, 10_000, 16),
                "mesh": measure_mesh(daemon, 100_000)}


def memory_table(memory: dict) -> str:
    by_count = {row["objects"]: row for row in memory["objects"]}
    largest, few, rigs, mesh = memory["objects"][-1], memory["few_movers"], memory["compounds"], memory["mesh"]
    rows = [
        ("a ball, with its id and its place in the index", largest["object_bytes"],
         f"100,000 at random in 2000 x 2000 x 100; {by_count[1000]['object_bytes']:.0f} with 1,000, "
         f"{by_count[10000]['object_bytes']:.0f} with 10,000"),
        ("a past tick of an object that moves, if all do", largest["tick_bytes"], "the same, up to 0.1 along each axis a tick"),
        ("the same, if a tenth of the objects moves", few["tick_bytes"],
         f"{few['movers']:,} of {few['objects']:,}: blocks that movers share with others are kept whole"),
        (f"a compound of {rigs['parts']} balls, all compounds alike", rigs["object_bytes"], f"{rigs['objects']:,} of them"),
        ("a past tick of such a compound that moves", rigs["tick_bytes"], "the same"),
        ("a triangle of a mesh, with its tree", mesh["triangle_bytes"], f"terrain of {mesh['triangles']:,} triangles"),
        ("a move in the log on the disk, float positions", largest["move_log_bytes"], "batches of 100,000"),
    ]
    lines = [f"| {what} | {value:.0f} | {how} |" for what, value, how in rows]
    return "\n".join(["| what | bytes | measured with |", "|---|---|---|", *lines, "",
                      f"Measured on {memory['date']} ({memory['machine']})."])


def ticks_text(memory: dict) -> str:
    largest = memory["objects"][-1]
    return (f"{largest['objects']:,} objects that all move, and the default of 256 MiB, keep {largest['kept_ticks']} ticks: "
            f"256 MiB / ({largest['objects']:,} x {largest['tick_bytes']:.0f} bytes). At 60 ticks a second that is "
            f"{largest['kept_ticks'] / 60:.1f} s.")


def examples_table(memory: dict) -> str:
    largest, rigs, triangle = memory["objects"][-1], memory["compounds"], memory["mesh"]["triangle_bytes"]
    rows = [
        ("a shooter: a level of 500,000 triangles, 64 players of 16 parts, 1 s of past at 60 ticks/s",
         500_000 * triangle + 64 * (rigs["object_bytes"] + 60 * rigs["tick_bytes"])),
        ("a crowd: 100,000 moving objects, 2 s of past at 30 ticks/s",
         100_000 * (largest["object_bytes"] + 60 * largest["tick_bytes"])),
        ("a country: 5,000,000 triangles, 1,000,000 objects at rest", 5_000_000 * triangle + 1_000_000 * largest["object_bytes"]),
    ]
    return "\n".join(["| scene | memory |", "|---|---|", *(f"| {what} | {value / 1e6:,.0f} MB |" for what, value in rows)])


def time_text(part: dict) -> str:
    builds = [f"| {row['triangles']:,} | {row['build_ms']:.0f} |" for row in part["meshes"]]
    rates = [f"| {row['kind']} | {row['microseconds']:.2f} | {row['microseconds'] / 10:.2f} |" for row in part["rates"]]
    return "\n".join([
        f"Measured on {part['date']} ({part['machine']}, which also had other work): wall time of the builds, and processor time "
        "of the daemon for batches of 256 over loopback from two connections, among 10,000 objects, with network and protocol.",
        "", "| triangles | ms to build the tree |", "|---|---|", *builds, "",
        "| kind | microseconds of processor | cores for 100,000 a second |", "|---|---|---|", *rates, "",
        "![Processor time of the daemon for one query or move](sizing-time.svg)"])


def pictures(results: dict) -> dict:
    """Returns the scripts of gnuplot by the name of their picture."""
    opening = ("set terminal svg noenhanced size 900,420 font 'sans-serif,12' background '#ffffff' name 'sizing'\n"
               "set colorsequence podo\n")
    memory, scripts = results["memory"], {}
    tick_bytes = memory["objects"][-1]["tick_bytes"]
    lines = ", ".join(f"{mib} * 1048576.0 / ({tick_bytes} * x) linewidth 2 title '{mib} MiB'" for mib in (64, 256, 1024))
    scripts["sizing-ticks.svg"] = (
        f"{opening}set title 'past ticks that fit, {tick_bytes:.0f} bytes for each moving object and tick  ({memory['date']})'\n"
        "set logscale xy 10\nset format xy '%.0s%c'\nset grid\nset xlabel 'objects, all moving each tick'\nset ylabel 'ticks'\n"
        f"set xrange [100:1e6]\nset yrange [1:16384]\nset key top right\nplot {lines}\n")
    if "time" in results:
        part = results["time"]
        bars = "".join(f"\"{row['kind']}\" {row['microseconds']:.3f}\n" for row in part["rates"])
        scripts["sizing-time.svg"] = (
            f"{opening}set title 'processor time of the daemon for one query or move  ({part['date']}; {part['machine']})'\n"
            "set style fill solid 0.7\nset boxwidth 0.6\nset yrange [0:*]\nset grid y\nset ylabel 'microseconds'\nunset key\n"
            f"$bars << END\n{bars}END\nplot $bars using 0:2:xtic(1) with boxes\n")
    return scripts


# Sections of the page about ratios, by the record that they show: heading, text, picture and its description.
SECTIONS = {
    "static": ("Meshes", "Rays and regions among the triangles of one mesh; time to build its tree, and its memory.",
               "static-ratios.svg", "Ratios of the suite static"),
    "dynamic": ("Moving objects", "Moves, and queries among moving objects, in whole batches with ids, by one thread.",
                "dynamic-ratios.svg", "Ratios of the suite dynamic"),
    "serving": ("Over the network", "A daemon and its client on the loopback of one machine.",
                "serving-ratios.svg", "Ratios of the suite serving"),
    "structures": ("Structures", "How the time of a query grows with the number of values: a line for each structure of "
                   "`core/index`, and one for a list that tests every value. Where a line crosses that of the list, both take "
                   "the same time; left of it a list is faster. The daemon uses `bvh` for meshes and instances, and `hash_grid` "
                   "for objects; the others are for programs that use `locus::index` themselves.",
                   "structures-growth.svg", "Times of queries by number of values, for each structure"),
}


def sections_text() -> str:
    """Returns a section for each record of locus-bench beside this file."""
    found = [SECTIONS[name] for name in SECTIONS if os.path.exists(os.path.join(os.path.dirname(RESULTS), name + ".json"))]
    return "\n\n".join(f"## {heading}\n\n{text}\n\n![{described}]({picture})" for heading, text, picture, described in found)


def with_regions(page: str, regions: dict) -> str:
    """Replaces the text between `<!-- begin NAME -->` and `<!-- end NAME -->` of the page."""
    for name, text in regions.items():
        region = re.compile(rf"(<!-- begin {name} -->\n).*?(<!-- end {name} -->)", re.DOTALL)
        page, count = region.subn(lambda found, text=text: f"{found[1]}\n{text}\n\n{found[2]}", page)
        if count != 1:
            raise RuntimeError(f"the page has {count} regions {name}")
    return page


def draw(folder: str) -> None:
    with open(RESULTS, encoding="utf-8") as file:
        results = json.load(file)
    os.makedirs(folder, exist_ok=True)
    for name, script in pictures(results).items():
        drawn = subprocess.run(["gnuplot"], input=script, capture_output=True, text=True, check=True)
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(drawn.stdout)
    regions = {"memory": memory_table(results["memory"]), "ticks": ticks_text(results["memory"]),
               "examples": examples_table(results["memory"])}
    if "time" in results:
        regions["time"] = time_text(results["time"])
    for name, of_page in (("sizing.md", regions), ("index.md", {"pictures": sections_text()})):
        path = os.path.join(folder, name)
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                page = with_regions(file.read(), of_page)
            with open(path, "w", encoding="utf-8") as file:
                file.write(page)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default="build/release/bin")
    parser.add_argument("--parts", default="memory,time", help="memory, time, or both [both]")
    parser.add_argument("--draw", metavar="FOLDER")
    options = parser.parse_args()
    if options.draw:
        if not shutil.which("gnuplot"):
            print("sizing.py: needs the program gnuplot: install the package gnuplot-nox", file=sys.stderr)
            return 1
        draw(options.draw)
        return 0
    results = {}
    if os.path.exists(RESULTS):
        with open(RESULTS, encoding="utf-8") as file:
            results = json.load(file)
    for part in options.parts.split(","):
        results[part] = measure_part(part, options.bin)
    with open(RESULTS, "w", encoding="utf-8") as file:
        json.dump(results, file, indent=1)
        file.write("\n")
    print(json.dumps(results, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
