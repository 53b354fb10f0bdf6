"""Tests that answers in Python equal those of the command line to the last bit, for every kind of query."""
import array
import math
import random
import struct
import unittest

import locus
from locus import AtStart, Block, Column, QueryBatch, RayMode, StaticDetail, schema, wire
from support import DaemonTest, floats, listed, number

SEED = 11
ALL_COLUMNS = (Column.T, Column.ID, Column.TRIANGLE, Column.UV, Column.NORMAL, Column.POINT, Column.GROUP, Column.TAG,
               Column.LAYERS, Column.POSE)
QUAD = ([0, 0, 0, 20, 0, 0, 20, 20, 0, 0, 20, 0], [0, 1, 2, 0, 2, 3])


def text(vector):
    return ",".join(repr(value) for value in vector)


def triples(column):
    return [column[begin:begin + 3] for begin in range(0, len(column), 3)]


def cut(column, width, row):
    return column[width * row:width * row + width]


class AnswersEqualTheCommandLineTest(DaemonTest):
    def setUp(self):
        super().setUp()
        self.random = random.Random(SEED)
        self.client.upload_mesh("quad", *QUAD)
        self.client.change_instances(self.scene, locus.InstanceChange().place(
            "quad", [[-10, -10, 0], [-10, -10, -3]], ids=[1, 2], groups=[7], tags=[70, 71], rotations=[0, 0, 0, 1]))
        ids = range(100, 160)
        batch = locus.UpdateBatch(tick=5)
        batch.insert_balls(ids, self.cloud(60), [self.random.uniform(0.2, 2) for _ in ids], tags=[3 * one for one in ids])
        batch.insert_boxes([200, 201], [[0, 0, 5], [4, 4, 4]], [1, 2, 0.5], rotations=[0, 0, 0.6, 0.8], groups=[9])
        batch.insert_capsules(300, [-5, 5, 3], [0, 0, 1.5], 0.75, layers=6)
        batch.insert_points(400, [1, 1, 1])
        self.built = self.apply(batch)
        self.assertEqual(self.built.refused, 0)

    def cloud(self, count, size=10.0):
        return floats(self.random.uniform(-size, size) for _ in range(3 * count))

    def report(self, *arguments):
        return self.command_line("query", *arguments)

    def check_rays(self, mode, **settings):
        rays = 60
        origins = triples(self.cloud(rays))
        directions = triples(self.cloud(rays, 2.0))
        options = [word for pair in zip(origins, directions)
                   for word in (f"--from={text(pair[0])}", f"--dir={text(pair[1])}")]
        report = self.report("ray", self.scene, *options, "--mode", mode.name.lower(), "--columns",
                             "triangle,uv,normal,point,group,tag,layers,pose")
        (block,) = self.ask(QueryBatch().rays(origins, directions, mode=mode, block=Block(columns=ALL_COLUMNS), **settings))
        self.assertEqual(block.rows, len(report["hits"]))
        self.check_rows(block, report["hits"])
        return block, report["hits"]

    def check_rows(self, block, rows):
        widths = {"t": ("t", 1), "id": ("ids", 1), "triangle": ("triangles", 1), "uv": ("uvs", 2), "normal": ("normals", 3),
                  "point": ("points", 3), "group": ("groups", 1), "tag": ("tags", 1), "layers": ("layers", 1),
                  "position": ("positions", 3), "rotation": ("rotations", 4)}
        for row, shown in enumerate(rows):
            hit = shown.get("hit", True)
            self.assertEqual(listed(block.ids)[row] != 0, hit)
            for name in set(shown) & set(widths) if hit else ():
                column, width = widths[name]
                found = cut(listed(getattr(block, column)), width, row)
                if shown[name] is None:
                    self.assertEqual(found, [locus.NO_TRIANGLE])
                    continue
                wanted = shown[name] if isinstance(shown[name], list) else [shown[name]]
                wanted = [number(value) if isinstance(value, str) else value for value in wanted]
                self.assertEqual(found, wanted if column == "positions" else
                                 floats(wanted) if isinstance(found[0], float) else wanted, f"{name} of row {row}")

    def test_first_hits(self):
        block, rows = self.check_rays(RayMode.FIRST)
        self.assertEqual(block.rows, 60)
        self.assertIn(True, [row["hit"] for row in rows])
        self.assertIn(False, [row["hit"] for row in rows])
        missed = next(row for row, shown in enumerate(rows) if not shown["hit"])
        self.assertEqual((listed(block.t)[missed], listed(block.triangles)[missed]), (math.inf, locus.NO_TRIANGLE))

    def test_all_hits_by_ray(self):
        block, rows = self.check_rays(RayMode.ALL)
        self.assertEqual(sum(listed(block.counts)), len(rows))
        for ray in range(60):
            self.assertEqual(block.ids[block.rows_of(ray)].tolist(), [int(row["id"]) for row in rows if row["ray"] == ray])

    def test_any_hit(self):
        origins = triples(self.cloud(40))
        options = [f"--from={text(origin)}" for origin in origins]
        report = self.report("ray", self.scene, *options, "--dir=0,0,-1", "--mode", "any")
        (block,) = self.ask(QueryBatch().rays(origins, [0, 0, -1], mode=RayMode.ANY))
        self.assertEqual([bool(hit) for hit in block.hits], [row["hit"] for row in report["rays"]])
        self.assertEqual(block.rows, 0)

    def check_overlaps(self, kind, options, batch, key=None):
        report = self.report(kind, self.scene, *options)
        (block,) = self.ask(batch)
        rows = report[next(key for key, value in report.items() if isinstance(value, list))]
        found = [(query, one) for query in range(len(block.counts)) for one in block.ids[block.rows_of(query)].tolist()]
        self.assertEqual(found, [(row[key or kind], int(row["id"])) for row in rows])
        self.assertGreater(len(rows), 20)
        if len(block.triangles):
            self.assertEqual([one if one != locus.NO_TRIANGLE else None for one in listed(block.triangles)],
                             [row["triangle"] for row in rows])

    def test_balls(self):
        centers = triples(self.cloud(30))
        radii = floats(self.random.uniform(0, 4) for _ in range(30))
        options = [word for center, radius in zip(centers, radii)
                   for word in (f"--at={text(center)}", f"--radius={radius!r}")]
        self.check_overlaps("ball", options, QueryBatch().balls(centers, radii))

    def test_capsules(self):
        starts, ends = triples(self.cloud(20)), triples(self.cloud(20))
        balls, points, capsules, reversed_capsules = self.ask(
            QueryBatch().balls(starts, 2).capsules(starts, starts, 2).capsules(starts, ends, 2).capsules(ends, starts, 2))
        self.assertEqual(listed(points.ids), listed(balls.ids))
        self.assertEqual(listed(points.counts), listed(balls.counts))
        self.assertEqual(listed(capsules.ids), listed(reversed_capsules.ids))
        for query in range(20):
            self.assertLessEqual(set(balls.ids[balls.rows_of(query)].tolist()),
                                 set(capsules.ids[capsules.rows_of(query)].tolist()))
        self.assertGreater(len(capsules.ids), len(balls.ids))

    def test_sweeps(self):
        starts, ends = triples(self.cloud(20)), triples(self.cloud(20))
        batch = QueryBatch().rays(starts, [b - a for start, end in zip(starts, ends) for a, b in zip(start, end)], t_max=1)
        batch.sweeps(starts, ends, 0.001).sweeps(starts, ends, 0.001, half_axes=(0, 0, 2))
        batch.sweeps(starts, ends, half_extents=(1, 2, 3), rotations=(0.6, 0, 0, 0.8), mode=RayMode.ANY)
        batch.sweeps(starts, ends, 2, at_start=AtStart.PASS, mode=RayMode.ALL)
        rays, balls, capsules, boxes, passing = self.ask(batch)
        for query in range(20):
            self.assertLessEqual(balls.t[query], rays.t[query])
            self.assertLessEqual(capsules.t[query], balls.t[query])
            self.assertLessEqual(capsules.ids[query] != 0, boxes.hits[query] != 0)
        self.assertGreater(len(passing.ids), 0)
        self.assertGreater(min(passing.t), 0)

    def test_triangles_of_balls(self):
        options = [word for height in range(-5, 5) for word in (f"--at=0,0,{height}",)] + ["--radius=6", "--detail", "sorted"]
        centers = [(0, 0, height) for height in range(-5, 5)]
        self.check_overlaps("ball", options, QueryBatch().balls(centers, 6, detail=StaticDetail.TRIANGLES_SORTED))

    def test_rotated_boxes(self):
        centers = triples(self.cloud(20))
        options = [f"--at={text(center)}" for center in centers] + ["--half=3,2,1", "--rotation=0.6,0,0,0.8"]
        self.check_overlaps("box", options, QueryBatch().boxes(centers, (3, 2, 1), rotations=(0.6, 0, 0, 0.8)))

    def test_boxes_report_the_shortest_way_out(self):
        wanted = Block(columns=[Column.T, Column.ID, Column.NORMAL, Column.POINT], source=locus.Source.STATIC)
        (block,) = self.ask(QueryBatch().boxes([-9, -9, 0.25], [1, 1, 1], block=wanted))
        self.assertEqual(listed(block.ids), [1])
        self.assertAlmostEqual(block.t[0], -0.75, places=6)
        self.assertEqual(listed(block.normals), [0, 0, 1])
        self.assertAlmostEqual(listed(block.points)[2], 0, places=6)

    def test_nearest(self):
        points = triples(self.cloud(30))
        options = [f"--at={text(point)}" for point in points] + ["--k=4", "--max-distance=20"]
        batch = QueryBatch().nearest(points, k=4, max_distances=20)
        self.check_overlaps("nearest", options, batch, "query")
        (block,) = self.ask(batch)
        for query in range(len(points)):
            distances = listed(block.t)[block.rows_of(query)]
            self.assertEqual(distances, sorted(distances))

    def test_lookups(self):
        ids = [1, 100, 159, 200, 300, 400]
        report = self.command_line("get", self.scene, *[f"--id={one}" for one in ids])
        columns = Block(columns=[Column.ID, Column.SHAPE, Column.POSE, Column.GROUP, Column.TAG, Column.LAYERS])
        (block,) = self.ask(QueryBatch().lookup(ids, block=columns))
        rows = report[next(key for key, value in report.items() if isinstance(value, list))]
        self.assertEqual(len(rows), len(ids))
        self.check_rows(block, rows)
        self.assertIn(5, listed(block.shapes), "an instance")
        names = [None, "point", "ball", "box", "capsule", "instance"]
        for row, shown in enumerate(rows):
            self.assertEqual(shown["shape"], names[listed(block.shapes)[row]])
            size = shown["scale"] if shown["shape"] == "instance" else shown["radius"] or 0
            vector = shown["half"] or shown["axis"] or [0, 0, 0]
            self.assertEqual(cut(listed(block.sizes), 4, row), floats([size, *vector]))

    def test_lookups_of_groups(self):
        (block,) = self.ask(QueryBatch().lookup_groups([9, 7, 8]))
        self.assertEqual((listed(block.counts), listed(block.ids)), ([2, 2, 0], [200, 201, 1, 2]))

    def test_settings_of_a_block_reach_the_server(self):
        block = Block(source=locus.Source.DYNAMIC, masks=6, ignore_ids=[100], max_results=1, columns=[Column.ID, Column.LAYERS])
        (found,) = self.ask(QueryBatch().balls([-5, 5, 3], 20, block=block))
        self.assertEqual((listed(found.ids), listed(found.layers)), ([300], [6]))

    def test_truncated_queries_are_listed_and_continue_with_after_id(self):
        (first,) = self.ask(QueryBatch().balls([0, 0, 0], 30, block=Block(max_results=10)))
        self.assertEqual((listed(first.truncated), first.rows), ([0], 10))
        last = listed(first.ids)[-1]
        (rest,) = self.ask(QueryBatch().balls([0, 0, 0], 30, block=Block(after_id=last)))
        (whole,) = self.ask(QueryBatch().balls([0, 0, 0], 30))
        self.assertEqual(listed(first.ids) + listed(rest.ids), listed(whole.ids))

    def test_each_query_ignores_its_own_group(self):
        passing = Block(ignore_groups=[9, 0], ignore_ids=range(100, 160))
        (block,) = self.ask(QueryBatch().rays([[0, 0, 30]] * 2, [0, 0, -1], block=passing))
        self.assertEqual(listed(block.ids), [1, 200])

    def test_each_query_finds_only_some_groups_one_tag_and_not_itself(self):
        everything = [[0, 0, 0]] * 3
        (whole,) = self.ask(QueryBatch().balls([0, 0, 0], 100, block=Block(columns=[Column.ID, Column.GROUP, Column.TAG])))
        ids, groups, tags = listed(whole.ids), listed(whole.groups), listed(whole.tags)
        of_groups = Block(only_groups=[7, 0, 7, 9, 0, 0], only_groups_each=2)
        (block,) = self.ask(QueryBatch().balls(everything, 100, block=of_groups))
        wanted = [[i for i, group in zip(ids, groups) if group in some] for some in ((7,), (7, 9))] + [ids]
        self.assertEqual(listed(block.ids), sum(wanted, []))
        self.assertEqual(listed(block.counts), [len(rows) for rows in wanted])
        tag = max(tags)
        (block,) = self.ask(QueryBatch().balls([0, 0, 0], 100, block=Block(tags=tag)))
        self.assertEqual(listed(block.ids), [i for i, found in zip(ids, tags) if found == tag])
        (block,) = self.ask(QueryBatch().balls([0, 0, 0], 100, block=Block(tags=0, tag_masks=1)))
        self.assertEqual(listed(block.ids), [i for i, found in zip(ids, tags) if found % 2 == 0])
        (block,) = self.ask(QueryBatch().balls(everything, 100, block=Block(self_ids=[ids[0], ids[1], 0])))
        self.assertEqual(listed(block.ids), ids[1:] + ids[:1] + ids[2:] + ids)
        with self.assertRaisesRegex(ValueError, r"^blocks\[0\].only_groups: has 3 numbers: give 2"):
            QueryBatch().balls(everything, 1, block=Block(only_groups=[1, 2, 3], only_groups_each=2))
        with self.assertRaises(locus.LocusError) as raised:
            self.ask(QueryBatch().balls(everything, 1, block=Block(tag_masks=1)))
        self.assertRefused(raised.exception, "INVALID_ARGUMENT", "MALFORMED", "blocks[0].tag_masks")

    def test_one_origin_and_a_rotation_serve_all_directions(self):
        beams = [(0, 0, 1), (1, 0, 0), (0, 1, 0)]
        quarter = (0, 0, 0.5 ** 0.5, 0.5 ** 0.5)  # about z: x becomes y, y becomes -x
        (block,) = self.ask(QueryBatch().rays([-9, -9, 0.5], beams, t_max=[5, 6, 7], block=Block(rotation=quarter)))
        (wanted,) = self.ask(QueryBatch().rays([[-9, -9, 0.5]] * 3, [(0, 0, 1), (0, 1, 0), (-1, 0, 0)], t_max=[5, 6, 7]))
        self.assertEqual(listed(block.ids), listed(wanted.ids))
        for got, exact in zip(listed(block.t), listed(wanted.t)):
            self.assertTrue(got == exact or abs(got - exact) < 1e-5)
        for rotation, reason in (((0, 0, 0, 2), "OUT_OF_RANGE"), ((0, 0, float("nan"), 1), "NOT_FINITE")):
            with self.assertRaises(locus.LocusError) as raised:
                self.ask(QueryBatch().rays([0, 0, 0], beams, block=Block(rotation=rotation)))
            self.assertRefused(raised.exception, "INVALID_ARGUMENT", reason, "blocks[0].rotation")
        with self.assertRaisesRegex(ValueError, r"^blocks\[0\].rotation: has 3 numbers: give 4"):
            QueryBatch().rays([0, 0, 0], beams, block=Block(rotation=(0, 0, 1)))

    def test_positions_and_answers_are_relative_to_the_frame(self):
        far = 1_000_000.25
        self.apply(locus.UpdateBatch(frame=(far, 0, 0)).insert_balls(5, [0, 0, 0], 0.5))
        (block,) = self.ask(QueryBatch().rays([0, 0, 10], [0, 0, -1], block=Block(frame=(far, 0, 0), columns=ALL_COLUMNS)))
        self.assertEqual((listed(block.ids), listed(block.t), listed(block.points)), ([5], [9.5], [0, 0, 0.5]))
        self.assertEqual(listed(block.positions), [far, 0, 0])

    def test_every_form_of_a_column_gives_the_same_answer(self):
        origins = self.cloud(50)
        forms = (origins, triples(origins), array.array("f", origins), array.array("f", origins).tobytes())
        answers = {tuple(listed(self.ask(QueryBatch().rays(form, [0, 0, -1]))[0].t)) for form in forms}
        self.assertEqual(len(answers), 1)

    def test_the_server_writes_each_column_once_and_whole(self):
        batch = QueryBatch().balls([0, 0, 0] * 1000, 30, block=Block(columns=[Column.ID, Column.POSE, Column.TAG, Column.LAYERS]))
        batch.rays([0, 0, 30] * 2000, [0, 0, -1], block=Block(columns=ALL_COLUMNS))
        raw = self.client.query_bytes(self.scene, batch.request_bytes(self.scene))
        self.assertGreater(len(raw), 2_000_000)
        result = wire.fields(wire.fields(memoryview(raw))[1][0])
        self.assertEqual(len(result[4]), 2)
        for block in result[4]:
            self.assertEqual({len(pieces) for pieces in wire.fields(block).values()}, {1})

    def test_blocks_come_back_in_order_at_one_revision(self):
        batch = QueryBatch(at_least=self.built, explain=True)
        batch.lookup([1]).rays([0, 0, 9], [0, 0, -1]).balls([0, 0, 5], 0).boxes([0, 0, 5], [0, 0, 0])
        result = self.client.query(self.scene, batch)
        self.assertEqual([listed(block.ids)[0] for block in result.blocks], [1, 200, 200, 200])
        self.assertEqual((result.epoch, result.revision, result.tick), (self.built.epoch, self.built.revision, 5))
        self.assertGreater(result.work.tests, 0)
        self.assertGreater(result.blocks[1].work.tests, 0)


    def test_answers_by_list_have_the_same_bytes(self):
        def ask(**options):
            batch = QueryBatch(at_least=self.built, **options)
            batch.lookup([1]).rays([0, 0, 9], [0, 0, -1]).balls([0, 0, 5], 2).nearest([0, 0, 5], k=3)
            return self.client.query(self.scene, batch)
        searched, result = ask(), ask(by_list=True)
        for found, wanted in zip(result.blocks, searched.blocks):
            self.assertEqual(bytes(found.ids), bytes(wanted.ids))
            self.assertEqual(bytes(found.t), bytes(wanted.t))
        work = ask(by_list=True, explain=True).blocks[2].work
        self.assertEqual((work.nodes, work.cells), (0, 0))


