#include "server/storage/postgres_log.h"

#include <algorithm>
#include <limits>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/storage/rows/refusals.h"

namespace locus::server {
namespace {

constexpr auto kBackoff = std::chrono::milliseconds(50);  // pause between two attempts to reach the engine

// A parameter of PostgreSQL is at most 1 GiB long, and the engine needs several times the memory of a statement.
constexpr uint64_t kMaxAppendBytes = uint64_t{256} << 20;

// Longest wait for the lock of one scene's row, which another daemon has while it takes the scene over, or for some
// seconds if it hangs: the other scenes of the group must not wait for it.
constexpr const char* kLimitLocks = "SELECT set_config('lock_timeout', '100ms', true)";

constexpr const char* kAppendName = "append";
SqlParameters append_parameters(const Append& append) {
  std::vector<uint64_t> writers, batches;
  std::vector<absl::string_view> bytes;
  for (const LogEntry& entry : append.entries) {
    writers.push_back(entry.writer);
    batches.push_back(entry.batch);
    bytes.push_back(entry.bytes);
  }
  SqlParameters parameters;
  parameters.number(append.scene).number(append.token).number(append.before);
  parameters.number(append.before + append.entries.size()).number(append.chains.back());
  parameters.number(append.entries.front().epoch).numbers(writers).numbers(batches).numbers(append.chains);
  parameters.list_of_bytes(bytes);
  return parameters;
}

}  // namespace

absl::StatusOr<std::unique_ptr<PostgresLog>> PostgresLog::open(const PostgresOptions& options) {
  ASSIGN_OR_RETURN(EngineAddress address, EngineAddress::parse(options.url));
  PostgresOptions named = options;
  if (named.member == 0) named.member = random_id() >> 1 | 1;  // a positive bigint
  std::unique_ptr<PostgresLog> log(new PostgresLog(named, std::move(address)));
  if (named.list_catalogue) {
    RETURN_IF_ERROR(log->list_stored());
  } else {
    RETURN_IF_ERROR(log->begin_read().status());  // a host must accept writes, and its settings must be right
  }
  return log;
}

PostgresLog::PostgresLog(const PostgresOptions& options, EngineAddress address)
    : options_(options),
      pool_(std::move(address), options.connect_wait,
            [replication = options.replication](EngineConnection& connection, Deadline deadline) -> absl::Status {
              RETURN_IF_ERROR(check_engine(connection, replication, deadline));
              RETURN_IF_ERROR(prepare_tables(connection, deadline));
              if (planted(PlantedBug::kAppendWithoutToken))
                return connection.prepare(
                    kAppendName,
                    absl::StrReplaceAll(kAppendStatement, {{"token = $2::bigint", "$2::bigint IS NOT NULL"}}).c_str(),
                    deadline);
              return connection.prepare(kAppendName, kAppendStatement, deadline);
            }),
      queue_(EnginePool::kUrgentConnections, [this](absl::Span<Append* const> group) { commit_group(group); }) {}

absl::StatusOr<PostgresLog::LedPtr> PostgresLog::led(SceneKey scene) const {
  MutexLock lock(mutex_);
  const auto found = led_.find(scene);
  if (found == led_.end()) return scene_not_stored(scene);
  return found->second;
}

absl::StatusOr<EnginePool::Lease> PostgresLog::acquire(EnginePool::Use use, Deadline deadline) const {
  while (true) {
    absl::StatusOr<EnginePool::Lease> lease = pool_.acquire(use, deadline);
    if (!absl::IsUnavailable(lease.status()) || std::chrono::steady_clock::now() + kBackoff >= deadline) return lease;
    std::this_thread::sleep_for(kBackoff);
  }
}

absl::StatusOr<EnginePool::Lease> PostgresLog::begin_read() const {
  const Deadline deadline = change_deadline();
  while (true) {
    ASSIGN_OR_RETURN(EnginePool::Lease lease, acquire(EnginePool::Use::kOther, deadline));
    add_barrier(*lease);
    absl::Status status = run_checked(*lease, options_.replication, std::min(deadline, answer_deadline()));
    if (status.ok()) status = lease->run("BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY", answer_deadline());
    if (status.ok()) return lease;
    if (!lease->lost() || std::chrono::steady_clock::now() + kBackoff >= deadline) return status;
  }
}

void PostgresLog::set_fenced(Led& led) {
  led.fence_unreported |= !led.fenced;
  led.fenced = true;
}

void PostgresLog::report(Led& led) const {
  uint64_t before, now;
  bool fenced;
  {
    MutexLock writing(led.writing);
    now = led.token;
    before = std::exchange(led.reported_token, now);
    fenced = std::exchange(led.fence_unreported, false);
  }
  if (before != now && options_.on_token) options_.on_token(led.key, before, now);
  if (fenced && options_.on_fenced) options_.on_fenced(led.key, now);
}

PostgresLog::Retired PostgresLog::retire(SceneKey scene) {
  LedPtr earlier;
  {
    MutexLock lock(mutex_);
    const auto found = led_.find(scene);
    if (found == led_.end()) return {};
    earlier = found->second;
  }
  MutexLock writing(earlier->writing);
  earlier->fenced = true;
  return {earlier->token, earlier->possibly_last};
}

void PostgresLog::lead(const StoredScene& scene, uint64_t member, uint64_t token, uint64_t chain,
                       uint64_t possibly_last) {
  auto state = std::make_shared<Led>();
  state->key = scene.key;
  state->name = scene.name;
  {
    MutexLock writing(state->writing);
    state->member = member;
    state->token = token;
    state->reported_token = token;
    state->epoch = scene.epoch;
    state->last = scene.last_sequence;
    state->chain = chain;
    state->damage = scene.damage;
    state->possibly_last = possibly_last;
    state->known_last = scene.last_sequence;
  }
  MutexLock lock(mutex_);
  led_[scene.key] = std::move(state);
}

absl::StatusOr<uint64_t> PostgresLog::append(SceneKey key, absl::Span<const LogEntry> entries, AckLevel) {
  const auto start = std::chrono::steady_clock::now();
  ASSIGN_OR_RETURN(const LedPtr state, led(key));
  Led& scene = *state;
  {
    // Other threads learn the new token before records are written under it.
    const Report report(*this, scene);
    MutexLock writing(scene.writing);
    if (!entries.empty() && scene.damage.ok() && !scene.fenced && scene.possibly_last != 0 &&
        !planted(PlantedBug::kLostAppendKept))
      RETURN_IF_ERROR(remove_possibly_written(scene));
  }
  const Report report(*this, scene);
  MutexLock writing(scene.writing);
  if (entries.empty()) return scene.last;
  if (!scene.damage.ok()) return scene.damage;
  if (scene.fenced) return refuse_fenced(scene.name);
  if (scene.epoch != entries.front().epoch) return refuse_epoch(scene.name, scene.epoch, entries.front().epoch);
  Append append;
  append.scene = key;
  append.token = scene.token;
  append.before = scene.last;
  append.entries = entries;
  std::vector<uint64_t> chains;
  uint64_t chain = scene.chain;
  for (const LogEntry& entry : entries) {
    LOCUS_CHECK_EQ(entry.epoch, entries.front().epoch);
    append.bytes += entry.bytes.size();
    chain = chain_after(key, scene.last + chains.size() + 1, entry, chain);
    chains.push_back(chain);
  }
  if (append.bytes > kMaxAppendBytes)
    return refuse_limit("entries", "record_bytes", static_cast<double>(kMaxAppendBytes),
                        static_cast<double>(append.bytes));
  append.chains = chains;
  queue_.run(append);
  switch (append.outcome) {
    case Append::Outcome::kWritten:
      scene.last += entries.size();
      scene.chain = chain;
      scene.known_last = scene.last;
      if (options_.on_append) options_.on_append(std::chrono::steady_clock::now() - start);
      return scene.last;
    case Append::Outcome::kFenced:
      set_fenced(scene);
      return refuse_fenced(scene.name);
    case Append::Outcome::kUnknown:
      scene.possibly_last = scene.last + entries.size();
      return append.failure;
    case Append::Outcome::kNotWritten:
    case Append::Outcome::kBlocked:  // the queue returns no such append
      return append.failure;
  }
  return absl::InternalError("unreachable");
}

void PostgresLog::commit_group(absl::Span<Append* const> group) const {
  uint64_t bytes = 0;
  for (const Append* const append : group) bytes += append->bytes;
  Deadline deadline = change_deadline(bytes);
  for (Append* const append : group) {
    if (append->until == Deadline()) append->until = deadline;
    deadline = std::min(deadline, append->until);  // earlier for an append that was blocked
  }
  std::vector<Append*> left(group.begin(), group.end());
  while (true) {
    const absl::Status status = send_appends(left, deadline);
    left.erase(std::remove_if(left.begin(), left.end(),
                              [](const Append* append) { return append->outcome != Append::Outcome::kNotWritten; }),
               left.end());
    if (left.empty()) return;
    const bool again = status.ok() || absl::IsUnavailable(status);
    if (!again || std::chrono::steady_clock::now() + kBackoff >= deadline) {
      for (Append* const append : left) {
        append->failure = status.ok() ? absl::UnavailableError("the engine did not answer in time") : status;
        // A statement that waits in a network or in a stopped server may still arrive.
        if (append->sent) append->outcome = Append::Outcome::kUnknown;
      }
      return;
    }
    if (!status.ok()) std::this_thread::sleep_for(kBackoff);
  }
}

absl::Status PostgresLog::send_appends(absl::Span<Append* const> appends, Deadline deadline) const {
  std::vector<Append*> open;  // appends whose outcome must be found out
  {
    ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kUrgent, deadline));
    lease->add(kLimitLocks);
    for (const Append* const append : appends) lease->add_prepared(kAppendName, append_parameters(*append));
    uint64_t bytes = 0;
    for (const Append* const append : appends) bytes += append->bytes;
    const absl::Status status = run_checked(*lease, options_.replication, std::min(deadline, answer_deadline(bytes)));
    if (const std::optional<size_t> blocked = lease->blocked_statement();
        blocked && !lease->lost() && *blocked - 1 < appends.size()) {
      Append& append = *appends[*blocked - 1];
      if (std::chrono::steady_clock::now() + kBackoff >= append.until) return status;
      append.outcome = Append::Outcome::kBlocked;
      return absl::OkStatus();  // the others may be sent again at once
    }
    if (!status.ok() && !lease->lost()) return status;
    for (size_t i = 0; i < appends.size(); ++i) {
      if (status.ok() && lease->results()[i + 1].changed() == appends[i]->entries.size()) {
        appends[i]->outcome = Append::Outcome::kWritten;
      } else {
        appends[i]->outcome = Append::Outcome::kUnknown;
        appends[i]->sent = appends[i]->sent || !status.ok();
        open.push_back(appends[i]);
      }
    }
  }
  if (open.empty()) return absl::OkStatus();
  absl::Status status = resolve(open, deadline);
  if (!status.ok()) {
    for (Append* const append : open) append->failure = status;
  }
  return status;
}

