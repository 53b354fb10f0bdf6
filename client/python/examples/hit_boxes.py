"""Hit boxes: shots at animated players, each judged at the time at which the shooter saw the world.

    PYTHONPATH=build/release/python /usr/bin/python3 hit_boxes.py [ADDRESS]

Each player is a compound of 16 parts: boxes, capsules and a ball, which is the head and has a layer of its own. The rig
is inserted once. Each tick moves all players and their bones in one message. A shot is a ray at a time in the past; its
answer names the player and, in the column of triangles, the part. The stream has a lease, so the players vanish if the
program dies.
"""
from __future__ import annotations

import math
import sys
from typing import List, Tuple

import locus

SCENE = "hit-boxes-example"
PLAYERS, TICKS = 64, 30
BODY, HEAD = 1, 2  # layers
LEASE_MS = 10_000
# Name, position, and half the length of each part, in the player's own axes: x is to the right, z is up.
LIMBS = [("left upper arm", (-0.28, 0.0, 1.3), 0.13), ("right upper arm", (0.28, 0.0, 1.3), 0.13),
         ("left forearm", (-0.28, 0.0, 1.0), 0.12), ("right forearm", (0.28, 0.0, 1.0), 0.12),
         ("left thigh", (-0.1, 0.0, 0.65), 0.17), ("right thigh", (0.1, 0.0, 0.65), 0.17),
         ("left shin", (-0.1, 0.0, 0.3), 0.15), ("right shin", (0.1, 0.0, 0.3), 0.15)]
BOXES = [("chest", (0.0, 0.0, 1.3), (0.18, 0.12, 0.15)), ("belly", (0.0, 0.0, 1.05), (0.16, 0.11, 0.1)),
         ("hips", (0.0, 0.0, 0.88), (0.17, 0.12, 0.07)), ("left hand", (-0.28, 0.0, 0.82), (0.04, 0.05, 0.06)),
         ("right hand", (0.28, 0.0, 0.82), (0.04, 0.05, 0.06)), ("left foot", (-0.1, 0.05, 0.06), (0.05, 0.13, 0.06)),
         ("right foot", (0.1, 0.05, 0.06), (0.05, 0.13, 0.06))]
HEAD_AT, HEAD_RADIUS = (0.0, 0.0, 1.65), 0.13
PARTS = ["head"] + [name for name, _, _ in BOXES] + [name for name, _, _ in LIMBS]
REST = [HEAD_AT] + [at for _, at, _ in BOXES] + [at for _, at, _ in LIMBS]


def rig() -> locus.Compound:
    """Returns the shape of a player. Its parts are numbered as in PARTS."""
    compound = locus.Compound()
    compound.balls(HEAD_AT, HEAD_RADIUS, layers=HEAD)
    compound.boxes([at for _, at, _ in BOXES], [half for _, _, half in BOXES], layers=BODY)
    compound.capsules([at for _, at, _ in LIMBS], [(0.0, 0.0, half) for _, _, half in LIMBS], 0.06, layers=BODY)
    return compound


def position(player: int, tick: int) -> Tuple[float, float, float]:
    """Returns where a player stands: all walk along y in rows of eight."""
    return (3.0 * (player % 8), 4.0 * (player // 8) + 0.1 * tick, 0.0)


def bones(player: int, tick: int) -> List[Tuple[float, float, float]]:
    """Returns the centres of the player's parts: the arms and legs swing, and the player ducks every 20 ticks."""
    swing = 0.15 * math.sin(0.5 * (tick + player))
    down = 0.4 if ducks(tick) else 0.0
    centres = []
    for name, (x, y, z) in zip(PARTS, REST):
        side = 1 if name.startswith("left") else -1 if name.startswith("right") else 0
        centres.append((x, y + side * swing, z if "foot" in name or "shin" in name else z - down))
    return centres


def ducks(tick: int) -> bool:
    return tick % 20 >= 10


def play(client: locus.Client, ticks: int = TICKS) -> locus.Revision:
    """Creates the scene and runs all ticks; returns the revision of the last one."""
    client.delete_scene(SCENE, if_present=True)
    client.create_scene(SCENE, history_ticks=64)
    ids = list(range(1, PLAYERS + 1))
    with client.update_stream(SCENE, lease_ms=LEASE_MS) as stream:
        start = [position(player, 0) for player in range(PLAYERS)]
        stream.send(locus.UpdateBatch(tick=0).insert_compounds(ids, start, rig()))
        for tick in range(1, ticks + 1):
            places = [position(player, tick) for player in range(PLAYERS)]
            poses = [bones(player, tick) for player in range(PLAYERS)]
            batch = locus.UpdateBatch(tick=tick).move(ids, places, parts_each=len(PARTS), part_positions=poses)
            done = stream.send(batch)
        return done.result()


def shoot(client: locus.Client, seen: locus.Revision, shots: List[Tuple[int, int, float, int]]) -> List[str]:
    """Fires shots along x at a player, each at a tick of the past, a height, and with a mask of layers; returns the names
    of the parts that they hit.
    """
    block = locus.Block(as_of_ticks=[tick for _, tick, _, _ in shots], masks=[mask for _, _, _, mask in shots],
                        columns=[locus.Column.ID, locus.Column.TRIANGLE])
    origins = [(position(player, tick)[0] - 1.0, position(player, tick)[1], height) for player, tick, height, _ in shots]
    batch = locus.QueryBatch(at_least=seen).rays(origins, [1.0, 0.0, 0.0], t_max=2.0, block=block)
    (hits,) = client.query(SCENE, batch).blocks
    return [PARTS[part] if hit == player + 1 else "nothing"
            for hit, part, (player, _, _, _) in zip(hits.ids, hits.triangles, shots)]


def main() -> None:
    shots = [(27, 9, 1.65, BODY | HEAD), (27, 12, 1.65, BODY | HEAD), (27, 12, 1.25, BODY | HEAD), (27, 12, 1.25, BODY),
             (40, 25, 1.05, BODY | HEAD)]
    with locus.connect(sys.argv[1] if len(sys.argv) > 1 else locus.DEFAULT_ADDRESS) as client:
        hits = shoot(client, play(client), shots)
        for (player, tick, height, mask), hit in zip(shots, hits):
            print(f"a shot at player {player}, tick {tick}, height {height}{'' if mask & HEAD else ', body only'}: {hit}")
        client.delete_scene(SCENE)


if __name__ == "__main__":
    main()
