"""Areas of interest: the things within a radius of each player, found without sending the positions of the players.

    PYTHONPATH=build/release/python /usr/bin/python3 areas_of_interest.py [ADDRESS]

Each query is anchored to a player: the position of the query is relative to the position of the player at the revision
of the answer, and the query does not find the player. A second block returns for each player only the number of objects
within twice the radius.
"""
from __future__ import annotations

import random
import sys

import locus

SCENE, PLAYERS, THINGS, RADIUS = "interest-example", 5, 500, 15.0


def make_scene(client: locus.Client) -> locus.Ack:
    """Creates the scene with players (layer 1) and things (layer 2) at random places; returns the ack."""
    numbers = random.Random(11)
    places = [[numbers.uniform(-100, 100) for _ in range(3)] for _ in range(PLAYERS + THINGS)]
    client.delete_scene(SCENE, if_present=True)
    client.create_scene(SCENE)
    batch = locus.UpdateBatch()
    batch.insert_balls(ids=list(range(1, PLAYERS + 1)), positions=places[:PLAYERS], radii=0.5, layers=1)
    batch.insert_balls(ids=list(range(1000, 1000 + THINGS)), positions=places[PLAYERS:], radii=0.5, layers=2)
    return client.apply(SCENE, batch)


def interests(client: locus.Client, ack: locus.Ack) -> tuple[list[list[int]], list[int]]:
    """Returns for each player the ids of the things around it, and the number of objects within twice the radius."""
    players = list(range(1, PLAYERS + 1))
    here = [[0, 0, 0]] * PLAYERS
    batch = locus.QueryBatch(at_least=ack)
    batch.balls(here, RADIUS, block=locus.Block(anchor_ids=players, masks=2))
    batch.balls(here, 2 * RADIUS, block=locus.Block(anchor_ids=players, count_only=True))
    around, crowds = client.query(SCENE, batch).blocks
    return [[int(found) for found in around.ids[around.rows_of(i)]] for i in range(PLAYERS)], list(map(int, crowds.counts))


def main() -> None:
    with locus.connect(sys.argv[1] if len(sys.argv) > 1 else locus.DEFAULT_ADDRESS) as client:
        around, crowds = interests(client, make_scene(client))
        for player, (things, crowd) in enumerate(zip(around, crowds), 1):
            print(f"player {player}: {len(things)} things within {RADIUS:g}, {crowd} objects within {2 * RADIUS:g}")
        client.delete_scene(SCENE)


if __name__ == "__main__":
    main()
