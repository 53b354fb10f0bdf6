// A hash map whose copy costs O(1): copies share their nodes, and a write replaces only the nodes on its path. For the
// one writer of a scene, whose readers keep copies of earlier revisions.
//
// Threads: as for a standard container, each map object by itself: const members may run concurrently, others need
// exclusive use. Maps that share nodes are independent of each other in every way: any thread may write to, copy or
// drop its own while others read theirs.
//
// Invariants: a node reachable from two maps is never changed again. Each node names the owner that made it; a map
// changes in place only what its present owner made and forgets its owner when copied, so that no reference count is
// ever asked. The trie is at most kMaxDepth branches deep; keys with equal hashes share one leaf at its end. Source:
// Bagwell, Ideal Hash Trees, 2001; owners as in Clojure's transient maps (Hickey).
#ifndef LOCUS_CORE_BASE_PERSISTENT_MAP_H_
#define LOCUS_CORE_BASE_PERSISTENT_MAP_H_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/hash/hash.h"
#include "core/base/check.h"

namespace locus {

namespace internal {
// Never 0 and never the same twice.
inline uint64_t new_map_owner() {
  static std::atomic<uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}
}  // namespace internal

template <class K, class V, class Hash = absl::Hash<K>>
class PersistentMap {
 public:
  PersistentMap() = default;
  // O(1). Both maps may be written afterwards; neither sees the other's writes.
  PersistentMap(const PersistentMap& other) : root_(other.root_), size_(other.size_) {
    other.owner_.store(kNoOwner, std::memory_order_relaxed);
  }
  PersistentMap(PersistentMap&& other) noexcept
      : root_(std::move(other.root_)),
        size_(std::exchange(other.size_, 0)),
        owner_(other.owner_.exchange(kNoOwner, std::memory_order_relaxed)) {}
  PersistentMap& operator=(PersistentMap other) noexcept {
    root_ = std::move(other.root_);
    size_ = std::exchange(other.size_, 0);
    owner_.store(other.owner_.exchange(kNoOwner, std::memory_order_relaxed), std::memory_order_relaxed);
    return *this;
  }

  // A copy: what a reader keeps.
  PersistentMap snapshot() const { return *this; }

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  // Null when absent. The value stays where it is until this map is next written or dropped. O(1).
  const V* find(const K& key) const;
  // Inserts or replaces; true when the key is new. O(1): copies at most kMaxDepth branches and one leaf.
  bool set(const K& key, V value);
  // False when absent. As set().
  bool erase(const K& key);
  // fn(key, value) for every entry; the order depends on hashes and history only. O(size).
  template <class Fn>
  void for_each(Fn&& fn) const {
    if (root_) for_each_below(root_.get(), fn);
  }
  // Bytes of nodes that `other` does not share at the same place. O(those nodes).
  size_t bytes_apart_from(const PersistentMap& other) const { return bytes_apart(root_.get(), other.root_.get()); }

 private:
  static constexpr uint64_t kNoOwner = 0;
  static constexpr int kBits = 4;
  static constexpr size_t kFanOut = size_t{1} << kBits;
  static constexpr int kMaxDepth = 64 / kBits;
  static constexpr size_t kLeafCapacity = 8;  // passed only at kMaxDepth, where all hashes of a leaf are equal

  struct Node {
    Node(bool leaf, uint64_t maker) : owner(maker), is_leaf(leaf) {}
    mutable std::atomic<uint32_t> references{1};
    const uint64_t owner;
    const bool is_leaf;
  };