absl::Status PostgresLog::resolve(absl::Span<Append* const> appends, Deadline deadline) const {
  std::vector<uint64_t> keys;
  for (const Append* const append : appends) keys.push_back(append->scene);
  while (true) {
    ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kUrgent, deadline));
    // The lock waits for a transaction of the lost connection that still waits for the standbys, and the commit of this
    // transaction waits for them too. A plain read would show what no standby has.
    const bool plain = planted(PlantedBug::kResolvedByPlainRead);
    lease->add(absl::StrCat("SELECT scene, token, last, chain FROM locus.scene_log WHERE scene = ANY($1::bigint[])"
                            " ORDER BY scene",
                            plain ? "" : " FOR UPDATE")
                   .c_str(),
               SqlParameters().numbers(keys));
    if (!plain) add_barrier(*lease);
    if (absl::Status status = run_checked(*lease, options_.replication, std::min(deadline, answer_deadline()));
        !status.ok()) {
      if (std::chrono::steady_clock::now() + kBackoff >= deadline) return status;
      std::this_thread::sleep_for(kBackoff);
      continue;
    }
    const EngineRows& found = lease->results()[0];
    std::map<SceneKey, size_t> row_of;
    for (size_t row = 0; row < found.size(); ++row) row_of[found.number(row, 0)] = row;
    for (Append* const append : appends) {
      const auto row = row_of.find(append->scene);
      if (row == row_of.end() || found.number(row->second, 1) != append->token) {
        append->outcome = Append::Outcome::kFenced;
        continue;
      }
      const uint64_t last = found.number(row->second, 2), chain = found.number(row->second, 3);
      if (last == append->before + append->entries.size() && chain == append->chains.back()) {
        append->outcome = Append::Outcome::kWritten;
      } else if (last == append->before) {
        append->outcome = Append::Outcome::kNotWritten;
      } else {
        append->outcome = Append::Outcome::kUnknown;
        append->failure = absl::DataLossError(
            absl::StrCat("the log of scene ", append->scene, " ends at record ", last, " instead of ", append->before));
      }
    }
    return absl::OkStatus();
  }
}

