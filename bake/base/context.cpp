// SPDX-License-Identifier: MIT
// See relume/bake/context.h.
#include "relume/bake/context.h"

#include <chrono>
#include <ctime>

namespace relume {
namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Seconds that all threads of the process have used up together.
double processors() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace

bool Context::progress(std::string_view stage, double fraction) {
  if (cancelled()) return false;
  if (onProgress && !onProgress(stage, fraction)) cancel();
  return !cancelled();
}

void Context::message(Severity severity, std::string_view text) {
  if (onMessage) onMessage(severity, text);
}

void Context::figure(std::string_view name, double value) {
  const std::lock_guard lock(mutex_);
  if (current_ < report_.size()) report_[current_].figures.emplace_back(name, value);
}

Context::Stage::Stage(Context& context, std::string_view name)
    : context_(context), begin_(now()), processorsBegin_(processors()) {
  const std::lock_guard lock(context_.mutex_);
  entry_ = context_.report_.size();
  outer_ = context_.current_;
  context_.report_.push_back({std::string(name), 0.0, 0.0, {}});
  context_.current_ = entry_;
}

Context::Stage::~Stage() {
  const std::lock_guard lock(context_.mutex_);
  context_.report_[entry_].seconds = now() - begin_;
  context_.report_[entry_].processorSeconds = processors() - processorsBegin_;
  context_.current_ = outer_;
}

}  // namespace relume
