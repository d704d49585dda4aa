#include "apps/commands/terminal_line.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <stop_token>
#include <utility>

namespace flexboom {

TerminalLine::TerminalLine(bool wanted) : wanted_(wanted && isatty(STDERR_FILENO) == 1) {}

TerminalLine::~TerminalLine() {
  if (shown_) std::fputs(fmt::format("\r{:79}\r", "").c_str(), stderr);
}

bool TerminalLine::is_due() {
  if (!wanted_ || seconds() < 1 || seconds() - last_ < 0.2) return false;
  last_ = seconds();
  return true;
}

void TerminalLine::show(const std::string& text) {
  shown_ = true;
  std::fputs(fmt::format("\r{:79.79}", text).c_str(), stderr);
  std::fflush(stderr);
}

WorkLine::WorkLine(bool wanted, std::string what) {
  if (!wanted || isatty(STDERR_FILENO) != 1) return;
  clock_ = std::jthread([what = std::move(what)](const std::stop_token& stop) {
    TerminalLine line(true);
    while (!stop.stop_requested()) {
      if (line.is_due()) line.show(fmt::format("{}: {:.0f} s", what, line.seconds()));
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
}

}  // namespace flexboom