  // One counted reference to a node, or none.
  class NodePtr {
   public:
    NodePtr() = default;
    explicit NodePtr(Node* made) : node_(made) {}
    NodePtr(const NodePtr& other) : node_(other.node_) {
      if (node_ != nullptr) node_->references.fetch_add(1, std::memory_order_relaxed);
    }
    NodePtr(NodePtr&& other) noexcept : node_(std::exchange(other.node_, nullptr)) {}
    NodePtr& operator=(NodePtr other) noexcept {
      std::swap(node_, other.node_);
      return *this;
    }
    ~NodePtr() {
      if (node_ != nullptr && node_->references.fetch_sub(1, std::memory_order_acq_rel) == 1) destroy(node_);
    }
    explicit operator bool() const { return node_ != nullptr; }
    Node* get() const { return node_; }

   private:
    Node* node_ = nullptr;
  };

  struct Entry {
    K key;
    V value;
  };
  struct Leaf : Node {
    explicit Leaf(uint64_t maker) : Node(true, maker) {}
    Leaf(const Leaf& other, uint64_t maker) : Node(true, maker), entries(other.entries) {}
    std::vector<Entry> entries;
  };
  struct Branch : Node {
    explicit Branch(uint64_t maker) : Node(false, maker) {}
    Branch(const Branch& other, uint64_t maker) : Node(false, maker), children(other.children) {}
    std::array<NodePtr, kFanOut> children;
  };

  static Leaf* leaf_of(Node* node) { return static_cast<Leaf*>(node); }
  static Branch* branch_of(Node* node) { return static_cast<Branch*>(node); }
  static void destroy(Node* node) {  // as deep as the trie
    if (node->is_leaf) {
      delete leaf_of(node);
    } else {
      delete branch_of(node);
    }
  }
  static uint64_t hash_of(const K& key) { return static_cast<uint64_t>(Hash{}(key)); }
  static size_t digit(uint64_t hash, int depth) { return (hash >> (depth * kBits)) & (kFanOut - 1); }
  static const Entry* find_in(const Leaf& leaf, const K& key) {
    for (const Entry& entry : leaf.entries) {
      if (entry.key == key) return &entry;
    }
    return nullptr;
  }

  uint64_t claim_owner() {
    uint64_t owner = owner_.load(std::memory_order_relaxed);
    if (owner == kNoOwner) {
      owner = internal::new_map_owner();
      owner_.store(owner, std::memory_order_relaxed);
    }
    return owner;
  }

  // The node behind `link`, replaced by a copy first unless `owner` made it.
  template <class NodeType>
  static NodeType* writable(NodePtr& link, uint64_t owner) {
    if (link.get()->owner != owner) link = NodePtr(new NodeType(*static_cast<NodeType*>(link.get()), owner));
    return static_cast<NodeType*>(link.get());
  }

  // Replaces a full leaf by a branch over leaves that hold its entries by their next digit.
  static void split(NodePtr& link, int depth, uint64_t owner);
  // Removes an existing key below `link`; leaves `link` null when nothing remains there.
  static void erase_below(NodePtr& link, const K& key, uint64_t hash, int depth, uint64_t owner);
  template <class Fn>
  static void for_each_below(Node* node, Fn& fn);
  static size_t bytes_apart(const Node* node, const Node* other);

