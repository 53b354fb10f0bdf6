// Program of a user of the installed library with a server of its own: prints what a ray hits.
#include <iostream>

#include "client/embedded/embedded_server.h"
#include "client/lib/query_builder.h"
#include "client/lib/result_rows.h"
#include "client/lib/update_builder.h"

int main() {
  const auto server = locus::client::EmbeddedServer::start();
  if (!server.ok()) return std::cerr << server.status() << "\n", 1;
  const auto client = (*server)->connect();
  locus::v1::CreateSceneRequest scene;
  scene.set_name("arena");
  if (const auto created = client->create_scene(scene); !created.ok()) return std::cerr << created.status() << "\n", 1;
  locus::client::UpdateBuilder updates;
  updates.insert_ball(8, locus::client::Float3{0, 0, 40}, 0.5f);
  if (const auto ack = client->apply("arena", updates.build()); !ack.ok()) return std::cerr << ack.status() << "\n", 1;
  locus::client::QueryBuilder queries;
  queries.rays().ray({0, 0, 100}, {0, 0, -1});
  const auto result = client->query("arena", queries.build());
  if (!result.ok()) return std::cerr << result.status() << "\n", 1;
  const auto hits = locus::client::RayHits::of(result->blocks(0));
  if (!hits.ok()) return std::cerr << hits.status() << "\n", 1;
  std::cout << "hit " << hits->id(0) << " at t = " << hits->t(0) << "\n";
}
