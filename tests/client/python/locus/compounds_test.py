"""Tests of compounds: parts in columns, objects with parts, and poses of parts."""
import array
import unittest

import locus
from locus import Block, Column, Compound, QueryBatch, UpdateBatch, columns
from support import DaemonTest, floats, listed


def rig():
    """Returns a compound of a box in a layer of its own and two capsules."""
    return Compound().boxes([0, 0, 2], [0.5, 0.25, 0.125], layers=2).capsules([[0, 0, 1], [0, 1, 1]], [0, 0, 0.5], 0.25)


class CompoundsTest(unittest.TestCase):
    def float_column(self, raw):
        return memoryview(raw).cast("f").tolist()

    def test_parts_are_numbered_in_the_order_of_the_calls(self):
        compound = rig().balls([0, 0, 3], 0.5, rotations=[0, 0, 0.6, 0.8])
        self.assertEqual(len(compound), 4)
        box, capsules, ball = compound.message.parts
        self.assertEqual([entry.WhichOneof("shape") for entry in (box, capsules, ball)], ["box", "capsule", "ball"])
        self.assertEqual(self.float_column(box.box.half_extents), [0.5, 0.25, 0.125])
        self.assertEqual((bytes(box.layers), bytes(capsules.layers)), (b"\2\0\0\0", b""))
        self.assertEqual(self.float_column(capsules.positions), [0, 0, 1, 0, 1, 1])
        self.assertEqual(self.float_column(capsules.capsule.radii), [0.25])
        self.assertEqual(self.float_column(ball.rotations), floats([0, 0, 0.6, 0.8]))

    def test_objects_of_a_call_share_a_compound_that_may_be_used_again(self):
        compound = rig()
        batch = UpdateBatch().insert_compounds([1, 2], [[0, 0, 0], [9, 0, 0]], compound, groups=7, expire_ticks=[5, 0])
        compound.balls([0, 0, 3], 1)
        batch.insert_compounds(3, [0, 0, 0], compound, layers=4)
        first, second = batch.message.inserts
        self.assertEqual((len(first.compound.parts), len(second.compound.parts)), (2, 3))
        self.assertEqual(memoryview(first.expire_ticks).cast("Q").tolist(), [5, 0])
        self.assertEqual((bytes(first.layers), bytes(second.layers)), (b"", b"\4\0\0\0"))

    def test_wrong_columns_are_named_and_add_nothing(self):
        compound = rig()
        for pattern, call in (
                (r"^parts\[2\].positions: has 2 numbers: give 3", lambda: compound.balls([1, 2], 1)),
                (r"^parts\[2\].ball.radii: has 3 entries: give 2", lambda: compound.balls([0] * 6, [1, 2, 3])),
                (r"^parts\[2\].box.half_extents: has 4 numbers", lambda: compound.boxes([0] * 3, [1] * 4)),
                (r"^parts\[2\].capsule.half_axes: has 2 entries", lambda: compound.capsules([0] * 3, [1] * 6, 1)),
                (r"^parts\[2\].rotations: has 3 numbers", lambda: compound.balls([0] * 3, 1, rotations=[0, 0, 1])),
                (r"^parts\[2\].layers: has 2 entries", lambda: compound.balls([0] * 3, 1, layers=[1, 2]))):
            with self.assertRaisesRegex(ValueError, pattern):
                call()
        self.assertEqual((len(compound), len(compound.message.parts)), (3, 2))
        with self.assertRaisesRegex(TypeError, "give a Compound"):
            UpdateBatch().insert_compounds(1, [0, 0, 0])


class LifetimesTest(unittest.TestCase):
    def test_every_insert_takes_lifetimes(self):
        batch = UpdateBatch()
        batch.insert_points([1, 2], [0] * 3, expire_ticks=[3, 4]).insert_balls(3, [0] * 3, 1, expire_ticks=5)
        batch.insert_boxes(4, [0] * 3, [1] * 3, expire_ticks=5).insert_capsules(5, [0] * 3, [1] * 3, 1, expire_ticks=5)
        lifetimes = [memoryview(insert.expire_ticks).cast("Q").tolist() for insert in batch.message.inserts]
        self.assertEqual(lifetimes, [[3, 4], [5], [5], [5]])
        with self.assertRaisesRegex(ValueError, r"^inserts\[4\].expire_ticks: has 3 entries: give 1"):
            batch.insert_points(6, [0] * 3, expire_ticks=[1, 2, 3])
        self.assertEqual(UpdateBatch(writer=1, number=1, lease_ms=2000).message.lease_ms, 2000)


