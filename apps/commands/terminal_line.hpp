#pragma once

#include "fem/base/stopwatch.hpp"

#include <string>
#include <thread>

namespace flexboom {

/// One line on stderr that is written over and over, and is gone at the end. Silent for work under a second and where
/// stderr is no terminal.
class TerminalLine {
 public:
  explicit TerminalLine(bool wanted);
  ~TerminalLine();
  TerminalLine(const TerminalLine&) = delete;
  TerminalLine& operator=(const TerminalLine&) = delete;

  /// After the first second, five times a second.
  bool is_due();
  void show(const std::string& text);
  /// Since it was made [s].
  double seconds() const { return start_.seconds(); }

 private:
  bool wanted_, shown_ = false;
  Stopwatch start_;
  double last_ = 0;  // [s]
};

/// Says how long a work has taken of which nobody knows how long it will take.
class WorkLine {
 public:
  WorkLine(bool wanted, std::string what);

 private:
  std::jthread clock_;
};

}  // namespace flexboom
