"""One tick of an anti-wallhack filter: finds for each player the other players that this player sees or is close to.

    PYTHONPATH=build/release/python /usr/bin/python3 anti_wallhack.py [ADDRESS]

The server of a game would send each player the positions of only these other players. One call queries the sight
between all pairs of players; the result is a matrix. Each player has its own group, so that the body of a player does
not block its sight. Each body has three sample points, so that a player whose head is above a wall counts as seen.
"""
from __future__ import annotations

import random
import sys

import locus

SCENE, PLAYERS, HEAR = "wallhack-example", 8, 6.0
SAMPLES = (0.3, 1.0, 1.7)  # heights of the sample points above the feet


def make_scene(client: locus.Client, positions: list[list[float]]) -> locus.Ack:
    """Creates the scene with a capsule for each player and two walls; returns the ack."""
    client.delete_scene(SCENE, if_present=True)
    client.create_scene(SCENE)
    players = locus.UpdateBatch()
    players.insert_capsules(ids=list(range(1, PLAYERS + 1)), positions=[[x, 0.9, z] for x, _, z in positions],
                            half_axes=[0, 0.5, 0], radii=0.4, groups=list(range(1, PLAYERS + 1)))
    players.insert_boxes(ids=[100, 101], positions=[[0, 2, 5], [5, 2, 0]], half_extents=[[8, 2, 0.2], [0.2, 0.6, 8]])
    return client.apply(SCENE, players)


def visible(client: locus.Client, ack: locus.Ack, positions: list[list[float]]) -> list[list[int]]:
    """Returns for each player the indices of the other players that this player sees or is close to."""
    eyes = [[x, 1.7, z] for x, _, z in positions]
    bodies = [[x, height, z] for x, _, z in positions for height in SAMPLES]
    groups = list(range(1, PLAYERS + 1))
    batch = locus.QueryBatch(at_least=ack)
    batch.sight(eyes, bodies, samples=len(SAMPLES), viewer_groups=groups, target_groups=groups)
    batch.balls([[x, 0.9, z] for x, _, z in positions], HEAR, block=locus.Block(source=locus.Source.DYNAMIC))
    sight, near = client.query(SCENE, batch).blocks
    known = []
    for viewer in range(PLAYERS):
        row = sight.sight[viewer * PLAYERS:(viewer + 1) * PLAYERS]
        close = {int(found) - 1 for found in near.ids[near.rows_of(viewer)]}
        known.append([other for other in range(PLAYERS) if other != viewer and (row[other] or other in close)])
    return known


def main() -> None:
    numbers = random.Random(7)
    positions = [[numbers.uniform(-12, 12), 0.0, numbers.uniform(-12, 12)] for _ in range(PLAYERS)]
    with locus.connect(sys.argv[1] if len(sys.argv) > 1 else locus.DEFAULT_ADDRESS) as client:
        known = visible(client, make_scene(client, positions), positions)
        for player, others in enumerate(known):
            print(f"player {player} is sent {len(others)} of {PLAYERS - 1} others: {others}")
        client.delete_scene(SCENE)


if __name__ == "__main__":
    main()
