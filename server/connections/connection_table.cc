#include "server/connections/connection_table.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/hash/hash.h"

namespace locus::server {

void ConnectionTable::add(std::shared_ptr<Connection> connection) {
  Part& part = part_of(connection->peer().name);
  const MutexLock lock(part.mutex);
  part.accepted[connection->peer().name].swap(connection);
}

void ConnectionTable::remove(const Connection& connection) {
  Part& part = part_of(connection.peer().name);
  std::shared_ptr<Connection> removed;  // destroyed without the lock
  const MutexLock lock(part.mutex);
  const auto found = part.accepted.find(connection.peer().name);
  if (found == part.accepted.end() || found->second.get() != &connection) return;
  removed = std::move(found->second);
  part.accepted.erase(found);
}

std::shared_ptr<Connection> ConnectionTable::find(absl::string_view name) {
  Part& part = part_of(name);
  const MutexLock lock(part.mutex);
  const auto found = part.accepted.find(name);
  return found != part.accepted.end() ? found->second : stand_in(part, name);
}

size_t ConnectionTable::shed_heaviest(bool close, uint64_t min_bytes, const char* reason) {
  const std::vector<std::shared_ptr<Connection>> all = accepted();
  std::vector<uint64_t> weights;
  weights.reserve(all.size());
  for (const std::shared_ptr<Connection>& connection : all)
    weights.push_back(connection->unexplained_since_last_look() + connection->claimed_bytes.load());
  if (!close || all.empty()) return 0;
  const uint64_t most = *std::max_element(weights.begin(), weights.end());
  size_t closed = 0;
  for (size_t i = 0; i < all.size(); ++i)
    if (weights[i] >= std::max(min_bytes, most / 2)) closed += all[i]->close(reason);
  return closed;
}

size_t ConnectionTable::close_if(const std::function<bool(const Connection&)>& is_chosen, const char* reason) {
  size_t closed = 0;
  for (const std::shared_ptr<Connection>& connection : accepted())
    if (is_chosen(*connection)) closed += connection->close(reason, Misuse::kNo);
  return closed;
}

std::vector<std::shared_ptr<Connection>> ConnectionTable::accepted() const {
  std::vector<std::shared_ptr<Connection>> all;
  for (const Part& part : parts_) {
    const MutexLock lock(part.mutex);
    for (const auto& [name, connection] : part.accepted) all.push_back(connection);
  }
  return all;
}

size_t ConnectionTable::size() const {
  size_t total = 0;
  for (const Part& part : parts_) {
    const MutexLock lock(part.mutex);
    total += part.accepted.size();
  }
  return total;
}

ConnectionTable::Part& ConnectionTable::part_of(absl::string_view name) {
  return parts_[absl::Hash<absl::string_view>()(name) % kParts];
}

std::shared_ptr<Connection> ConnectionTable::stand_in(Part& part, absl::string_view name) {
  if (part.stand_ins.size() >= part.cleanup_at) {
    absl::erase_if(part.stand_ins, [](const auto& entry) { return entry.second.expired(); });
    part.cleanup_at = std::max(kMinCleanup, 2 * part.stand_ins.size());
  }
  std::weak_ptr<Connection>& known = part.stand_ins[name];
  std::shared_ptr<Connection> connection = known.lock();
  if (connection != nullptr) return connection;
  Peer peer;
  peer.name = std::string(name);
  peer.label = peer.name;
  peer.address = peer.name;
  peer.limit_key = peer.name;
  connection = std::make_shared<Connection>(std::move(peer), std::chrono::steady_clock::now(), -1);
  known = connection;
  return connection;
}

}  // namespace locus::server
