// Entries of many clients, served so that each client gets an equal share of the work done, however many entries it has
// waiting: the client that has had least goes first, its entries in their order. A client that comes new, or back,
// starts where those who wait are, so that nobody saves up a claim by being away; one that leaves in debt finds its
// debt again.
//
// Source: Goyal, Vin, Cheng, Start-time Fair Queueing, 1996. One thread at a time. Every operation is O(log clients),
// remove() also O(entries of the client). Memory: a line for each client that waits, and up to kMaxDebtors more.
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

namespace locus::server {

template <class Entry>
class FairQueue {
 public:
  // Clients remembered only for what they had too much.
  static constexpr size_t kMaxDebtors = 4096;

  bool empty() const { return order_.empty(); }
  // That wait or are remembered.
  size_t clients() const { return lines_.size(); }

  void push_back(uint64_t client, Entry entry) { wait(client).entries.push_back(std::move(entry)); }
  // Ahead of the client's other entries.
  void push_front(uint64_t client, Entry entry) { wait(client).entries.push_front(std::move(entry)); }

  // The entry whose turn it is; it stays where it is. Books `cost` to its client at once, so that the next turn may be
  // another's; correct() says later what it was in fact. Not of an empty queue.
  Entry turn(uint64_t cost) {
    const auto [spent, client] = *order_.begin();
    now_ = std::max(now_, spent);
    forget_settled();
    const Entry entry = lines_[client].entries.front();
    correct(client, static_cast<int64_t>(cost));
    return entry;
  }

  // Adds to what a client has had, or takes from it.
  void correct(uint64_t client, int64_t cost) {
    const auto found = lines_.find(client);
    if (found == lines_.end()) return;
    Line& line = found->second;
    std::set<Place>& places = line.entries.empty() ? debtors_ : order_;
    places.erase({line.spent, client});
    line.spent += static_cast<uint64_t>(cost);  // wraps as it should for a cost below 0
    places.insert({line.spent, client});
  }

  // False where the client has no such entry.
  bool remove(uint64_t client, const Entry& entry) {
    const auto found = lines_.find(client);
    if (found == lines_.end()) return false;
    Line& line = found->second;
    const auto place = std::find(line.entries.begin(), line.entries.end(), entry);
    if (place == line.entries.end()) return false;
    line.entries.erase(place);
    if (line.entries.empty()) leave(client, line);
    return true;
  }

  // Removes every entry of which `wanted` is true, and returns them. O(entries).
  template <class Wanted>
  std::vector<Entry> take_if(const Wanted& wanted) {
    std::vector<std::pair<uint64_t, Entry>> found;
    for (const Place& place : order_)
      for (const Entry& entry : lines_[place.second].entries)
        if (wanted(entry)) found.push_back({place.second, entry});
    std::vector<Entry> taken;
    for (const auto& [client, entry] : found) {
      remove(client, entry);
      taken.push_back(entry);
    }
    return taken;
  }

 private:
  using Place = std::pair<uint64_t, uint64_t>;  // what a client has had, and the client

  struct Line {
    uint64_t spent = 0;
    std::deque<Entry> entries;
  };

  // The line of a client that is about to have an entry.
  Line& wait(uint64_t client) {
    Line& line = lines_[client];
    if (!line.entries.empty()) return line;
    debtors_.erase({line.spent, client});
    line.spent = std::max(line.spent, now_);
    order_.insert({line.spent, client});
    return line;
  }

  void leave(uint64_t client, const Line& line) {
    order_.erase({line.spent, client});
    debtors_.insert({line.spent, client});
    if (debtors_.size() > kMaxDebtors) forget_least();
  }

  void forget_settled() {
    while (!debtors_.empty() && debtors_.begin()->first <= now_) forget_least();
  }
  void forget_least() {
    lines_.erase(debtors_.begin()->second);
    debtors_.erase(debtors_.begin());
  }

  absl::flat_hash_map<uint64_t, Line> lines_;  // each in one of the sets
  std::set<Place> order_;                      // with entries
  std::set<Place> debtors_;                    // without
  uint64_t now_ = 0;                           // what the client served last had had before
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_FAIR_QUEUE_H_
