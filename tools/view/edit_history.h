// SPDX-License-Identifier: MIT
// Undo and redo by whole states: what is edited is small, and a state that comes back is exactly what it was.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace relume {

// T is copyable and comparable.
template <class T>
class EditHistory {
 public:
  static constexpr std::size_t kMaxSteps = 256;

  explicit EditHistory(T first = {}) : current_(std::move(first)) {}

  // Note a state, once an edit is over. False when it is the one that is known: nothing was edited.
  bool commit(const T& state) {
    if (state == current_) return false;
    if (past_.size() == kMaxSteps) past_.erase(past_.begin());
    past_.push_back(std::exchange(current_, state));
    future_.clear();
    return true;
  }
  // Put a state in place of the one that is known, which is no edit.
  void replace(T state) { current_ = std::move(state); }
  // change(T&) of all states: the one that is known, and those that can be undone and redone. It is no edit.
  template <class Change>
  void change(const Change& change) {
    change(current_);
    for (T& past : past_) change(past);
    for (T& future : future_) change(future);
  }
  const T& current() const { return current_; }
  bool canUndo() const { return !past_.empty(); }
  bool canRedo() const { return !future_.empty(); }
  // The state before the last edit, or after the one that was undone last; where there is none, the state that is.
  const T& undo() { return step(past_, future_); }
  const T& redo() { return step(future_, past_); }

 private:
  const T& step(std::vector<T>& from, std::vector<T>& to) {
    if (from.empty()) return current_;
    to.push_back(std::exchange(current_, std::move(from.back())));
    from.pop_back();
    return current_;
  }

  T current_;
  std::vector<T> past_, future_;
};

}  // namespace relume
