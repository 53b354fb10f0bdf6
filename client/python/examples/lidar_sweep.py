"""Spinning lidar on a vehicle: sweeps of rays from a moving and turning sensor, and the client's cost of each ray.

    PYTHONPATH=build/release/python /usr/bin/python3 client/python/examples/lidar_sweep.py --address 127.0.0.1:7575

The pattern of beams is computed once. Each sweep sends it unchanged, with one origin for all rays, the sensor's position
as the frame, and its orientation as the rotation of the block. A sweep has up to 262,144 rays.

Creates a scene of its own, a street of boxes with balls, and deletes the scene at the end. "Client time" is the time
that this process spends on encoding the request and decoding the answer into columns. Time in gRPC and in the network
counts as waiting.
"""
from __future__ import annotations

import argparse
import array
import math
import statistics
import time
from typing import List, NamedTuple, Sequence, Tuple

import locus

RINGS = 64
LOWEST, HIGHEST = math.radians(-24.8), math.radians(2.0)  # like common 64-ring sensors
RANGE = 120.0
HEIGHT = 1.75
STEP = 0.25  # metres between sweeps; exact in float32
TURN = math.radians(0.5)  # between sweeps, about the z axis
ROW_BYTES = 20  # of the columns T, ID and TRIANGLE, and of the list of truncated queries


class Cost(NamedTuple):
    """Times of one sweep, in nanoseconds."""

    encode: int
    wait: int
    decode: int


def directions(rays: int) -> "array.array[float]":
    """Returns the unit directions of the `rays` rays of one revolution, three float32 each; z is up. The directions of
    all rings at one yaw are consecutive.
    """
    steps = -(-rays // RINGS)
    column = array.array("f")
    for ray in range(rays):
        ring, step = ray % RINGS, ray // RINGS
        pitch = LOWEST + (HIGHEST - LOWEST) * ring / (RINGS - 1)
        yaw = 2 * math.pi * step / steps
        column.extend((math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), math.sin(pitch)))
    return column


def position(sweep: int) -> Tuple[float, float, float]:
    """Returns the position of the sensor in the given sweep."""
    return (STEP * sweep, 0.0, HEIGHT)


def orientation(sweep: int) -> Tuple[float, float, float, float]:
    """Returns the orientation of the sensor in the given sweep as a unit quaternion x, y, z, w."""
    return (0.0, 0.0, math.sin(TURN * sweep / 2), math.cos(TURN * sweep / 2))


def build_street(client: locus.Client, scene: str) -> locus.Revision:
    """Creates the scene with a ground, houses on both sides, and balls on the road; returns the resulting revision."""
    client.create_scene(scene)
    batch = locus.UpdateBatch()
    batch.insert_boxes([1], [0.0, 0.0, -0.5], [500.0, 500.0, 0.5], tags=1)
    houses = range(60)
    centers = [(16.0 * (house // 2) - 200.0, 14.0 if house % 2 else -14.0, 4.0) for house in houses]
    batch.insert_boxes([100 + house for house in houses], centers, [6.0, 5.0, 4.0], tags=2)
    batch.insert_balls([1000 + car for car in range(20)], [(10.0 * car - 60.0, 4.0, 0.8) for car in range(20)], 0.8, tags=3)
    return client.apply(scene, batch)


def measured_sweep(client: locus.Client, scene: str, sweep: int, pattern: "array.array[float]",
                   built: locus.Revision) -> Tuple[locus.BlockResult, Cost]:
    """Runs one sweep and returns its hits and its times. All rays start at the origin of the frame, so only the frame and
    the rotation change from sweep to sweep.
    """
    begin = time.perf_counter_ns()
    batch = locus.QueryBatch(at_least=built, max_reply_bytes=max(4_000_000, ROW_BYTES * len(pattern) // 3 + 512))
    batch.rays([0.0, 0.0, 0.0], pattern, t_max=RANGE,
               block=locus.Block(frame=position(sweep), rotation=orientation(sweep)))
    request = batch.request_bytes(scene)
    asked = time.perf_counter_ns()
    answer = client.query_bytes(scene, request)
    answered = time.perf_counter_ns()
    hits = locus.QueryResult.from_bytes(answer).blocks[0]
    hits.t, hits.ids, hits.triangles  # a column is decoded when it is first read
    return hits, Cost(asked - begin, answered - asked, time.perf_counter_ns() - answered)


def report(costs: Sequence[Cost], rays: int, hits: int) -> List[str]:
    """Returns lines of a name and a value: medians over the sweeps, in nanoseconds per ray."""
    encode, wait, decode = (statistics.median(column) / rays for column in zip(*costs))
    own = statistics.median(cost.encode + cost.decode for cost in costs) / rays
    return [f"rays a sweep            {rays}", f"sweeps                  {len(costs)}", f"hits                    {hits}",
            f"columns                 {'numpy' if locus.columns.HAS_NUMPY else 'array.array'}",
            f"encode, ns a ray        {encode:.2f}", f"decode, ns a ray        {decode:.2f}",
            f"client time, ns a ray   {own:.2f}", f"wait, ns a ray          {wait:.1f}"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--address", default=locus.DEFAULT_ADDRESS)
    parser.add_argument("--scene", default="lidar-street")
    parser.add_argument("--rays", type=int, default=8192)
    parser.add_argument("--sweeps", type=int, default=100)
    options = parser.parse_args()
    pattern = directions(options.rays)
    with locus.connect(options.address) as client:
        built = build_street(client, options.scene)
        try:
            costs, hits = [], 0
            for sweep in range(options.sweeps):
                block, cost = measured_sweep(client, options.scene, sweep, pattern, built)
                costs.append(cost)
                hits += sum(1 for thing in block.ids.tolist() if thing)
        finally:
            client.delete_scene(options.scene)
    print("\n".join(report(costs, options.rays, hits)))


if __name__ == "__main__":
    main()
