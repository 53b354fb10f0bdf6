"""Load during an upgrade of locusd: streams inserts, and queries what was acknowledged, until a file appears. It runs in the
root, with the client of python3-locus and its usual options:

    python3 upgrade_load.py STOP_FILE

Prints one line of JSON at the end: the number of acknowledged inserts, the longest time between two acks, and how many
queries were answered, and wrongly or not at all.
"""

import collections
import json
import os
import sys
import threading
import time

import locus

ADDRESS, SCENE, BATCH = "127.0.0.1:7575", "upgrade", 10


class Load:
    def __init__(self, stop_file):
        self.stop_file = stop_file
        self.acked = 0  # objects 1 to `acked` are acknowledged
        self.longest_gap = 0.0
        self.answered = 0
        self.problems = []

    def running(self):
        return not os.path.exists(self.stop_file)

    def insert(self, client):
        waiting, last, first = collections.deque(), time.monotonic(), 1
        with client.update_stream(SCENE) as stream:
            while self.running() or waiting:
                if self.running():
                    ids = list(range(first, first + BATCH))
                    first += BATCH
                    waiting.append((ids[-1], stream.send(locus.UpdateBatch().insert_balls(
                        ids=ids, positions=[[float(number), 0.0, 0.0] for number in ids], radii=0.25))))
                while waiting and (waiting[0][1].done() or not self.running()):
                    ack = waiting[0][1].result()
                    now = time.monotonic()
                    self.longest_gap, last = max(self.longest_gap, now - last), now
                    if ack.refused:
                        raise RuntimeError(f"refused: {ack.refused}")
                    self.acked = waiting.popleft()[0]
                time.sleep(0.005)

    def query(self, client):
        """Asks for the object that was acknowledged last, by a ray, as long as there is load."""
        while self.running():
            newest = self.acked
            if newest:
                rays = locus.QueryBatch().rays(origins=[[float(newest), 0.0, 10.0]], directions=[[0.0, 0.0, -1.0]])
                try:
                    hits = client.query(SCENE, rays).blocks[0]
                    if list(hits.ids) != [newest]:
                        self.problems.append(f"object {newest} is not found but {list(hits.ids)}")
                except locus.LocusError as error:
                    self.problems.append(str(error))
                self.answered += 1
            time.sleep(0.01)


def main():
    load = Load(sys.argv[1])
    with locus.connect(ADDRESS) as client, locus.connect(ADDRESS) as reader:
        client.create_scene(SCENE)
        thread = threading.Thread(target=load.query, args=(reader,))
        thread.start()
        try:
            load.insert(client)
        finally:
            with open(load.stop_file, "w", encoding="utf-8"):
                pass
            thread.join()
    print(json.dumps({"acked": load.acked, "longest_gap_s": round(load.longest_gap, 2), "queries": load.answered,
                      "problems": load.problems[:5]}))


if __name__ == "__main__":
    main()
