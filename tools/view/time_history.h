// SPDX-License-Identifier: MIT
// What the last frames cost, pass by pass, for a plot.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace relume {

class TimeHistory {
 public:
  static constexpr std::size_t kFrames = 120;

  // Times of one frame [ms], by pass. Other passes than before begin a new history.
  void add(const std::vector<std::pair<std::string, double>>& times) {
    const bool same = std::equal(times.begin(), times.end(), passes_.begin(), passes_.end(),
                                 [](const auto& t, const Pass& p) { return t.first == p.name; });
    if (!same) {
      passes_.clear();
      for (const auto& [name, ms] : times) passes_.push_back({name, {}});
      frames_ = 0;
    }
    for (std::size_t p = 0; p < times.size(); ++p)
      passes_[p].ms[frames_ % kFrames] = static_cast<float>(times[p].second);
    ++frames_;
  }

  std::size_t passCount() const { return passes_.size(); }
  const std::string& name(std::size_t pass) const { return passes_[pass].name; }
  std::size_t count() const { return std::min(frames_, kFrames); }
  // [ms] of the frame `age` frames ago, 0 = the last. [Range age < count()]
  float at(std::size_t pass, std::size_t age) const { return passes_[pass].ms[(frames_ - 1 - age) % kFrames]; }
  // [ms] Mean over the frames that are kept.
  float mean(std::size_t pass) const {
    float sum = 0.0f;
    for (std::size_t age = 0; age < count(); ++age) sum += at(pass, age);
    return count() > 0 ? sum / static_cast<float>(count()) : 0.0f;
  }

 private:
  struct Pass {
    std::string name;
    std::array<float, kFrames> ms{};
  };
  std::vector<Pass> passes_;
  std::size_t frames_ = 0;
};

}  // namespace relume
