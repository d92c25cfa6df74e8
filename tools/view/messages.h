// SPDX-License-Identifier: MIT
// What the window has to say: errors until they are closed, news for some seconds.
#pragma once

#include "relume/bake/context.h"
#include "relume/result.h"

#include <algorithm>
#include <cstddef>
#include <deque>
#include <string>
#include <utility>

namespace relume {

class Messages {
 public:
  struct Message {
    Severity severity = Severity::info;
    std::string text;
    double until = 0.0;   // [s] when it goes; errors and warnings stay
    std::string topic{};  // of update()
  };
  static constexpr double kNewsSeconds = 6.0;
  static constexpr std::size_t kMaxShown = 4;  // of news, and of what stays

  // A text that is shown already is not repeated.
  void say(Severity severity, std::string text, double now) {
    std::erase_if(shown_, [&](const Message& m) { return m.text == text; });
    shown_.push_back({severity, std::move(text), now + kNewsSeconds});
    const auto isLike = [&](const Message& m) { return isNews(m.severity) == isNews(severity); };
    if (std::count_if(shown_.begin(), shown_.end(), isLike) > static_cast<std::ptrdiff_t>(kMaxShown))
      shown_.erase(std::find_if(shown_.begin(), shown_.end(), isLike));
  }
  // News in place of what was said of the same topic.
  void update(const std::string& topic, std::string text, double now) {
    std::erase_if(shown_, [&](const Message& m) { return m.topic == topic; });
    say(Severity::info, std::move(text), now);
    shown_.back().topic = topic;
  }
  // False, and its error is shown, unless it went well.
  bool check(const Status& status, double now) {
    if (!status) say(Severity::error, status.error().message, now);
    return static_cast<bool>(status);
  }
  void forgetOld(double now) {
    std::erase_if(shown_, [&](const Message& m) { return isNews(m.severity) && m.until < now; });
  }
  void close(std::size_t index) { shown_.erase(shown_.begin() + static_cast<std::ptrdiff_t>(index)); }
  const std::deque<Message>& shown() const { return shown_; }

 private:
  static bool isNews(Severity severity) { return severity == Severity::info; }

  std::deque<Message> shown_;
};

}  // namespace relume