absl::Status PostgresLog::remove_possibly_written(Led& led) {
  const uint64_t key = led.key, token = led.token, last = led.last, chain = led.chain;
  // The new token refuses statements of the failed append that arrive only now.
  const auto remove = [&](EngineConnection& connection) -> absl::Status {
    connection.add(
        "UPDATE locus.scene_log SET token = token + 1, last = $3::bigint, chain = $4::bigint"
        " WHERE scene = $1::bigint AND token = $2::bigint AND last >= $3::bigint",
        SqlParameters().number(key).number(token).number(last).number(chain));
    RETURN_IF_ERROR(connection.run(answer_deadline()));
    if (connection.results()[0].changed() != 1) return refuse_fenced(led.name);
    connection.add("DELETE FROM locus.record WHERE scene = $1::bigint AND sequence > $2::bigint",
                   SqlParameters().number(key).number(last));
    return connection.run(change_deadline());
  };
  const auto removed = [&](EngineConnection& connection) -> absl::StatusOr<bool> {
    connection.add("SELECT leader, token FROM locus.scene_log WHERE scene = $1::bigint FOR UPDATE",
                   SqlParameters().number(key));
    RETURN_IF_ERROR(run_barrier(connection));
    const EngineRows& found = connection.results()[0];
    return !found.empty() && found.number(0, 0) == led.member && found.number(0, 1) == token + 1;
  };
  absl::Status status = transact(EnginePool::Use::kUrgent, remove, removed);
  if (absl::IsAborted(status)) {  // an earlier call may have removed them, and its answer was lost
    ASSIGN_OR_RETURN(const EnginePool::Lease lease, acquire(EnginePool::Use::kUrgent, change_deadline()));
    ASSIGN_OR_RETURN(const bool earlier, removed(*lease));
    if (!earlier) set_fenced(led);
    if (earlier) status = absl::OkStatus();
  }
  RETURN_IF_ERROR(status);
  led.possibly_last = 0;
  led.token = token + 1;
  return absl::OkStatus();
}

