"""Tests of meshes and instances: uploaded in several messages, placed by columns, hit by rays."""
import array
import hashlib
import struct

import locus
from locus import InstanceChange, MeshPart, QueryBatch, UpdateBatch, meshes
from support import DaemonTest, listed

SQUARE = ([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0], [0, 1, 2, 0, 2, 3])


def strip(count):
    """Returns the columns of a strip of `count` squares along x."""
    vertices, indices = array.array("f"), array.array("I")
    for square in range(count):
        vertices.extend((square, 0, 0, square + 1, 0, 0, square + 1, 1, 0, square, 1, 0))
        indices.extend(4 * square + corner for corner in (0, 1, 2, 0, 2, 3))
    return vertices, indices


class MeshesTest(DaemonTest):
    def test_an_uploaded_mesh_is_described_and_listed(self):
        parts = [MeshPart("floor", 0), MeshPart("wall", 1)]
        corners, indices = [0, 0, 5, 1, 0, 5, 1, 1, 5, 0, 1, 5], SQUARE[1]
        mesh = self.client.upload_mesh("parted", corners, indices, parts=parts)
        digest = hashlib.sha256(struct.pack("<II12f6I", 4, 2, *corners, *indices)).digest()
        self.assertEqual((mesh.name, mesh.triangles, mesh.sha256, mesh.parts), ("parted", 2, digest, tuple(parts)))
        self.assertIn(mesh, self.client.meshes())
        self.client.delete_mesh("parted")
        self.assertNotIn("parted", [mesh.name for mesh in self.client.meshes()])

    def test_all_of_many_parts_are_listed(self):
        squares = 10_000
        vertices, indices = strip(squares)
        parts = [MeshPart(f"{number:0250}", number) for number in range(2 * squares)]  # 5 MB, more than a reply
        mesh = self.client.upload_mesh("many", vertices, indices, parts=parts)
        self.assertEqual(mesh.parts, tuple(parts))
        self.assertEqual([listed for listed in self.client.meshes() if listed.name == "many"], [mesh])
        self.client.delete_mesh("many")

    def test_a_large_mesh_is_sent_in_chunks_and_only_once(self):
        squares, steps = 60_000, []
        vertices, indices = strip(squares)
        mesh = self.client.upload_mesh("strip", vertices, indices, progress=lambda *step: steps.append(step))
        total = 4 * (len(vertices) + len(indices))
        self.assertGreater(len(steps), 3)
        self.assertEqual(steps[-1], (total, total))
        again = self.client.upload_mesh("strip", vertices, indices)
        self.assertEqual((again.sha256, again.triangles), (mesh.sha256, 2 * squares))
        self.client.change_instances(self.scene, InstanceChange().place("strip", ids=1))
        (block,) = self.ask(QueryBatch().rays([[0.75, 0.25, 1], [squares - 0.25, 0.25, 1]], [0, 0, -1]))
        self.assertEqual(listed(block.triangles), [0, 2 * squares - 2])

    def test_a_downloaded_mesh_equals_the_uploaded_one(self):
        vertices, indices = strip(59_999)  # content that no other test uploads
        mesh = self.client.upload_mesh("back", vertices, indices)
        found = self.client.download_mesh("back")
        self.assertEqual((found.mesh.sha256, found.mesh.triangles), (mesh.sha256, len(indices) // 3))
        self.assertEqual((listed(found.vertices), listed(found.indices)), (vertices.tolist(), indices.tolist()))
        with self.assertRaises(locus.LocusError) as raised:
            self.client.download_mesh("nothing")
        self.assertRefused(raised.exception, "NOT_FOUND", "NOT_FOUND")

    def test_a_download_with_a_missing_chunk_is_data_loss(self):
        piece = locus.schema.message("DownloadMeshResponse")(vertices=bytes(36), indices=bytes(12))
        for pieces in ([], [piece]):
            with self.assertRaisesRegex(locus.LocusError, "the mesh is not whole.*DATA_LOSS"):
                locus.MeshColumns.of(pieces)

    def test_chunks_are_whole_triples_below_the_limit(self):
        messages = list(meshes.upload_messages("strip", *strip(60_000), parts=(), progress=None))
        sizes = [len(message.vertices) + len(message.indices) for message in messages]
        self.assertTrue(all(size % 12 == 0 and size < 1 << 20 for size in sizes))

    def test_instances_are_placed_by_columns(self):
        self.client.upload_mesh("square", *SQUARE)
        change = InstanceChange().place("square", [[10, 0, 0], [20, 0, 0.1]], ids=[5, 6], rotations=[0, 0, 0, 1],
                                        scales=[2, 3], layers=[1, 2], groups=9, tags=[50, 60])
        placed = self.client.change_instances(self.scene, change)
        self.assertEqual((listed(placed.ids), placed.change, placed.revision), ([5, 6], 1, 1))
        (block,) = self.ask(QueryBatch().lookup([5, 6], block=locus.Block(columns=[
            locus.Column.ID, locus.Column.POSE, locus.Column.GROUP, locus.Column.TAG, locus.Column.LAYERS])))
        self.assertEqual(listed(block.positions), [10, 0, 0, 20, 0, 0.1])
        self.assertEqual((listed(block.layers), listed(block.groups), listed(block.tags)), ([1, 2], [9, 9], [50, 60]))
        (block,) = self.ask(QueryBatch().rays([22.9, 0.5, 9], [0, 0, -1]))
        self.assertEqual(listed(block.ids), [6])

    def test_instances_move_and_are_hidden_by_update_batches(self):
        self.client.upload_mesh("square", *SQUARE)
        self.client.change_instances(self.scene, InstanceChange().place("square", [[0, 0, 0], [10, 0, 0]], ids=[1, 2]))
        batch = UpdateBatch().move_instances([1, 2], positions_f64=[[0, 0, 5], [20, 0, 0]], rotations=[0, 0, 1, 0],
                                             scales=[2]).relabel_instances(2, layers=0, tags=7)
        self.assertEqual(self.apply(batch).applied, 3)
        (block,) = self.ask(QueryBatch().lookup([1, 2], block=locus.Block(columns=[
            locus.Column.ID, locus.Column.POSE, locus.Column.TAG, locus.Column.LAYERS])))
        self.assertEqual(listed(block.positions), [0, 0, 5, 20, 0, 0])
        self.assertEqual(listed(block.rotations), [0, 0, 1, 0] * 2)
        self.assertEqual((listed(block.tags), listed(block.layers)), ([0, 7], [1, 0]))
        (error,) = self.apply(UpdateBatch().move_instances(3, [0, 0, 0])).errors
        self.assertEqual((error.field, error.id), ("instance_moves[0].ids", 3))

    def test_removing_and_placing_is_one_revision(self):
        self.client.upload_mesh("square", *SQUARE)
        self.client.change_instances(self.scene, InstanceChange().place("square", ids=[1, 2, 3], groups=[0, 4, 4]))
        change = InstanceChange().remove(1).remove_groups(4).place("square", ids=[2])
        self.assertEqual(self.client.change_instances(self.scene, change).revision, 2)
        (block,) = self.ask(QueryBatch().lookup([1, 2, 3]))
        self.assertEqual(listed(block.ids), [0, 2, 0])

    def test_the_server_chooses_ids_if_none_are_given(self):
        self.client.upload_mesh("square", *SQUARE)
        placed = self.client.change_instances(self.scene, InstanceChange().place("square", [[0, 0, 0], [5, 0, 0]]))
        self.assertTrue(all(2**32 <= one < 2**33 for one in listed(placed.ids)))
        self.assertEqual(len(placed.ids), 2)

    def test_a_change_is_accepted_without_waiting(self):
        self.client.upload_mesh("square", *SQUARE)
        placed = self.client.change_instances(self.scene, InstanceChange().place("square", ids=7), no_wait=True)
        self.assertEqual((listed(placed.ids), placed.revision), ([7], None))
        (block,) = self.ask(QueryBatch(at_least=locus.Revision(placed.epoch, 1)).lookup(7))
        self.assertEqual(listed(block.ids), [7])

    def test_a_mesh_in_use_is_not_deleted(self):
        self.client.upload_mesh("used", *strip(3))
        self.client.change_instances(self.scene, InstanceChange().place("used"))
        with self.assertRaises(locus.LocusError) as raised:
            self.client.delete_mesh("used")
        self.assertRefused(raised.exception, "FAILED_PRECONDITION", "IN_USE")
        self.assertEqual(raised.exception.asked, 1)

    def test_an_unknown_mesh_is_named(self):
        with self.assertRaises(locus.LocusError) as raised:
            self.client.change_instances(self.scene, InstanceChange().place("nothing"))
        self.assertRefused(raised.exception, "NOT_FOUND", "NOT_FOUND", "place[0].mesh")

    def test_a_wrong_mesh_is_refused(self):
        with self.assertRaisesRegex(ValueError, "^vertices: has 4 numbers: give 3"):
            self.client.upload_mesh("bad", [0, 0, 0, 1], [0, 0, 0])
        with self.assertRaises(locus.LocusError) as raised:
            self.client.upload_mesh("bad", SQUARE[0], [0, 1, 9])
        self.assertRefused(raised.exception, "INVALID_ARGUMENT", "OUT_OF_RANGE", "indices")

    def test_wrong_columns_of_a_placement_are_named_and_add_nothing(self):
        change = InstanceChange()
        with self.assertRaisesRegex(ValueError, r"^place\[0\].scales: has 2 entries: give 1"):
            change.place("square", scales=[1, 2])
        self.assertEqual(len(change.message.place), 0)