class ViewTest(DaemonTest):
    def test_a_batch_sees_the_revision_it_names(self):
        first = self.apply(locus.UpdateBatch().insert_balls(1, [0, 0, 0], 1))
        second = self.apply(locus.UpdateBatch().move(1, [5, 0, 0]))
        for view, x in ((dict(exactly=first), 0), (dict(at_least=first), 5), (dict(exactly=second), 5)):
            result = self.client.query(self.scene, QueryBatch(**view).lookup(1))
            self.assertEqual(listed(result.blocks[0].positions)[0], x)

    def test_another_epoch_is_refused(self):
        ack = self.apply(locus.UpdateBatch().insert_balls(1, [0, 0, 0], 1))
        self.client.delete_scene(self.scene)
        self.client.create_scene(self.scene)
        with self.assertRaises(locus.LocusError) as raised:
            self.ask(QueryBatch(at_least=ack).lookup(1))
        self.assertRefused(raised.exception, "FAILED_PRECONDITION", "SCENE_RESTARTED")

    def test_two_views_exclude_each_other(self):
        with self.assertRaisesRegex(ValueError, "at_least or exactly, not both"):
            QueryBatch(at_least=locus.Revision(1, 1), exactly=locus.Revision(1, 1))


class RefusalTest(DaemonTest):
    def test_a_column_of_a_wrong_length_is_named(self):
        with self.assertRaisesRegex(ValueError, r"^blocks\[1\].rays.directions: has 2 entries: give 3, one for all, or none"):
            QueryBatch().lookup(1).rays([0] * 9, [0] * 6)
        with self.assertRaisesRegex(ValueError, r"^blocks\[0\].masks: has 2 entries: give 1"):
            QueryBatch().lookup(1, block=Block(masks=[1, 2]))

    def test_a_column_of_a_wrong_type_is_named(self):
        with self.assertRaisesRegex(TypeError, r"^blocks\[0\].balls.radii: holds float64, but float32 is wanted"):
            QueryBatch().balls([0, 0, 0], array.array("d", [1]))

    def test_a_refused_block_is_not_added_to_the_batch(self):
        batch = QueryBatch().lookup(1)
        with self.assertRaises(TypeError):
            batch.rays([0, 0, 0], "up")
        self.assertEqual(len(self.ask(batch)), 1)

    def test_a_wrong_value_is_refused_by_the_server_with_its_field_and_index(self):
        with self.assertRaises(locus.LocusError) as raised:
            self.ask(QueryBatch().lookup(1).rays([[0, 0, 0]] * 3, [[0, 0, 1], [0, 0, 1], [0, 0, 0]]))
        self.assertRefused(raised.exception, "INVALID_ARGUMENT", "OUT_OF_RANGE", "blocks[1].rays.directions")
        self.assertEqual(raised.exception.index, 2)


