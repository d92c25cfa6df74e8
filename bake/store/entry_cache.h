// SPDX-License-Identifier: MIT
// What a bake knows of a store: entries are found or they are not, and what is made is kept. Nothing here can fail a
// bake. A store that cannot be reached or read, or is too slow, is done without, one that is read-only or full is no
// longer written, entries that may not be read or written are passed over: each with one warning that names it. A
// damaged entry counts as none, and is made again.
#pragma once

#include "bake/store/entry_file.h"
#include "bake/store/store.h"
#include "relume/bake/context.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace relume {

// How long a store may be waited for in all, until it costs more than it can spare (docs/notes/store.md). What is found
// has spared the time of making it, of which its size tells.
struct StorePatience {
  double seconds = 20.0;                           // [>= 0]
  double shareOfWork = 0.5;                        // [>= 0] seconds for each that the bake itself takes
  double secondsPerByte = 1.0 / double{1u << 20};  // [>= 0] of an entry that was found, as the store has it
};

// Of one thread at a time.
class EntryCache {
 public:
  // limit [byte] of a folder, held at the end of a bake; 0 = none.
  EntryCache(std::unique_ptr<Store> store, std::uint64_t limit, const StorePatience& patience = {});
  EntryCache(const EntryCache&) = delete;
  EntryCache& operator=(const EntryCache&) = delete;

  // Who is warned from now on: a bake's own Context::onMessage. What a run finds of its store is no stage's result, so
  // it must not reach a SaidRecorder, which keeps messages for later bakes.
  void reportTo(std::function<void(Severity, std::string_view)> onMessage) { onMessage_ = std::move(onMessage); }

  // An entry's bytes, where it is there, whole, and fits into Context::maxMemory.
  std::optional<EntryBytes> find(const EntryName& name, Context& context);
  void keep(const EntryName& name, std::span<const std::byte> bytes, Context& context);
  // What was found under this name does not hold what it should: it is to be made again, and counts as damaged.
  void reject(const EntryName& name, const std::string& reason);
  // Hold the limit, and note the figures of the stage that runs now.
  void finish(Context& context);

  struct Statistics {
    std::uint64_t found = 0, foundBytes = 0;      // bytes as the store has them
    std::uint64_t missing = 0, damaged = 0;       // were to be made
    std::uint64_t written = 0, writtenBytes = 0;  // bytes as the store has them
    double seconds = 0.0;                         // waited for the store, packing included
  };
  const Statistics& statistics() const { return statistics_; }
  bool readable() const { return readable_; }
  std::string name() const { return store_->name(); }

 private:
  using Clock = std::chrono::steady_clock;

  void warn(const std::string& text) const;
  // Of all entries of a kind, once.
  void warnOfClosed(const std::string& what, const std::string& reason, bool& told) const;
  std::optional<EntryBytes> look(const EntryName& name, Context& context);
  // Ask the store, and add to what it was waited for.
  template <class Ask>
  auto wait(const Ask& ask);
  // Whether that long for that much is no more than patience allows.
  bool isWorthIt(double waited, std::uint64_t found) const;
  void dropIfSlow(const Context& context);

  std::unique_ptr<Store> store_;
  std::uint64_t limit_;
  std::function<void(Severity, std::string_view)> onMessage_;
  Statistics statistics_;
  std::uint64_t lastFoundBytes_ = 0;
  bool readable_ = true, writable_ = true, toldUnreadable_ = false, toldUnwritable_ = false;
  StorePatience patience_;
  double waited_ = 0.0, worked_ = 0.0;  // [s] for the store, and by the bake itself, until mark_
  Clock::time_point mark_ = Clock::now();
};

}  // namespace relume
