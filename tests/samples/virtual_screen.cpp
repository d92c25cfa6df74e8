// SPDX-License-Identifier: MIT
// See virtual_screen.h.
#include "tests/samples/virtual_screen.h"

#include "tests/cli/run_program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <thread>

namespace relume {
namespace {

void pause(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

// Big-endian word of an XWD header.
std::uint32_t wordOf(const std::string& file, std::size_t index) {
  std::uint32_t word = 0;
  for (std::size_t i = 0; i < 4; ++i) word = word << 8 | static_cast<unsigned char>(file[4 * index + i]);
  return word;
}

}  // namespace

double ScreenPicture::share(const std::function<bool(const Rgb&)>& is) const {
  if (pixel.empty()) return 0.0;
  return static_cast<double>(std::count_if(pixel.begin(), pixel.end(), is)) / static_cast<double>(pixel.size());
}

Box differenceOf(const ScreenPicture& a, const ScreenPicture& b, int threshold) {
  Box box{{a.width, a.height}, {0, 0}};
  for (std::size_t i = 0; i < a.pixel.size() && i < b.pixel.size(); ++i) {
    const Rgb &x = a.pixel[i], &y = b.pixel[i];
    if (std::abs(x.r - y.r) + std::abs(x.g - y.g) + std::abs(x.b - y.b) <= threshold) continue;
    const glm::uvec2 at(i % a.width, i / a.width);
    box.low = glm::min(box.low, at);
    box.high = glm::max(box.high, at + 1u);
  }
  return box.low.x < box.high.x ? box : Box{};
}

bool VirtualScreen::start(const std::filesystem::path& folder, std::uint32_t width, std::uint32_t height) {
  folder_ = folder;
  int ends[2];
  if (::pipe(ends) != 0) return false;
  server_ = ::fork();
  if (server_ == 0) {
    const int nothing = ::open("/dev/null", O_RDWR);
    for (const int stream : {0, 1, 2}) ::dup2(nothing, stream);
    const std::string number = std::to_string(ends[1]),
                      size = std::to_string(width) + "x" + std::to_string(height) + "x24";
    ::execlp("Xvfb", "Xvfb", "-displayfd", number.c_str(), "-nolisten", "tcp", "-screen", "0", size.c_str(), "-fbdir",
             folder.c_str(), nullptr);
    ::_exit(127);
  }
  ::close(ends[1]);
  // The server writes the number of its display once it listens, or goes away.
  std::string number;
  for (char c = 0; ::read(ends[0], &c, 1) == 1 && c != '\n';) number += c;
  ::close(ends[0]);
  display_ = ":" + number;
  return !number.empty();
}

void VirtualScreen::stop() {
  if (server_ > 0) end(server_);
  server_ = -1;
}

pid_t VirtualScreen::run(const std::string& program, const std::vector<std::string>& arguments,
                         const std::filesystem::path& log) const {
  const pid_t process = ::fork();
  if (process != 0) return process;
  std::vector<char*> argv = {const_cast<char*>(program.c_str())};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  ::setenv("DISPLAY", display_.c_str(), 1);
  if (!std::freopen(log.c_str(), "wb", stdout) || ::dup2(1, 2) != 2) ::_exit(126);
  ::execv(program.c_str(), argv.data());
  ::_exit(127);
}

bool VirtualScreen::isRunning(pid_t process) const {
  siginfo_t ended{};
  return ::waitid(P_PID, static_cast<id_t>(process), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 && ended.si_pid == 0;
}

void VirtualScreen::end(pid_t process) const {
  ::kill(process, SIGTERM);
  ::waitpid(process, nullptr, 0);
}

ScreenPicture VirtualScreen::picture() const {
  const std::string file = readAll(folder_ / "Xvfb_screen0");
  ScreenPicture picture;
  if (file.size() < 100) return picture;
  // XWD: header's bytes, ..., width (4), height (5), ..., bytes a row (12), ..., colours of 12 bytes (19).
  const std::size_t header = wordOf(file, 0), row = wordOf(file, 12), colors = wordOf(file, 19);
  const std::uint32_t width = wordOf(file, 4), height = wordOf(file, 5);
  const std::size_t first = header + 12 * colors;
  if (file.size() < first + row * height || row < std::size_t{4} * width) return picture;
  picture.width = width;
  picture.height = height;
  picture.pixel.reserve(std::size_t{width} * height);
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      // Blue, green, red and nothing.
      const auto* at = reinterpret_cast<const unsigned char*>(file.data()) + first + row * y + 4 * x;
      picture.pixel.push_back({at[2], at[1], at[0]});
    }
  }
  return picture;
}

bool VirtualScreen::waitFor(const Condition& is, const std::function<bool()>& goesOn) const {
  return waitUntil([&] { return is(picture()); }, goesOn);
}

bool VirtualScreen::waitUntil(const std::function<bool()>& is, const std::function<bool()>& goesOn) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(10);
  do {
    if (is()) return true;
    pause(0.02);
  } while (goesOn() && std::chrono::steady_clock::now() < end);
  return false;
}

