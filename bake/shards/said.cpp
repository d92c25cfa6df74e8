// SPDX-License-Identifier: MIT
// See said.h. Packed: the number of messages; for each severity and size of the text, all u32, and the text, filled up
// with zeros to a multiple of 8.
#include "bake/shards/said.h"

#include <cstdint>
#include <cstring>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kAlignment = 8, kWords = 2;

std::size_t padded(std::size_t size) { return (size + kAlignment - 1) / kAlignment * kAlignment; }

void append(std::vector<std::byte>& to, const void* data, std::size_t size) {
  const auto* from = static_cast<const std::byte*>(data);
  to.insert(to.end(), from, from + size);
  to.resize(padded(to.size()));
}

}  // namespace

SaidRecorder::SaidRecorder(Context& context) : context_(context), outer_(std::move(context.onMessage)) {
  context_.onMessage = [this](Severity severity, std::string_view text) {
    {
      const std::scoped_lock lock(mutex_);
      said_.push_back({severity, std::string(text)});
    }
    if (outer_) outer_(severity, text);
  };
}

SaidRecorder::~SaidRecorder() { context_.onMessage = std::move(outer_); }

std::vector<std::byte> packSaid(std::span<const Said> said, std::span<const std::byte> behind) {
  std::vector<std::byte> bytes;
  const std::uint64_t count = said.size();
  append(bytes, &count, sizeof(count));
  for (const Said& one : said) {
    const std::uint32_t words[kWords] = {static_cast<std::uint32_t>(one.severity),
                                         static_cast<std::uint32_t>(one.text.size())};
    append(bytes, words, sizeof(words));
    append(bytes, one.text.data(), one.text.size());
  }
  bytes.insert(bytes.end(), behind.begin(), behind.end());
  return bytes;
}

std::optional<UnpackedSaid> unpackSaid(std::span<const std::byte> bytes) {
  UnpackedSaid unpacked;
  std::uint64_t count = 0;
  if (bytes.size() < sizeof(count)) return std::nullopt;
  std::memcpy(&count, bytes.data(), sizeof(count));
  bytes = bytes.subspan(sizeof(count));
  for (std::uint64_t i = 0; i < count; ++i) {
    std::uint32_t words[kWords];
    if (bytes.size() < sizeof(words)) return std::nullopt;
    std::memcpy(words, bytes.data(), sizeof(words));
    bytes = bytes.subspan(sizeof(words));
    if (words[0] > static_cast<std::uint32_t>(Severity::error) || padded(words[1]) > bytes.size()) return std::nullopt;
    unpacked.said.push_back(
        {static_cast<Severity>(words[0]), std::string(reinterpret_cast<const char*>(bytes.data()), words[1])});
    bytes = bytes.subspan(padded(words[1]));
  }
  unpacked.behind = bytes;
  return unpacked;
}

}  // namespace relume
