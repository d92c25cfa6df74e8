// SPDX-License-Identifier: MIT
// See entry_cache.h.
#include "bake/store/entry_cache.h"

#include "bake/base/memory_budget.h"

#include <algorithm>
#include <cstdio>
#include <new>
#include <utility>

namespace relume {
namespace {

double secondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// Adds the time it lives to a sum.
class Timer {
 public:
  explicit Timer(double& sum) : sum_(sum), begin_(std::chrono::steady_clock::now()) {}
  ~Timer() { sum_ += secondsSince(begin_); }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  double& sum_;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace

EntryCache::EntryCache(std::unique_ptr<Store> store, std::uint64_t limit, const StorePatience& patience)
    : store_(std::move(store)), limit_(limit), patience_(patience) {
  store_->askWhileWaiting(
      [this](std::uint64_t come) { return isWorthIt(waited_ + secondsSince(mark_), statistics_.foundBytes + come); });
}

template <class Ask>
auto EntryCache::wait(const Ask& ask) {
  worked_ += secondsSince(mark_);
  mark_ = Clock::now();
  auto answer = ask();
  waited_ += secondsSince(mark_);
  mark_ = Clock::now();
  return answer;
}

bool EntryCache::isWorthIt(double waited, std::uint64_t found) const {
  return waited <=
         patience_.seconds + patience_.shareOfWork * worked_ + patience_.secondsPerByte * static_cast<double>(found);
}

void EntryCache::dropIfSlow(const Context& context) {
  if (!readable_ || isWorthIt(waited_, statistics_.foundBytes)) return;
  readable_ = writable_ = false;
  if (context.cancelled()) return;
  char cost[64];
  std::snprintf(cost, sizeof(cost), "%.3g s for %.2f MiB", waited_,
                static_cast<double>(statistics_.foundBytes + statistics_.writtenBytes) / 1048576.0);
  warn("store " + store_->name() + ": too slow, done without from here: " + cost + "; bake without --store");
}

void EntryCache::warnOfClosed(const std::string& what, const std::string& reason, bool& told) const {
  if (!told) warn("store " + store_->name() + ": " + what + ": " + reason + "; " + kShareHint);
  told = true;
}

void EntryCache::warn(const std::string& text) const {
  if (onMessage_) onMessage_(Severity::warning, text);
}

std::optional<EntryBytes> EntryCache::find(const EntryName& name, Context& context) {
  if (!readable_) return std::nullopt;
  const Timer timer(statistics_.seconds);
  std::optional<EntryBytes> found = look(name, context);
  dropIfSlow(context);
  return found;
}

std::optional<EntryBytes> EntryCache::look(const EntryName& name, Context& context) {
  const auto damaged = [&](const std::string& reason) {
    lastFoundBytes_ = 0;
    ++statistics_.found;
    reject(name, reason);
    return std::nullopt;
  };
  try {
    const std::uint64_t left = memoryLeft(context);
    auto file = wait([&] { return store_->get(name, std::min(kMaxEntryBytes, left)); });
    if (!file) {
      if (file.error().code == ErrorCode::invalidFile) return damaged(file.error().message);
      if (file.error().code == ErrorCode::memory) {
        ++statistics_.missing;
        warn("store " + store_->name() + ": entry " + toString(name) + " is made again: " + file.error().message +
             (left < kMaxEntryBytes ? ": bake without --store, or raise --max-memory" : ""));
        return std::nullopt;
      }
      if (file.error().code == ErrorCode::unsupported) {
        ++statistics_.missing;
        warnOfClosed("entries that may not be read are made again", file.error().message, toldUnreadable_);
        return std::nullopt;
      }
      if (!isWorthIt(waited_, statistics_.foundBytes)) return std::nullopt;  // find() says so
      readable_ = writable_ = false;
      if (!context.cancelled()) warn("store " + store_->name() + ": done without: " + file.error().message);
      return std::nullopt;
    }
    if (!*file) {
      ++statistics_.missing;
      return std::nullopt;
    }
    const Result<std::uint64_t> size = checkEntry(name, **file);
    if (!size) return damaged(size.error().message);
    if (const Status fits = reserveMemory(context, "store", static_cast<double>(*size), "entry " + toString(name),
                                          "bake without --store");
        !fits) {
      ++statistics_.missing;
      warn(fits.error().message);
      return std::nullopt;
    }
    Result<EntryBytes> bytes = openEntry(**file);
    if (!bytes) return damaged(bytes.error().message);
    ++statistics_.found;
    lastFoundBytes_ = (*file)->size();
    statistics_.foundBytes += lastFoundBytes_;
    return *bytes;
  } catch (const std::bad_alloc&) {
    ++statistics_.missing;
    warn("store " + store_->name() + ": no memory for entry " + toString(name) + ", which is made again");
    return std::nullopt;
  }
}

void EntryCache::reject(const EntryName& name, const std::string& reason) {
  --statistics_.found;
  statistics_.foundBytes -= lastFoundBytes_;
  ++statistics_.damaged;
  warn("store " + store_->name() + ": entry " + toString(name) + " is made again: " + reason);
}

void EntryCache::keep(const EntryName& name, std::span<const std::byte> bytes, Context& context) {
  if (!writable_) return;
  const Timer timer(statistics_.seconds);
  Status kept = done();
  std::uint64_t size = 0;
  try {
    const Result<std::vector<std::byte>> file = sealEntry(name, bytes);
    if (file) size = file->size();
    kept = file ? wait([&] { return store_->put(name, *file); }) : Status(file.error());
  } catch (const std::bad_alloc&) {
    kept = Error{ErrorCode::memory, "out of memory"};
  }
  if (kept) {
    ++statistics_.written;
    statistics_.writtenBytes += size;
  }
  dropIfSlow(context);
  if (kept || !writable_) return;
  if (kept.error().code == ErrorCode::unsupported)
    return warnOfClosed("entries that may not be written are not kept", kept.error().message, toldUnwritable_);
  writable_ = false;
  if (!context.cancelled()) warn("store " + store_->name() + ": nothing more is kept in it: " + kept.error().message);
}

void EntryCache::finish(Context& context) {
  if (limit_ > 0 && readable_) {
    const Timer timer(statistics_.seconds);
    if (const Status held = store_->hold(limit_); !held)
      warn("store " + store_->name() + ": its limit is not held: " + held.error().message);
  }
  const auto figure = [&](const char* name, std::uint64_t value) { context.figure(name, static_cast<double>(value)); };
  figure("entries_found", statistics_.found);
  figure("bytes_found", statistics_.foundBytes);
  figure("entries_missing", statistics_.missing);
  figure("entries_damaged", statistics_.damaged);
  figure("entries_written", statistics_.written);
  figure("bytes_written", statistics_.writtenBytes);
  context.figure("waited_s", statistics_.seconds);
}

}  // namespace relume
