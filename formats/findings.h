// SPDX-License-Identifier: MIT
// Collects findings: one per check, with the first position in the file's arrays and a count. Private to formats/.
#pragma once

#include "formats/decimal.h"
#include "formats/validate.h"

#include <memory_resource>
#include <string>
#include <string_view>
#include <vector>

namespace relume {

class Findings {
 public:
  // Note one violation. Text is made for the first of a check only.
  template <class Where, class Expected, class Found>
  void add(Check check, const Where& where, const Expected& expected, const Found& found) {
    for (Finding& finding : list_) {
      if (finding.check != check) continue;
      ++finding.count;
      return;
    }
    insert(check, text(where), text(expected), text(found));
  }

  bool empty() const { return list_.empty(); }
  const std::vector<Finding>& list() const { return list_; }
  std::vector<Finding> takeSorted();

 private:
  static std::string text(std::string_view s) { return std::string(s); }
  static std::string text(const glm::vec3& v) {
    return "(" + decimal(v.x) + ", " + decimal(v.y) + ", " + decimal(v.z) + ")";
  }
  template <class T>
  requires std::is_arithmetic_v<T>
  static std::string text(T v) {
    if constexpr (std::is_floating_point_v<T>) return decimal(v);
    return std::to_string(v);
  }
  // The position is made of an array's name and an index, only when it is needed.
  template <class T>
  requires requires(const T& t) { t.array; }
  static std::string text(const T& at) { return std::string(at.array) + "[" + std::to_string(at.index) + "]"; }
  void insert(Check check, std::string where, std::string expected, std::string found);

  std::vector<Finding> list_;
};

// "surfel.normal[12]"
struct At {
  const char* array;
  std::uint64_t index;
};

void checkStructureInto(const Bake& bake, Findings& findings, std::pmr::memory_resource* memory);  // 1xx
void checkNumbers(const Bake& bake, Findings& findings);    // the numbers that light is computed with, of 2xx to 5xx
void checkSurfels(const Bake& bake, Findings& findings);    // the rest of 2xx
void checkHierarchy(const Bake& bake, Findings& findings);  // the rest of 3xx
void checkCaches(const Bake& bake, Findings& findings);     // the rest of 4xx
void checkLinks(const Bake& bake, Findings& findings);      // the rest of 5xx

}  // namespace relume