  NodePtr root_;
  size_t size_ = 0;
  mutable std::atomic<uint64_t> owner_{kNoOwner};  // whose nodes this map may change; cleared by copying
};

template <class K, class V, class Hash>
const V* PersistentMap<K, V, Hash>::find(const K& key) const {
  const uint64_t hash = hash_of(key);
  Node* node = root_.get();
  for (int depth = 0; node != nullptr && !node->is_leaf; ++depth) {
    node = branch_of(node)->children[digit(hash, depth)].get();
  }
  const Entry* entry = node == nullptr ? nullptr : find_in(*leaf_of(node), key);
  return entry == nullptr ? nullptr : &entry->value;
}

template <class K, class V, class Hash>
bool PersistentMap<K, V, Hash>::set(const K& key, V value) {
  const uint64_t owner = claim_owner();
  const uint64_t hash = hash_of(key);
  NodePtr* link = &root_;
  for (int depth = 0;; ++depth) {
    if (!*link) *link = NodePtr(new Leaf(owner));
    if (link->get()->is_leaf) {
      if (const Entry* found = find_in(*leaf_of(link->get()), key)) {
        const size_t at = static_cast<size_t>(found - leaf_of(link->get())->entries.data());
        writable<Leaf>(*link, owner)->entries[at].value = std::move(value);
        return false;
      }
      if (depth == kMaxDepth || leaf_of(link->get())->entries.size() < kLeafCapacity) break;
      split(*link, depth, owner);
    }
    link = &writable<Branch>(*link, owner)->children[digit(hash, depth)];
  }
  writable<Leaf>(*link, owner)->entries.push_back({key, std::move(value)});
  ++size_;
  return true;
}

template <class K, class V, class Hash>
bool PersistentMap<K, V, Hash>::erase(const K& key) {
  if (find(key) == nullptr) return false;  // so that nothing is copied in vain
  erase_below(root_, key, hash_of(key), 0, claim_owner());
  --size_;
  return true;
}

template <class K, class V, class Hash>
void PersistentMap<K, V, Hash>::split(NodePtr& link, int depth, uint64_t owner) {
  Branch* branch = new Branch(owner);
  const NodePtr split_branch(branch);
  for (const Entry& entry : leaf_of(link.get())->entries) {
    NodePtr& child = branch->children[digit(hash_of(entry.key), depth)];
    if (!child) child = NodePtr(new Leaf(owner));
    leaf_of(child.get())->entries.push_back(entry);
  }
  link = split_branch;
}

template <class K, class V, class Hash>
void PersistentMap<K, V, Hash>::erase_below(NodePtr& link, const K& key, uint64_t hash, int depth, uint64_t owner) {
  LOCUS_DCHECK(depth <= kMaxDepth);
  if (link.get()->is_leaf) {
    std::vector<Entry>& entries = writable<Leaf>(link, owner)->entries;
    for (Entry& entry : entries) {
      if (!(entry.key == key)) continue;
      if (&entry != &entries.back()) entry = std::move(entries.back());
      entries.pop_back();
      break;
    }
    if (entries.empty()) link = NodePtr();
    return;
  }
  Branch* branch = writable<Branch>(link, owner);
  erase_below(branch->children[digit(hash, depth)], key, hash, depth + 1, owner);
  const NodePtr* last = nullptr;
  int remaining = 0;
  for (const NodePtr& child : branch->children) {
    if (child) last = &child, ++remaining;
  }
  if (remaining == 0) {
    link = NodePtr();
  } else if (remaining == 1 && last->get()->is_leaf) {
    const NodePtr only = *last;  // taken before its branch goes
    link = only;
  }
}

template <class K, class V, class Hash>
template <class Fn>
void PersistentMap<K, V, Hash>::for_each_below(Node* node, Fn& fn) {
  if (node->is_leaf) {
    for (const Entry& entry : leaf_of(node)->entries) fn(entry.key, entry.value);
    return;
  }
  for (const NodePtr& child : branch_of(node)->children) {
    if (child) for_each_below(child.get(), fn);
  }
}

template <class K, class V, class Hash>
size_t PersistentMap<K, V, Hash>::bytes_apart(const Node* node, const Node* other) {  // as deep as the trie
  if (node == other || node == nullptr) return 0;
  if (node->is_leaf) return sizeof(Leaf) + static_cast<const Leaf*>(node)->entries.capacity() * sizeof(Entry);
  const auto* branch = static_cast<const Branch*>(node);
  const auto* other_branch = other == nullptr || other->is_leaf ? nullptr : static_cast<const Branch*>(other);
  size_t bytes = sizeof(Branch);
  for (size_t digit = 0; digit < kFanOut; ++digit)
    bytes += bytes_apart(branch->children[digit].get(),
                         other_branch == nullptr ? nullptr : other_branch->children[digit].get());
  return bytes;
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PERSISTENT_MAP_H_
