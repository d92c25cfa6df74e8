// SPDX-License-Identifier: MIT
// What a bake knows of a store: entries are found or they are not, and what is made is kept. Nothing here can fail a
// bake. A store that cannot be reached or read is done without, one that is read-only or full is no longer written:
// each with one warning that names it. A damaged entry counts as none, and is made again.
#pragma once

#include "bake/store/entry_file.h"
#include "bake/store/store.h"
#include "relume/bake/context.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace relume {

// Of one thread at a time.
class EntryCache {
 public:
  // limit [byte] of a folder, held at the end of a bake; 0 = none.
  EntryCache(std::unique_ptr<Store> store, std::uint64_t limit) : store_(std::move(store)), limit_(limit) {}

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
  void warn(const std::string& text) const;

  std::unique_ptr<Store> store_;
  std::uint64_t limit_;
  std::function<void(Severity, std::string_view)> onMessage_;
  Statistics statistics_;
  std::uint64_t lastFoundBytes_ = 0;
  bool readable_ = true, writable_ = true;
};

}  // namespace relume
