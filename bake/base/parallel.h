// SPDX-License-Identifier: MIT
// The one place where the baker meets oneTBB. Work is cut into chunks by size alone, never by thread count, so that a
// result that depends on its chunk only is the same at any number of threads.
#pragma once

#include "relume/bake/context.h"

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace relume {

// Run body(begin, end) over [0, count) in chunks of at most `grain` items, on context.threads threads, however few
// cores there are. Chunks run in any order and must not share mutable state. Stops early when the context is cancelled.
// `stage` names the progress report; empty = none. Exceptions of body are rethrown on the calling thread;
// std::bad_alloc where the system has no room for another thread. A single chunk runs on the calling thread.
void parallelChunks(Context& context, std::string_view stage, std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t begin, std::size_t end)>& body);

// The same for many short loops, such as the passes of a frame: the threads are kept from one to the next. Each call of
// parallelChunks() makes an arena of oneTBB's anew, which oneTBB keeps until one of its threads has looked at it: made
// within microseconds of each other, they pile up, and all are looked through each time.
class KeptThreads {
 public:
  explicit KeptThreads(Context& context);  // must outlive this, and has its final number of threads
  ~KeptThreads();
  // From one thread at a time, and not from within a body.
  void parallelChunks(std::size_t count, std::size_t grain,
                      const std::function<void(std::size_t begin, std::size_t end)>& body);

 private:
  struct Arena;
  Context& context_;
  std::unique_ptr<Arena> arena_;
};

// How many threads there are for a context that asks for all.
int coresOfProcess();

// Have the system map memory that is about to be written for the first time: it clears what is mapped, which takes a
// thread longer than to write it. For what std::vector::reserve() has got.
void mapByThreads(Context& context, void* begin, std::size_t bytes);
template <class T>
void reserveByThreads(Context& context, std::vector<T>& items, std::size_t count) {
  items.reserve(count);
  mapByThreads(context, items.data() + items.size(), (items.capacity() - items.size()) * sizeof(T));
}
template <class T>
void resizeByThreads(Context& context, std::vector<T>& items, std::size_t count) {
  reserveByThreads(context, items, count);
  items.resize(count);
}

// Run work while oneTBB, process-wide, has only the calling thread: for libraries over oneTBB whose result depends on
// the number of threads.
void runOnOneThread(const std::function<void()>& work);

}  // namespace relume
