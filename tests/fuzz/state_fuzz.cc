// Chunks of a scene's snapshot. A state that the reader accepts is restored and written, and the result is accepted,
// too. From the second writing on, the chunks stay the same.
#include <optional>

#include "core/scene/log/state_reader.h"
#include "core/scene/log/state_writer.h"
#include "core/scene/scene_writer.h"
#include "tests/fuzz/fuzz_target.h"

namespace locus::fuzz {
namespace {

using Chunks = std::vector<std::string>;

absl::StatusOr<SceneWriter> read_state(const Chunks& chunks) {
  StateReader reader;
  for (const std::string& chunk : chunks)
    if (absl::Status status = reader.add(chunk); !status.ok()) return status;
  const auto find_mesh = [](const MeshKey& key) {
    auto mesh = TriangleMesh::create({0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}, {});
    return *StaticMesh::build(key.name, key.sha256, *std::move(mesh));
  };
  absl::StatusOr<SceneState> state = std::move(reader).finish(find_mesh);
  if (!state.ok()) return state.status();
  return SceneWriter::restore(*std::move(state), {}, {});
}

Chunks write_state(SceneWriter& writer) {
  FrozenScene frozen{writer.published(), writer.writers(), writer.has_past(), 0, 0, writer.lease_table()};
  StateWriter state(std::move(frozen));
  Chunks chunks;
  while (std::optional<std::string> chunk = *state.next()) chunks.push_back(*std::move(chunk));
  return chunks;
}

LOCUS_FUZZ_TARGET(state) {
  Chunks chunks;
  while (!input.empty()) chunks.emplace_back(next_piece(input));
  absl::StatusOr<SceneWriter> first = read_state(chunks);
  if (!first.ok()) return check_error(first.status());
  const Chunks written = write_state(*first);
  absl::StatusOr<SceneWriter> second = read_state(written);
  LOCUS_CHECK(second.ok());
  LOCUS_CHECK_EQ(second->published()->objects.size(), first->published()->objects.size());
  LOCUS_CHECK_EQ(second->statics()->size(), first->statics()->size());
  // Objects are stored in the order of the grid, which depends on the order in which they were inserted. So only the
  // third writing must equal the second.
  absl::StatusOr<SceneWriter> third = read_state(write_state(*second));
  LOCUS_CHECK(third.ok());
  LOCUS_CHECK(write_state(*third) == write_state(*second));
}

}  // namespace
}  // namespace locus::fuzz
