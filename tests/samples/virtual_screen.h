// SPDX-License-Identifier: MIT
// A screen that nobody sees (Xvfb), programs on it, keys and mouse by xdotool, and what the screen shows: Xvfb keeps
// its pixels in a file in XWD's format.
#pragma once

#include <glm/common.hpp>
#include <glm/vec2.hpp>

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace relume {

struct Rgb {
  int r = 0, g = 0, b = 0;
  int sum() const { return r + g + b; }
};

struct ScreenPicture {
  std::uint32_t width = 0, height = 0;
  std::vector<Rgb> pixel;  // [Size width * height] rows from the top
  // Share of the pixels for which is(pixel) holds.
  double share(const std::function<bool(const Rgb&)>& is) const;
};

// Pixels from `low` up to, not with, `high`; empty when both are equal.
struct Box {
  glm::uvec2 low{0}, high{0};
  std::uint32_t width() const { return high.x - low.x; }
  std::uint32_t height() const { return high.y - low.y; }
};

// The box around all pixels whose channels differ by more than `threshold` of 765 together.
Box differenceOf(const ScreenPicture& a, const ScreenPicture& b, int threshold);

class VirtualScreen {
 public:
  VirtualScreen() = default;
  ~VirtualScreen() { stop(); }
  VirtualScreen(const VirtualScreen&) = delete;
  VirtualScreen& operator=(const VirtualScreen&) = delete;

  // False when Xvfb is not there within ten seconds. Its files go to `folder`.
  bool start(const std::filesystem::path& folder, std::uint32_t width, std::uint32_t height);
  void stop();

  // Starts a program on the screen; what it prints goes to `log`. Returns its process.
  pid_t run(const std::string& program, const std::vector<std::string>& arguments,
            const std::filesystem::path& log) const;
  bool isRunning(pid_t process) const;
  void end(pid_t process) const;

  ScreenPicture picture() const;
  using Condition = std::function<bool(const ScreenPicture&)>;
  // Whether a picture comes within a minute that is() likes, while goesOn(). A software rasteriser has frames of
  // seconds: wait for what is to be seen, never for a time.
  bool waitFor(
      const Condition& is, const std::function<bool()>& goesOn = [] { return true; }) const;
  // The same of anything but the picture, which takes a while to read.
  static bool waitUntil(
      const std::function<bool()>& is, const std::function<bool()>& goesOn = [] { return true; });
  // The picture once it has stopped changing.
  ScreenPicture settled() const;

  // Hold a key, or a button while the mouse goes from one place to another, until is() or a minute is over.
  bool holdKey(const std::string& name, const Condition& is) const;
  bool drag(int button, const glm::ivec2& from, const glm::ivec2& to, const Condition& is) const;
  // Once, as fast as a hand: the mouse to a place, a button there, a way with the button held, keys ("ctrl+z").
  void moveTo(const glm::ivec2& at) const;
  void click(int button, const glm::ivec2& at) const;
  void scroll(int notches, const glm::ivec2& at) const;         // of the wheel, away from the hand positive
  void holdKey(const std::string& name, double seconds) const;  // for a time, which the window may not see whole
  void dragOnce(int button, const glm::ivec2& from, const glm::ivec2& to) const;
  void press(const std::string& keys) const;
  bool hasWindow(const std::string& title) const;  // whose title has this in it
  const std::string& display() const { return display_; }

 private:
  bool succeeds(const std::string& arguments) const;  // of xdotool
  void xdotool(const std::string& arguments) const;

  std::filesystem::path folder_;
  std::string display_;
  pid_t server_ = -1;
};

}  // namespace relume
