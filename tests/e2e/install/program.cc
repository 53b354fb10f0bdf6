// Program of a user of the installed library: makes a scene, inserts a ball, and prints what a ray hits.
#include <iostream>

#include "client/lib/client.h"
#include "client/lib/query_builder.h"
#include "client/lib/result_rows.h"
#include "client/lib/update_builder.h"

int main(int argc, char** argv) {
  if (argc != 3) return std::cerr << "usage: program ADDRESS SCENE\n", 2;
  const auto client = locus::client::Client::connect(argv[1]);
  if (!client.ok()) return std::cerr << client.status() << "\n", 1;
  locus::v1::CreateSceneRequest scene;
  scene.set_name(argv[2]);
  if (const auto created = (*client)->create_scene(scene); !created.ok())
    return std::cerr << created.status() << "\n", 1;
  locus::client::UpdateBuilder updates;
  updates.insert_ball(8, locus::client::Float3{0, 0, 40}, 0.5f);
  const auto stream = (*client)->update_stream(argv[2]);
  const auto ack = stream->send(updates.build()).get();
  if (!ack.ok()) return std::cerr << ack.status() << "\n", 1;
  locus::client::QueryBuilder queries;
  queries.at_least({ack->epoch(), ack->revision()}).rays().ray({0, 0, 100}, {0, 0, -1});
  const auto result = (*client)->query(argv[2], queries.build());
  if (!result.ok()) return std::cerr << result.status() << "\n", 1;
  const auto hits = locus::client::RayHits::of(result->blocks(0));
  if (!hits.ok()) return std::cerr << hits.status() << "\n", 1;
  std::cout << "hit " << hits->id(0) << " at t = " << hits->t(0) << "\n";
}
