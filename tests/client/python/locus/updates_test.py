"""Tests of update batches: changes by columns, checked by lookups; refused items and refused batches."""
import array
import unittest

import locus
from locus import Block, Column, QueryBatch, UpdateBatch
from support import DaemonTest, floats, listed

EVERYTHING = Block(columns=[Column.ID, Column.POSE, Column.GROUP, Column.TAG, Column.LAYERS])


class UpdatesTest(DaemonTest):
    def found(self, *ids):
        """Returns the rows of a lookup."""
        return self.ask(QueryBatch().lookup(list(ids), block=EVERYTHING))[0]

    def test_every_shape_is_inserted_with_all_its_columns(self):
        labels = dict(layers=[1, 2], groups=[5, 6], tags=[2**64 - 1, 8], rotations=[0, 0, 0.6, 0.8])
        batch = UpdateBatch()
        batch.insert_points([1, 2], [[0, 0, 0], [1, 0, 0]], **labels)
        batch.insert_balls([3, 4], [[0, 9, 0], [1, 9, 0]], [0.5, 0.25], **labels)
        batch.insert_boxes([5, 6], [[0, 0, 9], [5, 0, 9]], [1, 2, 3], **labels)
        batch.insert_capsules([7, 8], [[9, 9, 9], [9, 19, 9]], [0, 0, 2], [0.5], **labels)
        ack = self.apply(batch)
        self.assertEqual((ack.applied, ack.refused, ack.errors, ack.revision), (8, 0, (), 1))
        rows = self.found(*range(1, 9))
        self.assertEqual(listed(rows.ids), list(range(1, 9)))
        self.assertEqual((listed(rows.layers), listed(rows.groups)), ([1, 2] * 4, [5, 6] * 4))
        self.assertEqual(listed(rows.tags), [2**64 - 1, 8] * 4)
        self.assertEqual(listed(rows.rotations), floats([0, 0, 0.6, 0.8]) * 8)
        (touched,) = self.ask(QueryBatch().rays([[0, 9, 9], [0.5, 0.5, 20], [9, 9, 20]], [0, 0, -1]))
        self.assertEqual(listed(touched.ids), [3, 5, 7])

    def test_positions_are_relative_floats_or_absolute_doubles(self):
        exact = [0.1, 1e8 + 0.1, -3.0]
        batch = UpdateBatch(frame=(1000.0, 0, 0))
        batch.insert_points(1, [0.5, 0, 0]).insert_points(2, positions_f64=exact)
        self.apply(batch)
        self.assertEqual(listed(self.found(1, 2).positions), [1000.5, 0, 0, *exact])

    def test_moves_without_rotations_keep_them(self):
        self.apply(UpdateBatch().insert_boxes([1, 2], [0] * 6, [1, 1, 1], rotations=[0, 0, 0.6, 0.8]))
        self.apply(UpdateBatch().move(1, [1, 2, 3]).move(2, positions_f64=[4, 5, 6], rotations=[0, 0, 0, 1], teleport=True))
        rows = self.found(1, 2)
        self.assertEqual(listed(rows.positions), [1, 2, 3, 4, 5, 6])
        self.assertEqual(listed(rows.rotations), floats([0, 0, 0.6, 0.8]) + [0, 0, 0, 1])

    def test_relabels_change_only_the_given_labels(self):
        self.apply(UpdateBatch().insert_points(1, [0, 0, 0], layers=3, groups=4, tags=5))
        self.apply(UpdateBatch().relabel(1, tags=6))
        rows = self.found(1)
        self.assertEqual((listed(rows.layers), listed(rows.groups), listed(rows.tags)), ([3], [4], [6]))

    def test_removes_take_ids_and_groups_and_add_up(self):
        self.apply(UpdateBatch().insert_points(range(1, 7), [0, 0, 0], groups=[0, 0, 0, 8, 8, 9]))
        self.apply(UpdateBatch().remove(1).remove(array.array("Q", [2])).remove_groups(8))
        self.assertEqual(listed(self.found(*range(1, 7)).ids), [0, 0, 3, 0, 0, 6])

    def test_settings_of_a_batch_reach_the_server(self):
        self.apply(UpdateBatch(tick=9).insert_points([1, 2], [0, 0, 0]))
        self.assertEqual(self.apply(UpdateBatch(upsert=True, tick=3).insert_points(1, [7, 0, 0])).tick, 9)
        self.assertEqual(self.apply(UpdateBatch(restart_ticks=True, tick=3).insert_points(3, [0, 0, 0])).tick, 3)
        self.apply(UpdateBatch(clear=True).insert_points(4, [0, 0, 0]))
        self.assertEqual(listed(self.found(1, 2, 3, 4).ids), [0, 0, 0, 4])

    def test_a_batch_without_changes_makes_no_revision(self):
        self.assertEqual(self.apply(UpdateBatch()).revision, 0)

    def test_a_wrong_item_is_refused_alone_and_listed(self):
        self.apply(UpdateBatch().insert_balls([1, 2], [0, 0, 0], 1))
        ack = self.apply(UpdateBatch().move([1, 99, 2], [[1, 0, 0], [2, 0, 0], [float("nan"), 0, 0]]))
        self.assertEqual((ack.applied, ack.refused), (1, 2))
        self.assertEqual([(error.field, error.index, error.id, error.reason) for error in ack.errors],
                         [("moves[0].ids", 1, 99, locus.Reason.UNKNOWN_ID),
                          ("moves[0].positions", 2, 2, locus.Reason.NOT_FINITE)])

    def test_all_or_nothing_refuses_the_batch_and_names_the_item(self):
        with self.assertRaises(locus.LocusError) as raised:
            self.apply(UpdateBatch(all_or_nothing=True).insert_points([1, 1], [0, 0, 0]))
        self.assertRefused(raised.exception, "INVALID_ARGUMENT", "DUPLICATE_ID", "inserts[0].ids")
        self.assertEqual(listed(self.found(1).ids), [0])

    def test_a_numbered_batch_is_applied_once(self):
        batch = UpdateBatch(writer=77, number=1).insert_points(1, [0, 0, 0])
        first, again = self.apply(batch), self.apply(batch)
        self.assertEqual((first.duplicate, again.duplicate, again.revision), (False, True, first.revision))

    def test_a_gap_in_the_batch_numbers_is_refused(self):
        with self.assertRaises(locus.LocusError) as raised:
            self.apply(UpdateBatch(writer=78, number=5).insert_points(1, [0, 0, 0]))
        self.assertRefused(raised.exception, "FAILED_PRECONDITION", "BATCH_GAP")
        self.assertEqual((raised.exception.limit_value, raised.exception.asked), (1, 5))

    def test_a_batch_without_positions_is_refused_by_the_server(self):
        with self.assertRaises(locus.LocusError) as raised:
            self.apply(UpdateBatch().insert_balls(1, radii=1))
        self.assertRefused(raised.exception, "INVALID_ARGUMENT", "MALFORMED", "inserts[0].positions")


