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

    def test_the_queries_of_a_step_see_its_update(self):
        with self.client.query_stream(self.scene) as stream:
            for number in range(1, 21):
                update = UpdateBatch().move(7, [500.0 + number, 0, 0])
                step = stream.step(update, QueryBatch().lookup(7)).result(WAIT_SECONDS)
                self.assertEqual(step.ack.applied, 1)
                self.assertEqual(step.ack.revision, self.built.revision + number)
                self.assertEqual(step.result.revision, step.ack.revision)
                self.assertIsNone(step.error)
                self.assertEqual(listed(step.result.blocks[0].positions), [500.0 + number, 0, 0])
        self.assertEqual(update.message.batch, 0)

    def test_a_refused_step_does_not_stop_later_ones(self):
        with self.client.query_stream(self.scene) as stream:
            futures = []
            for number in range(40):
                update = UpdateBatch(all_or_nothing=True).move(99 if number % 4 == 0 else 7, [500.0 + number, 0, 0])
                futures.append(stream.step(update, QueryBatch().lookup(7)))
                futures.append(stream.send(self.asking(2)))
        for number in range(40):
            step, query = futures[2 * number], futures[2 * number + 1]
            self.assertEqual(listed(query.result().blocks[0].ids), [2])
            if number % 4 == 0:
                self.assertRefused(step.exception(), "INVALID_ARGUMENT", "UNKNOWN_ID", "moves[0].ids")
            else:
                self.assertEqual(step.result().ack.applied, 1)
        self.assertEqual(self.client.scene(self.scene).revision, self.built.revision + 30)

    def test_queries_that_fail_after_their_update_leave_its_ack(self):
        update = UpdateBatch().move(7, [500, 0, 0])
        past = QueryBatch().lookup(7, block=locus.Block(as_of_ticks=[5]))
        with self.client.query_stream(self.scene) as stream:
            streamed = stream.step(update, past).result(WAIT_SECONDS)
        for step in (streamed, self.client.step(self.scene, update, past)):
            self.assertEqual(step.ack.applied, 1)
            self.assertEqual(step.error.code, grpc.StatusCode.OUT_OF_RANGE)
            with self.assertRaises(locus.LocusError):
                step.result

    def test_a_single_step_equals_a_streamed_one(self):
        update = UpdateBatch(tick=3).move(7, [500, 0, 0])
        step = self.client.step(self.scene, update, QueryBatch().lookup(7))
        self.assertEqual((step.ack.applied, step.ack.tick, step.result.tick), (1, 3, 3))
        self.assertEqual(listed(step.result.blocks[0].positions), [500, 0, 0])
        with self.assertRaises(locus.LocusError) as refused:
            self.client.step(self.scene, UpdateBatch(all_or_nothing=True).move(99, [1, 0, 0]), QueryBatch().lookup(7))
        self.assertRefused(refused.exception, "INVALID_ARGUMENT", "UNKNOWN_ID", "moves[0].ids")

    def test_a_repeated_step_is_applied_once(self):
        update = UpdateBatch(writer=5, number=1).move(7, [500, 0, 0])
        first = self.client.step(self.scene, update, QueryBatch().lookup(7))
        second = self.client.step(self.scene, update, QueryBatch().lookup(7))
        self.assertEqual((first.ack.duplicate, second.ack.duplicate), (False, True))
        self.assertEqual(second.ack.revision, first.ack.revision)
        self.assertEqual(second.result.blocks[0].rows, 1)

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