class PartPosesTest(unittest.TestCase):
    def poses(self, batch):
        (move,) = batch.message.moves
        return (move.parts_each, memoryview(move.part_positions).cast("f").tolist(),
                memoryview(move.part_rotations).cast("f").tolist())

    def test_poses_are_columns_of_all_parts_or_of_one_object_for_all(self):
        flat = [float(number) for number in range(12)]
        nested = [[[0, 1, 2], [3, 4, 5]], [[6, 7, 8], [9, 10, 11]]]
        values = [flat, nested, array.array("f", flat)]
        if columns.numpy:
            values.append(columns.numpy.array(nested, "float32"))
        for value in values:
            batch = UpdateBatch().move([1, 2], [0] * 3, parts_each=2, part_positions=value)
            self.assertEqual(self.poses(batch), (2, flat, []))
        batch = UpdateBatch().move([1, 2], [0] * 3, parts_each=2, part_positions=flat[:6], part_rotations=[[0, 0, 0, 1]] * 4)
        self.assertEqual(self.poses(batch), (2, flat[:6], [0, 0, 0, 1] * 4))

    def test_wrong_poses_are_named_and_move_nothing(self):
        batch = UpdateBatch()
        for pattern, poses in (
                (r"^moves\[0\].part_positions: has 3 entries: give 4 \(2 for each object\), 2 for all, or none",
                 dict(parts_each=2, part_positions=[0] * 9)),
                (r"^moves\[0\].part_rotations: has 3 numbers: give 4", dict(parts_each=2, part_rotations=[0] * 3)),
                (r"^moves\[0\].parts_each: is 0: give the number of parts of each object, 1 to 64",
                 dict(part_positions=[0] * 6)),
                (r"^moves\[0\].parts_each: is 65:", dict(parts_each=65, part_positions=[0] * 195)),
                (r"^moves\[0\].parts_each: give part_positions or part_rotations", dict(parts_each=2))):
            with self.assertRaisesRegex(ValueError, pattern):
                batch.move([1, 2], [0] * 3, **poses)
        self.assertEqual(len(batch.message.moves), 0)


class CompoundsInScenesTest(DaemonTest):
    PARTS = Compound().balls([0, 0, 2], 0.5, layers=2).boxes([[0, 0, 0], [0, 5, 0]], [1, 1, 1], layers=1)

    def shoot(self, origin, **block):
        columns = [Column.ID, Column.TRIANGLE, Column.SHAPE]
        (hits,) = self.ask(QueryBatch().rays(origin, [0, 0, -1], block=Block(columns=columns, **block)))
        return listed(hits.ids)[0], listed(hits.triangles)[0]

    def test_answers_name_the_part(self):
        self.apply(UpdateBatch().insert_compounds([7, 8], [[0, 0, 0], [100, 0, 0]], self.PARTS))
        self.assertEqual(self.shoot([0, 0, 9]), (7, 0))
        self.assertEqual(self.shoot([0, 0, 9], masks=[1]), (7, 1))
        self.assertEqual(self.shoot([100, 5, 9]), (8, 2))

    def test_moves_set_the_poses_of_parts(self):
        self.apply(UpdateBatch().insert_compounds(7, [0, 0, 0], self.PARTS))
        poses = [[50, 0, 0], [0, 0, 0], [0, 0, 0]]
        self.assertEqual(self.apply(UpdateBatch().move(7, [0, 0, 0], parts_each=3, part_positions=poses)).refused, 0)
        self.assertEqual(self.shoot([50, 0, 9]), (7, 0))
        self.assertEqual(self.shoot([0, 5, 9])[0], 0)
        (error,) = self.apply(UpdateBatch().move(7, [0, 0, 0], parts_each=2, part_positions=poses[:2])).errors
        self.assertEqual((error.index, error.reason), (0, locus.Reason.OUT_OF_RANGE))

    def test_wrong_compounds_are_refused(self):
        for compound in (Compound(), Compound().balls([[0, 0, 0]] * 65, 1)):
            with self.assertRaises(locus.LocusError) as raised:
                self.apply(UpdateBatch().insert_compounds(1, [0, 0, 0], compound))
            self.assertEqual(raised.exception.code.name, "INVALID_ARGUMENT", raised.exception)
            self.assertIn("compound.parts", raised.exception.field)
        shapeless = UpdateBatch().insert_compounds(1, [0, 0, 0], Compound().balls([0, 0, 0], 1))
        shapeless.message.inserts[0].compound.parts[0].ClearField("ball")
        with self.assertRaises(locus.LocusError) as raised:
            self.apply(shapeless)
        self.assertEqual(raised.exception.code.name, "INVALID_ARGUMENT", raised.exception)
        self.assertEqual(self.apply(UpdateBatch().insert_compounds(1, [0, 0, 0], Compound().balls([0, 0, 0], -1))).refused, 1)
        self.assertEqual(listed(self.ask(QueryBatch().lookup(1))[0].ids), [0])
