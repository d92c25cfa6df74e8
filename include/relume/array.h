// SPDX-License-Identifier: MIT
// Array<T>: a contiguous, immutable array that either owns its elements or borrows them from memory that something
// else keeps alive (a mapped file). The plain data of a bake is made of these, so that the same structs serve the
// baker, which builds vectors and moves them in, and a game, which maps the file and copies nothing.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace relume {

template <class T>
class Array {
 public:
  using value_type = T;

  Array() = default;
  // Takes over the elements of a vector.
  Array(std::vector<T> elements) {
    auto owner = std::make_shared<const std::vector<T>>(std::move(elements));
    view_ = std::span<const T>(owner->data(), owner->size());
    owner_ = std::move(owner);
  }
  // Borrows elements that `owner` keeps alive. `elements` must be aligned for T.
  Array(std::shared_ptr<const void> owner, std::span<const T> elements) : owner_(std::move(owner)), view_(elements) {}

  std::size_t size() const { return view_.size(); }
  bool empty() const { return view_.empty(); }
  const T* data() const { return view_.data(); }
  const T* begin() const { return view_.data(); }
  const T* end() const { return view_.data() + view_.size(); }
  const T& operator[](std::size_t i) const { return view_[i]; }
  const T& front() const { return view_.front(); }
  const T& back() const { return view_.back(); }
  std::span<const T> span() const { return view_; }
  operator std::span<const T>() const { return view_; }
  std::vector<T> toVector() const { return std::vector<T>(view_.begin(), view_.end()); }

 private:
  std::shared_ptr<const void> owner_;
  std::span<const T> view_;
};

}  // namespace relume
