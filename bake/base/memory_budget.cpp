// SPDX-License-Identifier: MIT
// See memory_budget.h.
#include "bake/base/memory_budget.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>

namespace relume {
namespace {

constexpr double kShare = 0.75;  // of the machine's memory

// The number a file starts with; nothing where there is no such file or it says "max".
std::uint64_t numberIn(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t value = 0;
  return file >> value && value > 0 ? value : std::numeric_limits<std::uint64_t>::max();
}

// The least limit of the process's control groups and of those above them, of either version.
std::uint64_t controlGroupLimit() {
  std::uint64_t min = std::numeric_limits<std::uint64_t>::max();
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    // "0::/path" (version 2), "9:memory:/path" (version 1)
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const bool unified = controllers.empty();
    if (!unified && controllers.find("memory") == std::string::npos) continue;
    const std::string root = unified ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory";
    const std::string name = unified ? "/memory.max" : "/memory.limit_in_bytes";
    // Inside a container the path is the host's, and the root is the container's own group.
    for (std::string path = line.substr(second + 1); path.starts_with('/'); path.resize(path.find_last_of('/')))
      min = std::min(min, numberIn(root + path + name));
    min = std::min(min, numberIn(root + name));
  }
  return min;
}

std::uint64_t physicalMemory() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGESIZE);
  return pages > 0 && size > 0 ? static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(size)
                               : std::numeric_limits<std::uint64_t>::max();
}

std::uint64_t addressSpaceLimit() {
  rlimit limit{};
  const bool limited = ::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
  return limited ? limit.rlim_cur : std::numeric_limits<std::uint64_t>::max();
}

std::string mebibytes(double bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f MiB", std::ceil(std::min(bytes, 1e30) / 1048576.0));
  return text;
}

std::uint64_t budgetOf(const Context& context) {
  return context.maxMemory > 0 ? context.maxMemory : machineMemoryBudget();
}

// How a refusal begins.
std::string needs(std::string_view stage, double bytes, std::string_view what) {
  return std::string(stage) + " needs about " + mebibytes(std::isfinite(bytes) ? bytes : 1e30) + " for " +
         std::string(what) + "; ";
}

}  // namespace

std::uint64_t machineMemoryBudget() {
  const std::uint64_t all = std::min({physicalMemory(), controlGroupLimit(), addressSpaceLimit()});
  return static_cast<std::uint64_t>(kShare * static_cast<double>(all));
}

std::uint64_t heldMemory() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t total = 0, resident = 0;
  const long size = ::sysconf(_SC_PAGESIZE);
  return file >> total >> resident && size > 0 ? resident * static_cast<std::uint64_t>(size) : 0;
}

std::uint64_t memoryLeft(const Context& context) {
  const std::uint64_t budget = budgetOf(context);
  return budget - std::min(budget, heldMemory());
}

Status reserveMemory(Context& context, std::string_view stage, double bytes, std::string_view what,
                     std::string_view remedy) {
  const auto budget = static_cast<double>(budgetOf(context)), held = static_cast<double>(heldMemory());
  context.figure("memory_estimate_mib", (held + bytes) / 1048576.0);
  if (std::isfinite(bytes) && held + bytes <= budget) return done();
  return Error{ErrorCode::failed, needs(stage, bytes, what) + mebibytes(held) + " are in use and the budget is " +
                                      mebibytes(budget) + ": " + std::string(remedy) + ", or raise --max-memory"};
}

Status expectMemory(const Context& context, std::string_view stage, double bytes, std::string_view what,
                    std::string_view remedy) {
  const auto budget = static_cast<double>(budgetOf(context));
  if (std::isfinite(bytes) && bytes <= budget) return done();
  return Error{ErrorCode::failed, needs(stage, bytes, what) + "the budget is " + mebibytes(budget) + ": " +
                                      std::string(remedy) + ", or raise --max-memory"};
}

}  // namespace relume