ScreenPicture VirtualScreen::settled() const {
  constexpr int kStill = 15;
  int still = 0;
  ScreenPicture last = picture();
  for (int i = 0; i < 300 && still < kStill; ++i) {
    pause(0.2);
    ScreenPicture now = picture();
    still = differenceOf(last, now, 6).width() == 0 ? still + 1 : 0;
    last = std::move(now);
  }
  return last;
}

bool VirtualScreen::succeeds(const std::string& arguments) const {
  return std::system(("DISPLAY=" + display_ + " xdotool " + arguments + " >/dev/null 2>&1").c_str()) == 0;
}

void VirtualScreen::xdotool(const std::string& arguments) const {
  if (!succeeds(arguments)) std::fprintf(stderr, "failed: xdotool %s\n", arguments.c_str());
}

bool VirtualScreen::hasWindow(const std::string& title) const { return succeeds("search --name '" + title + "'"); }

void VirtualScreen::moveTo(const glm::ivec2& at) const {
  xdotool("mousemove " + std::to_string(at.x) + " " + std::to_string(at.y));
}

void VirtualScreen::click(int button, const glm::ivec2& at) const {
  xdotool("mousemove " + std::to_string(at.x) + " " + std::to_string(at.y) + " click " + std::to_string(button));
}

void VirtualScreen::scroll(int notches, const glm::ivec2& at) const {
  moveTo(at);
  xdotool("click --delay 5 --repeat " + std::to_string(std::abs(notches)) + (notches > 0 ? " 4" : " 5"));
}

void VirtualScreen::holdKey(const std::string& name, double seconds) const {
  xdotool("keydown " + name + " sleep " + std::to_string(seconds) + " keyup " + name);
}

void VirtualScreen::dragOnce(int button, const glm::ivec2& from, const glm::ivec2& to) const {
  std::string words =
      "mousemove " + std::to_string(from.x) + " " + std::to_string(from.y) + " mousedown " + std::to_string(button);
  for (int i = 1; i <= 8; ++i) {
    const glm::ivec2 at = from + (to - from) * i / 8;
    words += " mousemove " + std::to_string(at.x) + " " + std::to_string(at.y) + " sleep 0.02";
  }
  xdotool(words + " mouseup " + std::to_string(button));
}

void VirtualScreen::press(const std::string& keys) const { xdotool("key " + keys); }

bool VirtualScreen::holdKey(const std::string& name, const Condition& is) const {
  xdotool("keydown " + name);
  const bool seen = waitFor(is);
  xdotool("keyup " + name);
  return seen;
}

bool VirtualScreen::drag(int button, const glm::ivec2& from, const glm::ivec2& to, const Condition& is) const {
  moveTo(from);
  xdotool("mousedown " + std::to_string(button));
  bool seen = false;
  // There and back again, for windows that saw neither the button nor the way.
  for (int i = 0; i < 600 && !seen; ++i) {
    moveTo(from + (to - from) * (i % 20) / 19);
    pause(0.1);
    seen = is(picture());
  }
  xdotool("mouseup " + std::to_string(button));
  return seen;
}

}  // namespace relume
