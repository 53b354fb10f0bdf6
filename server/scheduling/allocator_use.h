// Settings and use of the C library's allocator: bytes in live allocations, and free bytes that later allocations reuse
// and that are given back to the system while the process is idle. Plain functions; any thread. allocator_use() and
// return_free_memory() lock the allocator's arenas one after another and visit their free blocks.
//
// glibc has one arena for each of the first threads. A freed block at the end of an arena joins the arena's top, which
// malloc_trim() does not return: only a free() in the arena does, if the top exceeds a threshold of the process.
#ifndef LOCUS_SERVER_SCHEDULING_ALLOCATOR_USE_H_
#define LOCUS_SERVER_SCHEDULING_ALLOCATOR_USE_H_

#include <cstdint>

namespace locus::server {

// Makes the allocator keep freed memory. By default, glibc returns the memory of large messages to the system each
// time, which halves throughput. With these settings an arena keeps at most 512 MiB, or an eighth of the memory limit
// if that is less. Call it before other threads start.
void keep_freed_memory(uint64_t memory_limit);

struct AllocatorUse {
  uint64_t live = 0;  // bytes of allocations that are in use, including large arrays, which have mappings of their own
  // Upper bound of the bytes of free blocks that are resident, so that their return makes the process smaller. The
  // allocator does not report which of its free blocks it has returned already, so this is the smaller of two numbers:
  // the bytes of all free blocks, and the resident bytes of the process beyond `live`.
  uint64_t reusable = 0;
};

// Returns the use of the allocator in a process of `resident` bytes.
AllocatorUse allocator_use(uint64_t resident);

// Returns the whole pages of free blocks to the system, except the tops of arenas.
void return_free_memory();
// Returns the top of the calling thread's arena to the system, if keep_freed_memory() was called. Takes microseconds
// if there is little to return. The tops of other arenas may be returned as well if their threads free large blocks at
// this moment, so call it rarely.
void return_top_of_arena();

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_ALLOCATOR_USE_H_
