"""Tests of query streams: matching of answers to batches, errors of single batches, bounded waiting."""
import random

import grpc
import locus
from locus import QueryBatch, UpdateBatch
from support import WAIT_SECONDS, DaemonTest, listed


class QueryStreamTest(DaemonTest):
    def setUp(self):
        super().setUp()
        self.built = self.apply(UpdateBatch().insert_balls(range(1, 65), [[3 * number, 0, 0] for number in range(64)], 0.5))

    def asking(self, number):
        """Returns a batch with a ray downward at object `number`."""
        return QueryBatch(at_least=self.built).rays([3 * (number - 1), 0, 9], [0, 0, -1])

    def test_every_future_gets_the_answer_of_its_batch(self):
        numbers = [random.Random(3).randint(1, 64) for _ in range(200)]
        with self.client.query_stream(self.scene) as stream:
            futures = [stream.send(self.asking(number)) for number in numbers]
        self.assertEqual([listed(future.result().blocks[0].ids) for future in futures], [[number] for number in numbers])

    def test_answers_equal_those_of_single_calls(self):
        batch = self.asking(5).balls([[9, 0, 0], [12, 0, 0]], 4).lookup([1, 99])
        with self.client.query_stream(self.scene) as stream:
            streamed = stream.send(batch).result(WAIT_SECONDS)
        alone = self.client.query(self.scene, batch)
        for one, other in zip(streamed.blocks, alone.blocks):
            for column in ("counts", "t", "ids", "triangles", "positions"):
                self.assertEqual(listed(getattr(one, column)), listed(getattr(other, column)), column)

    def test_a_refused_batch_does_not_stop_the_stream(self):
        with self.client.query_stream(self.scene) as stream:
            wrong = stream.send(QueryBatch().rays([0, 0, 0], [0, 0, 0]))
            right = stream.send(self.asking(1))
        self.assertRefused(wrong.exception(), "INVALID_ARGUMENT", "OUT_OF_RANGE", "blocks[0].rays.directions")
        self.assertEqual(listed(right.result().blocks[0].ids), [1])

    def test_a_stream_continues_after_its_scene_is_deleted(self):
        with self.client.query_stream(self.scene) as stream:
            stream.send(self.asking(1)).result(WAIT_SECONDS)
            self.client.delete_scene(self.scene)
            self.assertRefused(stream.send(self.asking(1)).exception(WAIT_SECONDS), "NOT_FOUND", "NOT_FOUND")
            self.client.create_scene(self.scene)
            late = stream.send(self.asking(1)).exception(WAIT_SECONDS)
            self.assertRefused(late, "FAILED_PRECONDITION", "SCENE_RESTARTED")
            self.assertEqual(stream.send(QueryBatch().lookup(1)).result(WAIT_SECONDS).revision, 0)

    def test_a_batch_whose_revision_is_not_reached_fails_with_deadline_exceeded(self):
        future_revision = locus.Revision(self.built.epoch, self.built.revision + 100)
        with self.client.query_stream(self.scene) as stream:
            error = stream.send(QueryBatch(at_least=future_revision).lookup(1)).exception(WAIT_SECONDS)
        self.assertEqual(error.code, grpc.StatusCode.DEADLINE_EXCEEDED)

    def test_waiting_for_answers_is_bounded(self):
        future_revision = locus.Revision(self.built.epoch, self.built.revision + 100)
        with self.client.query_stream(self.scene) as stream:
            stream.send(QueryBatch(at_least=future_revision).lookup(1))
            with self.assertRaisesRegex(TimeoutError, "1 batches were not answered within 0.01 s"):
                stream.sync(0.01)

    def test_large_answers_arrive_whole(self):
        batch = QueryBatch(at_least=self.built).balls([[90, 0, 0]] * 4000, 500)
        with self.client.query_stream(self.scene) as stream:
            (block,) = stream.send(batch).result(WAIT_SECONDS).blocks
        self.assertEqual(listed(block.ids), list(range(1, 65)) * 4000)
