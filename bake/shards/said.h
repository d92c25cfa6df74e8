// SPDX-License-Identifier: MIT
// What stages have said, kept with what they made: who finds it later is told the same.
#pragma once

#include "relume/bake/context.h"

#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

struct Said {
  Severity severity = Severity::info;
  std::string text;
};

// Notes a context's messages while it lives, and hands them on.
class SaidRecorder {
 public:
  explicit SaidRecorder(Context& context);
  ~SaidRecorder();
  SaidRecorder(const SaidRecorder&) = delete;
  SaidRecorder& operator=(const SaidRecorder&) = delete;
  const std::vector<Said>& said() const { return said_; }

 private:
  Context& context_;
  std::function<void(Severity, std::string_view)> outer_;
  std::mutex mutex_;
  std::vector<Said> said_;
};

// Messages, and other bytes behind them at a multiple of 8.
std::vector<std::byte> packSaid(std::span<const Said> said, std::span<const std::byte> behind);
struct UnpackedSaid {
  std::vector<Said> said;
  std::span<const std::byte> behind;
};
// Nothing where the bytes are not of packSaid().
std::optional<UnpackedSaid> unpackSaid(std::span<const std::byte> bytes);

}  // namespace relume
