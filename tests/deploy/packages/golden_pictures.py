"""Draws the pictures of tests/golden/renders.txt with given programs, and compares the hashes of their depths and ids with
those of the file. The scenes are those of tests/client/cli/commands/render_command_golden_test.cc, made anew here through
the command line.
"""

import json
import os
import struct
import subprocess

MASK = 2**64 - 1
TILTED = (0.18257419, 0.36514837, 0.54772256, 0.73029674)  # (1, 2, 3, 4), normalised
ABOUT_Z = (0, 0, 0.38268343, 0.92387953)  # 45 degrees
MIDDLES = {"city": (0, 0, 0), "tilted": (0, 0, 0), "far": (3.0e8, -2.5e8, 1.0e6), "objects": (0, 0, 0)}
OBJECTS = 180


class Random:
    """SplitMix64, as in client/cli/levels/generate/splitmix64.h."""

    def __init__(self, seed):
        self.state = seed

    def unit(self):
        self.state = (self.state + 0x9E3779B97F4A7C15) & MASK
        mixed = ((self.state ^ (self.state >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        mixed = ((mixed ^ (mixed >> 27)) * 0x94D049BB133111EB) & MASK
        return ((mixed ^ (mixed >> 31)) >> 11) * 2.0**-53


def objects(middle, seed):
    """Returns rows of 60 balls, 60 boxes and 60 capsules, spread over a square around `middle`."""
    random, rows = Random(seed), []
    for number in range(OBJECTS):
        x, y, z = random.unit(), random.unit(), random.unit()
        at = [middle[0] + 120 * (x - 0.5), middle[1] + 120 * (y - 0.5), middle[2] + 4 + 30 * z]
        (size,) = struct.unpack("f", struct.pack("f", 1 + random.unit()))
        row = {"id": str(1000 + number), "at": at}
        if number % 3 == 0:
            row.update(shape="ball", radius=size)
        elif number % 3 == 1:
            row.update(shape="box", half=[size, 2 * size, 0.5 * size], rotation=TILTED if number % 2 == 0 else ABOUT_Z)
        else:
            row.update(shape="capsule", axis=[0, size, size], radius=0.5 * size, rotation=TILTED)
        rows.append(json.dumps(row) + "\n")
    return "".join(rows)


def numbers(values):
    return ",".join(map(repr, values))


class Artist:
    """Draws with the program `locus` and the daemon at `address`."""

    def __init__(self, locus, address):
        self.command = [locus, "--address", address]

    def run(self, *arguments, rows=None):
        done = subprocess.run([*self.command, *arguments], input=rows, capture_output=True, text=True, timeout=300, check=False)
        if done.returncode:
            raise AssertionError(f"locus {' '.join(arguments)}\nexited with {done.returncode}\n{done.stderr}")
        return done.stdout

    def place(self, scene, number, at, rotation=(0, 0, 0, 1), scale=1):
        self.run("instance", "place", scene, "--mesh", "city-3000", "--id", str(number), "--at", numbers(at), "--rotation",
                 numbers(rotation), "--scale", str(scale))

    def make_scenes(self):
        for scene, middle in MIDDLES.items():
            self.run("scene", "create", scene)
            if scene == "city":
                self.run("generate", "city", "--triangles", "3000", "--seed", "7", "--mesh", "city-3000", "--scene", scene,
                         "--at", numbers(middle), "--id", "1")
            elif scene == "tilted":
                self.place(scene, 1, middle, TILTED)
                self.place(scene, 2, (60, -40, 25), ABOUT_Z, 0.25)
                self.place(scene, 3, (-30, 20, 60), (0, 1, 0, 0), 0.5)
            elif scene == "far":
                self.place(scene, 1, middle)
            self.run("insert", scene, "mixed", "--from-ndjson", "-", "--one-revision", rows=objects(middle, len(scene)))

    def hashes(self, scene, options, path):
        report = json.loads(self.run("--output", "json", "render", scene, path, "--size", "160x120", *options))
        return report["depth_sha256"], report["ids_sha256"]


def differences(source, locus, address, folder):
    """Draws all pictures into `folder`. Returns how many there are, and a line for each that is not as it was."""
    artist, found, count = Artist(locus, address), [], 0
    artist.make_scenes()
    with open(os.path.join(source, "tests/golden/renders.txt"), encoding="utf-8") as file:
        for line in file:
            name, depth, ids, scene, *options = line.split()
            taken = artist.hashes(scene, options, os.path.join(folder, name + ".png"))
            count += 1
            if taken != (depth, ids):
                found.append(f"{name}: expected {depth} {ids}, taken {taken[0]} {taken[1]}")
    return count, found
