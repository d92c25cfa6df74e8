// SPDX-License-Identifier: MIT
// Runs the `relume` binary as a user would and keeps what it printed.
#pragma once

#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

namespace relume {

struct ProgramResult {
  int status = -1;  // exit status; 128 + signal when one killed it
  std::string out, err;
  double seconds = 0.0;
  double cpuSeconds = 0.0;    // of all its threads: unlike `seconds`, hardly more on a busy machine
  std::size_t peakBytes = 0;  // of memory that it held
};

inline std::string readAll(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// A program that runs; its output goes to files in `folder`.
class Program {
 public:
  // `inChild` runs after the fork, before the program: limits, personality.
  Program(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
          const std::function<void()>& inChild = {})
      : out_(folder / "stdout.txt"), err_(folder / "stderr.txt"), begin_(std::chrono::steady_clock::now()) {
    // What a program before it has said is not taken for its words until it has begun.
    std::error_code none;
    std::filesystem::remove(out_, none);
    std::filesystem::remove(err_, none);
    pid_ = ::fork();
    if (pid_ != 0) return;
    std::vector<char*> argv = {const_cast<char*>(RELUME_BINARY)};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    if (!std::freopen(out_.c_str(), "wb", stdout) || !std::freopen(err_.c_str(), "wb", stderr)) ::_exit(126);
    // Ignored where the tests run behind nohup or a shell's &.
    for (const int each : {SIGINT, SIGHUP, SIGTERM}) ::signal(each, SIG_DFL);
    if (inChild) inChild();
    ::execv(RELUME_BINARY, argv.data());
    ::_exit(127);
  }

  void send(int signal) const { ::kill(pid_, signal); }

  // [s] What its threads have worked so far; 0 once it has ended.
  double cpuSeconds() const {
    clockid_t clock = 0;
    timespec now{};
    if (::clock_getcpuclockid(pid_, &clock) != 0 || ::clock_gettime(clock, &now) != 0) return 0.0;
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }

  ProgramResult wait() {
    int status = 0;
    rusage usage{};
    ::wait4(pid_, &status, 0, &usage);
    ProgramResult result;
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.out = readAll(out_);
    result.err = readAll(err_);
    const auto secondsOf = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    result.cpuSeconds = secondsOf(usage.ru_utime) + secondsOf(usage.ru_stime);
    result.peakBytes = static_cast<std::size_t>(usage.ru_maxrss) * 1024;
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    return result;
  }

  // Whether the program has written `text` to stderr; gives up after ten minutes.
  bool waitForStderr(const std::string& text) const {
    for (int i = 0; i < 60000; ++i) {
      if (readAll(err_).find(text) != std::string::npos) return true;
      siginfo_t ended{};
      if (::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 || ended.si_pid != 0)
        return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  // Whether the program has taken a signal upon itself; gives up after ten minutes.
  bool waitForHandler(int signal) const {
    const std::filesystem::path status = "/proc/" + std::to_string(pid_) + "/status";
    for (int i = 0; i < 60000; ++i) {
      const std::string text = readAll(status), name = "SigCgt:";
      const std::size_t at = text.find(name);
      if (at == std::string::npos) return false;
      if (std::strtoull(text.c_str() + at + name.size(), nullptr, 16) >> (signal - 1) & 1u) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

 private:
  std::filesystem::path out_, err_;
  std::chrono::steady_clock::time_point begin_;
  pid_t pid_ = -1;
};

inline ProgramResult runProgram(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
                                const std::function<void()>& inChild = {}) {
  return Program(arguments, folder, inChild).wait();
}

}  // namespace relume
