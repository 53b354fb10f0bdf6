// Fair queue: entries of many clients, served so that every waiting client gets an equal share of the work, however
// many entries it has. next() returns the first entry of the waiting client that has received the least work so far,
// and sets the virtual time to this amount of work. A client that is new, or has entries again after being idle, starts
// at the virtual time, so that it gets no additional share for the time without entries. Exception: if an idle client
// has received more work than the virtual time, the queue remembers this amount of work, and the client starts at this
// amount when it has entries again. Source: Goyal, Vin, Cheng, Start-time Fair Queueing, 1996.
//
// Threads: one thread at a time. Every operation costs O(log clients); remove() costs O(entries of the client) in
// addition. Memory: one record for each waiting client, and for at most kMaxIdleClients idle clients. Invariants: every
// client is in exactly one of two sets: in `waiting_` if it has entries, otherwise in `idle_`. Both sets are ordered by
// the work served to the client. virtual_time_ never decreases.
#ifndef LOCUS_SERVER_SCHEDULING_FAIR_QUEUE_H_
#define LOCUS_SERVER_SCHEDULING_FAIR_QUEUE_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <set>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/base/check.h"

namespace locus::server {

template <class Entry>
class FairQueue {
 public:
  // Maximum number of idle clients that are remembered because they have received more work than their fair share.
  static constexpr size_t kMaxIdleClients = 4096;

  bool empty() const { return waiting_.empty(); }
  // Returns the number of waiting clients and remembered idle clients.
  size_t clients() const { return queues_.size(); }

  void push_back(uint64_t client, Entry entry) {
    activate(client).entries.push_back(std::move(entry));
    LOCUS_DCHECK_CALL(check_invariants(client));
  }
  // Adds an entry ahead of the client's other entries.
  void push_front(uint64_t client, Entry entry) {
    activate(client).entries.push_front(std::move(entry));
    LOCUS_DCHECK_CALL(check_invariants(client));
  }

  // Returns the next entry to serve, without removing it, and charges `cost` to its client, so that the following call
  // may return another client's entry. `cost` is an estimate of the entry's work; correct it later by charge().
  // Precondition: the queue is not empty.
  Entry next(uint64_t cost) {
    LOCUS_DCHECK(!waiting_.empty());
    const auto [spent, client] = *waiting_.begin();
    virtual_time_ = std::max(virtual_time_, spent);
    forget_settled();
    const Entry entry = queues_[client].entries.front();
    charge(client, static_cast<int64_t>(cost));
    return entry;
  }

  // Adds `cost` to the work served to a client; a negative `cost` is a refund. Ignores unknown clients.
  void charge(uint64_t client, int64_t cost) {
    const auto found = queues_.find(client);
    if (found == queues_.end()) return;
    ClientQueue& queue = found->second;
    std::set<Rank>& ranks = queue.entries.empty() ? idle_ : waiting_;
    ranks.erase({queue.spent, client});
    queue.spent += static_cast<uint64_t>(cost);  // a negative cost wraps around to a subtraction
    ranks.insert({queue.spent, client});
    LOCUS_DCHECK_CALL(check_invariants(client));
  }

  // Removes an entry; returns false if the client has no such entry.
  bool remove(uint64_t client, const Entry& entry) {
    const auto found = queues_.find(client);
    if (found == queues_.end()) return false;
    ClientQueue& queue = found->second;
    const auto position = std::find(queue.entries.begin(), queue.entries.end(), entry);
    if (position == queue.entries.end()) return false;
    queue.entries.erase(position);
    if (queue.entries.empty()) deactivate(client, queue);
    LOCUS_DCHECK_CALL(check_invariants(client));
    return true;
  }

  // Removes and returns every entry for which `wanted` returns true. O(entries).
  template <class Wanted>
  std::vector<Entry> remove_if(const Wanted& wanted) {
    std::vector<std::pair<uint64_t, Entry>> found;
    for (const Rank& rank : waiting_)
      for (const Entry& entry : queues_[rank.second].entries)
        if (wanted(entry)) found.push_back({rank.second, entry});
    std::vector<Entry> taken;
    for (const auto& [client, entry] : found) {
      remove(client, entry);
      taken.push_back(entry);
    }
    return taken;
  }

  // Checks the numbers of clients, and the invariants for `client`, which need not be in the queue. O(log clients).
  void check_invariants(uint64_t client) const {
    LOCUS_CHECK_EQ(waiting_.size() + idle_.size(), queues_.size());
    LOCUS_CHECK_LE(idle_.size(), kMaxIdleClients);
    const auto found = queues_.find(client);
    if (found == queues_.end()) return;
    const bool waits = !found->second.entries.empty();
    LOCUS_CHECK_EQ(waiting_.contains({found->second.spent, client}), waits);
    LOCUS_CHECK_EQ(idle_.contains({found->second.spent, client}), !waits);
  }

 private:
  using Rank = std::pair<uint64_t, uint64_t>;  // (work served to a client, client)

  struct ClientQueue {
    uint64_t spent = 0;
    std::deque<Entry> entries;
  };

  // Returns the queue of a client that is about to get an entry, and moves the client to `waiting_`.
  ClientQueue& activate(uint64_t client) {
    ClientQueue& queue = queues_[client];
    if (!queue.entries.empty()) return queue;
    idle_.erase({queue.spent, client});
    queue.spent = std::max(queue.spent, virtual_time_);
    waiting_.insert({queue.spent, client});
    return queue;
  }

  void deactivate(uint64_t client, const ClientQueue& queue) {
    waiting_.erase({queue.spent, client});
    idle_.insert({queue.spent, client});
    if (idle_.size() > kMaxIdleClients) forget_least();
  }

  void forget_settled() {
    while (!idle_.empty() && idle_.begin()->first <= virtual_time_) forget_least();
  }
  void forget_least() {
    queues_.erase(idle_.begin()->second);
    idle_.erase(idle_.begin());
  }

  absl::flat_hash_map<uint64_t, ClientQueue> queues_;  // waiting and remembered clients
  std::set<Rank> waiting_;                             // clients with entries
  std::set<Rank> idle_;                                // clients without entries
  // Maximum, over all calls of next(), of the work that the chosen client had received before the call.
  uint64_t virtual_time_ = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_FAIR_QUEUE_H_