class RequestBytesTest(unittest.TestCase):
    """Tests of hand-written framing: protobuf decodes the batches to the expected fields."""

    def test_every_field_has_the_number_of_the_schema(self):
        settings = Block(frame=(1.5, 0, -2), source=locus.Source.STATIC, precision=locus.Precision.CONSERVATIVE,
                         columns=[Column.ID, Column.LAYERS], masks=[1, 2], ignore_groups=[3], ignore_ids=[4, 5], max_results=600,
                         after_id=2**63, as_of_ticks=[11, 12], as_of_fractions=0.5,
                         outside_history=locus.OutsideHistory.CLAMP, only_groups=[1, 2, 3, 4], only_groups_each=2, tags=5,
                         tag_masks=[6, 7], self_ids=8, rotation=[0, 0, 0, 1])
        batch = QueryBatch(at_least=locus.Revision(7, 8), max_work=9, explain=True, max_reply_bytes=10, by_list=True)
        batch.rays([0] * 6, [1, 0, 0], t_max=[5, 6], mode=RayMode.ALL, cull=locus.Cull.BACK, inside=locus.Inside.SKIP,
                   block=settings)
        batch.balls([1, 2, 3], 4, detail=StaticDetail.TRIANGLES)
        batch.boxes([1, 2, 3], [4, 5, 6], rotations=[0, 0, 0, 1]).lookup([7, 8]).lookup_groups(9)
        batch.nearest([1, 2, 3], k=5, max_distances=6, detail=StaticDetail.TRIANGLES)
        found = schema.message("QueryRequest").FromString(batch.request_bytes("arena"))
        wanted = schema.message("QueryRequest")(scene="arena")
        view, blocks = wanted.batch.view, wanted.batch.blocks
        view.epoch, view.at_least = 7, 8
        wanted.batch.max_work, wanted.batch.explain, wanted.batch.max_reply_bytes = 9, True, 10
        wanted.batch.by_list = True
        first = blocks.add(source=2, precision=2, columns=[2, 9], masks=struct.pack("<2I", 1, 2), max_results=600,
                           ignore_groups=struct.pack("<Q", 3), ignore_ids=struct.pack("<2Q", 4, 5), after_id=2**63,
                           as_of_ticks=struct.pack("<2Q", 11, 12), as_of_fractions=struct.pack("<f", 0.5),
                           outside_history=2, only_groups=struct.pack("<4Q", 1, 2, 3, 4), only_groups_each=2,
                           tags=struct.pack("<Q", 5), tag_masks=struct.pack("<2Q", 6, 7), self_ids=struct.pack("<Q", 8),
                           rotation=struct.pack("<4f", 0, 0, 0, 1))
        first.frame.x, first.frame.y, first.frame.z = 1.5, 0, -2
        first.rays.MergeFrom(schema.message("Rays")(origins=bytes(24), directions=struct.pack("<3f", 1, 0, 0),
                                                    t_max=struct.pack("<2f", 5, 6), mode=3, cull=2, inside=3))
        blocks.add().balls.MergeFrom(schema.message("Balls")(
            centers=struct.pack("<3f", 1, 2, 3), radii=struct.pack("<f", 4), detail=2))
        blocks.add().boxes.MergeFrom(schema.message("Boxes")(
            centers=struct.pack("<3f", 1, 2, 3), half_extents=struct.pack("<3f", 4, 5, 6),
            rotations=struct.pack("<4f", 0, 0, 0, 1), detail=1))
        blocks.add().lookup.ids = struct.pack("<2Q", 7, 8)
        blocks.add().lookup.groups = struct.pack("<Q", 9)
        blocks.add().nearest.MergeFrom(schema.message("Nearest")(
            points=struct.pack("<3f", 1, 2, 3), max_distances=struct.pack("<f", 6), k=5, detail=2))
        self.assertEqual(found, wanted)
        self.assertEqual(schema.message("QueryBatch").FromString(batch.batch_bytes()), wanted.batch)

    def test_kinds_beyond_rays_and_overlaps_have_the_numbers_of_the_schema(self):
        batch = QueryBatch()
        batch.frustums([[1] * 16], planes_each=4, detail=StaticDetail.TRIANGLES)
        batch.views([2] * 32, clip_depth=locus.ClipDepth.MINUS_ONE_TO_ONE)
        batch.contains([1, 2, 3], block=Block(anchor_ids=[7], count_only=True))
        batch.sight([1] * 12, [2] * 9, eyes=2, samples=3, viewer_groups=[4, 5], target_groups=6, max_distances=[7, 8],
                    pairwise=True)
        batch.pairs(2.5, first_mask=1, second_mask=6, k=3, after_other=11, block=Block(after_id=10))
        batch.cells([1, 2, 3], 40, max_planes=12)
        batch.nearest([1, 2, 3], after=locus.After([2.5], [8], [9]))
        found = schema.message("QueryBatch").FromString(batch.batch_bytes())
        wanted = schema.message("QueryBatch")()
        blocks = wanted.blocks
        floats = lambda *values: struct.pack(f"<{len(values)}f", *values)
        blocks.add().frustums.MergeFrom(schema.message("Frustums")(planes=floats(*[1] * 16), planes_each=4, detail=2))
        blocks.add().frustums.MergeFrom(schema.message("Frustums")(view_projections=floats(*[2] * 32), clip_depth=2,
                                                                   detail=1))
        anchored = blocks.add(anchor_ids=struct.pack("<Q", 7), count_only=True)
        anchored.contains.points = floats(1, 2, 3)
        blocks.add().sight.MergeFrom(schema.message("Sight")(
            viewers=floats(*[1] * 12), viewer_groups=struct.pack("<2Q", 4, 5), targets=floats(*[2] * 9),
            target_groups=struct.pack("<Q", 6), samples_per_target=3, eyes_per_viewer=2, max_distances=floats(7, 8),
            pairwise=True))
        pairs = blocks.add(after_id=10)
        pairs.pairs.MergeFrom(schema.message("Pairs")(max_distance=2.5, first_mask=1, second_mask=6, k=3, after_other=11))
        blocks.add().cells.MergeFrom(schema.message("Cells")(points=floats(1, 2, 3), max_distances=floats(40),
                                                             max_planes=12))
        blocks.add().nearest.MergeFrom(schema.message("Nearest")(
            points=floats(1, 2, 3), k=1, detail=1, after_ts=floats(2.5), after_ids=struct.pack("<Q", 8),
            after_triangles=struct.pack("<I", 9)))
        self.assertEqual(found, wanted)

    def test_an_empty_block_keeps_its_kind(self):
        found = schema.message("QueryRequest").FromString(QueryBatch().balls([], []).request_bytes("arena"))
        self.assertEqual(found.batch.blocks[0].WhichOneof("kind"), "balls")

    def test_buffers_are_read_when_the_batch_is_sent(self):
        origins = array.array("f", [0, 0, 0])
        batch = QueryBatch().rays(origins, [0, 0, -1])
        origins[2] = 9
        found = schema.message("QueryRequest").FromString(batch.request_bytes("arena"))
        self.assertEqual(found.batch.blocks[0].rays.origins, struct.pack("<3f", 0, 0, 9))

    def test_settings_that_do_not_fit_their_field_are_refused(self):
        for make in (lambda: QueryBatch(max_work=-1), lambda: QueryBatch(max_reply_bytes=2**32),
                     lambda: QueryBatch().lookup(1, block=Block(max_results=-1))):
            with self.assertRaises(OverflowError):
                make()