absl::Status PostgresLog::run_barrier(EngineConnection& connection) const {
  add_barrier(connection);
  return run_checked(connection, options_.replication, answer_deadline());
}

absl::StatusOr<uint64_t> PostgresLog::token_of(SceneKey scene) const {
  ASSIGN_OR_RETURN(const LedPtr state, led(scene));
  MutexLock writing(state->writing);
  return state->token;
}

absl::StatusOr<uint64_t> PostgresLog::latest(SceneKey scene) const {
  ASSIGN_OR_RETURN(const LedPtr state, led(scene));
  return state->known_last.load();
}

absl::Status PostgresLog::read(SceneKey key, uint64_t from, RecordSink sink) const {
  return read_until(key, from, std::numeric_limits<uint64_t>::max(), sink);
}

absl::Status PostgresLog::read_until(SceneKey key, uint64_t from, uint64_t until, RecordSink sink) const {
  // One transaction for both statements: a snapshot of the scene that is written meanwhile deletes records.
  ASSIGN_OR_RETURN(const EnginePool::Lease lease, begin_read());
  EngineConnection& connection = *lease;
  connection.add("SELECT " LOCUS_SCENE_COLUMNS
                 ", l.last, l.chain, r.chain FROM locus.scene s JOIN locus.scene_log l ON l.scene = s.key"
                 " LEFT JOIN locus.record r ON r.scene = s.key AND r.sequence = $2::bigint WHERE s.key = $1::bigint",
                 SqlParameters().number(key).number(from - 1));
  RETURN_IF_ERROR(connection.run(answer_deadline()));
  const EngineRows& found = connection.results()[0];
  if (found.empty()) return scene_not_stored(key);
  ASSIGN_OR_RETURN(const StoredSceneRow row, scene_row(found, 0));
  const uint64_t log_end = found.number(0, kSceneColumns), last = std::min(log_end, until);
  const uint64_t last_chain = found.number(0, kSceneColumns + 1);
  if (from <= row.snapshot_sequence) return refuse_read_before(row.snapshot_sequence);
  if (from > last) return connection.run("COMMIT", answer_deadline());
  uint64_t at = from - 1;
  uint64_t chain = row.snapshot_chain;
  if (at != row.snapshot_sequence) {
    if (found.is_null(0, kSceneColumns + 2))
      return damaged("scene", row.name, absl::StrCat("record ", at, " is missing"));
    chain = found.number(0, kSceneColumns + 2);
  }
  RETURN_IF_ERROR(
      connection.stream("SELECT sequence, epoch, writer, batch, chain, bytes FROM locus.record"
                        " WHERE scene = $1::bigint AND sequence BETWEEN $2::bigint AND $3::bigint ORDER BY sequence",
                        SqlParameters().number(key).number(from).number(last), options_.append_wait,
                        [&](const EngineRows& found_record) -> absl::Status {
                          LogRecord record;
                          record.sequence = found_record.number(0, 0);
                          record.entry.epoch = found_record.number(0, 1);
                          record.entry.writer = found_record.number(0, 2);
                          record.entry.batch = found_record.number(0, 3);
                          record.entry.bytes = found_record.bytes(0, 5);
                          if (record.sequence != at + 1)
                            return damaged("scene", row.name, absl::StrCat("record ", at + 1, " is missing"));
                          at = record.sequence;
                          chain = chain_after(key, at, record.entry, chain);
                          if (chain != found_record.number(0, 4) && !planted(PlantedBug::kChainNotCompared))
                            return damaged("scene", row.name, absl::StrCat("the checksum of record ", at, " is wrong"));
                          return sink(record);
                        }));
  if (at != last) return damaged("scene", row.name, absl::StrCat("record ", at + 1, " is missing"));
  if (last == log_end && chain != last_chain && !planted(PlantedBug::kChainNotCompared))
    return damaged("scene", row.name, absl::StrCat("record ", last, " is not the one that was appended"));
  return connection.run("COMMIT", answer_deadline());
}

}  // namespace locus::server