class ColumnsOfBatchesTest(unittest.TestCase):
    def test_wrong_columns_are_named_with_their_entry(self):
        batch = UpdateBatch().move(1, [0, 0, 0])
        for pattern, call in (
                (r"^moves\[1\].positions: has 2 entries: give 3", lambda: batch.move([1, 2, 3], [0] * 6)),
                (r"^moves\[1\].rotations: has 3 numbers: give 4", lambda: batch.move(1, [0] * 3, rotations=[0, 0, 1])),
                (r"^inserts\[0\].capsule.half_axes: has 2 numbers: give 3",
                 lambda: batch.insert_capsules(1, [0] * 3, [1, 1], 1)),
                (r"^inserts\[0\].ball.radii: has 2 entries: give 1", lambda: batch.insert_balls(1, [0] * 3, [1, 1])),
                (r"^relabels\[0\].tags: has 2 entries: give 1", lambda: batch.relabel(1, tags=[1, 2])),
                (r"^remove_ids: has 3 bytes", lambda: batch.remove(b"123"))):
            with self.assertRaisesRegex(ValueError, pattern):
                call()
        with self.assertRaisesRegex(ValueError, "^frame: has 2 numbers"):
            UpdateBatch(frame=(1, 2))

    def test_a_refused_entry_is_not_added_to_the_batch(self):
        batch = UpdateBatch().move(1, [0, 0, 0])
        before = batch.request_bytes("arena")
        for call in (lambda: batch.move("x", [0] * 3), lambda: batch.insert_boxes(1, [0] * 3, array.array("d", [1, 1, 1])),
                     lambda: batch.relabel(1, layers=[1, 2])):
            with self.assertRaises((TypeError, ValueError)):
                call()
        self.assertEqual(batch.request_bytes("arena"), before)
