"""A character's step: it is pushed out of objects that it overlaps, then it moves and slides along walls and the floor.

    PYTHONPATH=build/release/python /usr/bin/python3 character_step.py [ADDRESS]

The character is a capsule. Columns T and NORMAL of a capsule query contain the depth of each overlap and the direction
out of it. A sweep with AtStart.APPROACH returns how far the character can move. This mode is needed so that the floor
on which the character stands does not stop the sweep.
"""
from __future__ import annotations

import sys
from typing import List

import locus
from locus import Column

SCENE, RADIUS, HALF = "character-example", 0.4, 0.5  # HALF: from the centre to an end of the inner segment
SKIN, SLIDES = 0.001, 4
Vector = List[float]


def add(a: Vector, b: Vector, times: float = 1.0) -> Vector:
    """Returns a + times * b."""
    return [x + times * y for x, y in zip(a, b)]


def dot(a: Vector, b: Vector) -> float:
    """Returns the dot product."""
    return sum(x * y for x, y in zip(a, b))


def push_out(client: locus.Client, center: Vector) -> Vector:
    """Returns the centre after moving it out of each object that the capsule overlaps, one contact after the other."""
    up = [0.0, HALF, 0.0]
    batch = locus.QueryBatch().capsules([add(center, up, -1)], [add(center, up)], RADIUS,
                                        block=locus.Block(columns=[Column.T, Column.NORMAL]))
    contacts = client.query(SCENE, batch).blocks[0]
    normals = list(map(float, getattr(contacts.normals, "flat", contacts.normals)))
    for i, distance in enumerate(map(float, contacts.t)):
        normal = normals[3 * i:3 * i + 3]
        center = add(center, normal, max(0.0, RADIUS - distance + SKIN))
    return center


def step(client: locus.Client, center: Vector, way: Vector) -> Vector:
    """Returns the position of the character's centre after it has tried to move by the vector `way`."""
    center = push_out(client, center)
    for _ in range(SLIDES):
        batch = locus.QueryBatch().sweeps([center], [add(center, way)], RADIUS, half_axes=[0.0, HALF, 0.0],
                                          at_start=locus.AtStart.APPROACH,
                                          block=locus.Block(columns=[Column.T, Column.ID, Column.NORMAL]))
        hit = client.query(SCENE, batch).blocks[0]
        if not int(hit.ids[0]):
            return add(center, way)
        length = dot(way, way) ** 0.5
        free = max(0.0, float(hit.t[0]) - SKIN / length)
        normal = list(map(float, getattr(hit.normals, "flat", hit.normals)))[:3]
        center = add(center, way, free)
        way = add([x * (1 - free) for x in way], normal, -dot(way, normal) * (1 - free))
        if dot(way, way) < 1e-8:
            break
    return center


def make_scene(client: locus.Client) -> None:
    """Creates the scene: a floor with its top at y = 0, and a wall at x = 3."""
    client.delete_scene(SCENE, if_present=True)
    client.create_scene(SCENE)
    boxes = locus.UpdateBatch().insert_boxes(ids=[1, 2], positions=[[0, -1, 0], [4, 2, 0]],
                                             half_extents=[[20, 1, 20], [1, 4, 20]])
    client.apply(SCENE, boxes)


def main() -> None:
    with locus.connect(sys.argv[1] if len(sys.argv) > 1 else locus.DEFAULT_ADDRESS) as client:
        make_scene(client)
        center = [0.0, RADIUS + HALF, 0.0]
        for tick in range(8):
            center = step(client, center, [0.6, -0.1, 0.2])
            print(f"tick {tick}: " + ", ".join(f"{x:.3f}" for x in center))
        client.delete_scene(SCENE)


if __name__ == "__main__":
    main()
