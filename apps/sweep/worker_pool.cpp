#include "apps/sweep/worker_pool.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <deque>
#include <memory>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>

namespace flexboom {

namespace {

[[noreturn]] void throw_errno(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

/// An open file of the system.
class OpenFile {
 public:
  OpenFile() = default;
  explicit OpenFile(int number) : number_(number) {}
  OpenFile(OpenFile&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  OpenFile& operator=(OpenFile&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() { shut(); }
  int number() const { return number_; }
  void shut() {
    if (number_ >= 0) ::close(std::exchange(number_, -1));
  }

 private:
  int number_ = -1;
};

struct PipeEnds {
  OpenFile read, write;
};

PipeEnds new_pipe() {
  std::array<int, 2> ends = {};
  if (pipe(ends.data()) != 0) throw_errno("a pipe to a worker");
  return {OpenFile(ends[0]), OpenFile(ends[1])};
}

bool write_all(int file, const char* bytes, size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(file, bytes, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes += written, size -= static_cast<size_t>(written);
  }
  return true;
}

bool read_all(int file, char* bytes, size_t size) {
  while (size > 0) {
    const ssize_t got = ::read(file, bytes, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    bytes += got, size -= static_cast<size_t>(got);
  }
  return true;
}

// An outcome as bytes. Both sides are the same program.

template <class T>
void put(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void put_text(std::string& bytes, const std::string& text) { put(bytes, text.size()), bytes += text; }

template <class T>
T taken(const char*& from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  from += sizeof value;
  return value;
}

std::string taken_text(const char*& from) {
  const auto size = taken<size_t>(from);
  std::string text(from, size);
  from += size;
  return text;
}

std::string packed(const RunOutcome& outcome) {
  std::string bytes;
  put(bytes, outcome.run), put(bytes, outcome.status), put(bytes, outcome.seconds);
  put_text(bytes, outcome.message);
  put(bytes, outcome.quantities.size());
  for (const double value : outcome.quantities) put(bytes, value);
  put(bytes, outcome.trajectory.has_value());
  if (!outcome.trajectory) return bytes;
  const OutputTable& table = *outcome.trajectory;
  put(bytes, table.values.rows()), put(bytes, table.values.cols());
  for (const std::string& name : table.names) put_text(bytes, name);
  bytes.append(reinterpret_cast<const char*>(table.values.data()),
               static_cast<size_t>(table.values.size()) * sizeof(double));
  return bytes;
}

RunOutcome unpacked(const char* from) {
  RunOutcome outcome;
  outcome.run = taken<size_t>(from), outcome.status = taken<RunStatus>(from), outcome.seconds = taken<double>(from);
  outcome.message = taken_text(from);
  outcome.quantities.resize(taken<size_t>(from));
  for (double& value : outcome.quantities) value = taken<double>(from);
  if (!taken<bool>(from)) return outcome;
  OutputTable& table = outcome.trajectory.emplace();
  const auto rows = taken<Eigen::Index>(from), columns = taken<Eigen::Index>(from);
  for (Eigen::Index c = 0; c < columns; ++c) table.names.push_back(taken_text(from));
  table.values.resize(rows, columns);
  std::memcpy(table.values.data(), from, static_cast<size_t>(table.values.size()) * sizeof(double));
  return outcome;
}

/// While one lives, signals that ask to end wait in a file. Under nohup SIGHUP is no such signal.
class EndSignals {
 public:
  EndSignals() {
    sigemptyset(&signals_);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
      struct sigaction action = {};
      sigaction(signal, nullptr, &action);
      if (action.sa_handler != SIG_IGN) sigaddset(&signals_, signal);
    }
    sigprocmask(SIG_BLOCK, &signals_, &before_);
    file_ = OpenFile(signalfd(-1, &signals_, 0));
    if (file_.number() < 0) throw_errno("signals as a file");
  }
  ~EndSignals() { sigprocmask(SIG_SETMASK, &before_, nullptr); }
  EndSignals(const EndSignals&) = delete;
  EndSignals& operator=(const EndSignals&) = delete;
  int file() const { return file_.number(); }

  /// One that came does no more once it is read.
  void take() const {
    signalfd_siginfo info = {};
    read_all(file_.number(), reinterpret_cast<char*>(&info), sizeof info);
  }

 private:
  sigset_t signals_ = {}, before_ = {};
  OpenFile file_;
};

using Work = std::function<RunOutcome(size_t)>;

/// The life of a worker: reads numbers of runs until there are no more. Nothing may unwind into what is the parent's.
[[noreturn]] void serve(int tasks, int results, pid_t parent, const Work& work) noexcept {
  // A signal to the whole group is the parent's business: it ends its workers itself.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_IGN);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(0);  // it died before that took effect
  // Files of the parent (its lock, its journal) must not stay open for longer than it lives.
  const auto low = static_cast<unsigned>(std::min(tasks, results)),
             high = static_cast<unsigned>(std::max(tasks, results));
  if (low > 3) close_range(3, low - 1, 0);
  if (high > low + 1) close_range(low + 1, high - 1, 0);
  close_range(high + 1, ~0U, 0);
  size_t run = 0;
  while (read_all(tasks, reinterpret_cast<char*>(&run), sizeof run)) {
    const std::string bytes = packed(work(run));
    const size_t size = bytes.size();
    if (!write_all(results, reinterpret_cast<const char*>(&size), sizeof size) ||
        !write_all(results, bytes.data(), size))
      break;
  }
  _exit(0);
}

class WorkerProcess {
 public:
  explicit WorkerProcess(const Work& work) {
    PipeEnds tasks = new_pipe(), results = new_pipe();
    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ < 0) throw_errno("a worker");
    if (pid_ == 0) serve(tasks.read.number(), results.write.number(), parent, work);
    tasks_ = std::move(tasks.write), results_ = std::move(results.read);
  }
  ~WorkerProcess() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    end();
  }
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  /// A worker that has died shows when its results are read.
  void give(size_t run) {
    given_.push_back(run);
    write_all(tasks_.number(), reinterpret_cast<const char*>(&run), sizeof run);
  }
  void give_no_more() { tasks_.shut(); }
  const std::deque<size_t>& given() const { return given_; }
  int results() const { return results_.number(); }

  /// Tells of the outcomes that have come; false: there will be no more.
  bool receive(const std::function<void(const RunOutcome&)>& done) {
    constexpr size_t piece = 1 << 16;
    const size_t before = buffer_.size();
    buffer_.resize(before + piece);
    const ssize_t got = ::read(results_.number(), buffer_.data() + before, piece);
    buffer_.resize(before + static_cast<size_t>(std::max<ssize_t>(got, 0)));
    if (got < 0 && errno == EINTR) return true;
    size_t begin = 0, size = 0;
    while (buffer_.size() - begin >= sizeof size) {
      std::memcpy(&size, buffer_.data() + begin, sizeof size);
      if (buffer_.size() - begin - sizeof size < size) break;
      const RunOutcome outcome = unpacked(buffer_.data() + begin + sizeof size);
      begin += sizeof size + size;
      given_.pop_front();
      done(outcome);
    }
    buffer_.erase(0, begin);
    return got > 0;
  }

  /// Waits for it; says how it ended.
  std::string end() {
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    if (WIFSIGNALED(status))
      return fmt::format("the process of this run was killed by signal {} ({})", WTERMSIG(status),
                         strsignal(WTERMSIG(status)));
    return fmt::format("the process of this run ended with {}", WEXITSTATUS(status));
  }

 private:
  pid_t pid_ = -1;
  OpenFile tasks_, results_;
  std::deque<size_t> given_;  // not yet answered
  std::string buffer_;
};

/// The processes and the runs that wait for them.
class WorkerPool {
 public:
  WorkerPool(const std::vector<size_t>& runs, size_t jobs, const Work& work,
             const std::function<void(const RunOutcome&)>& done)
      : waiting_(runs.begin(), runs.end()), work_(work), done_(done) {
    for (size_t i = 0; i < std::min(jobs, runs.size()); ++i) start();
  }

  bool run() {
    while (!workers_.empty()) {
      std::vector<pollfd> files = {{signals_.file(), POLLIN, 0}};
      for (const auto& worker : workers_) files.push_back({worker->results(), POLLIN, 0});
      if (poll(files.data(), files.size(), -1) < 0 && errno != EINTR) throw_errno("waiting for workers");
      if (files[0].revents != 0) return signals_.take(), false;
      std::vector<WorkerProcess*> ready;
      for (size_t i = 1; i < files.size(); ++i)
        if (files[i].revents != 0) ready.push_back(workers_[i - 1].get());
      for (WorkerProcess* worker : ready) attend(*worker);
    }
    return true;
  }

 private:
  void start() {
    workers_.push_back(std::make_unique<WorkerProcess>(work_));
    feed(*workers_.back());
  }

  /// One run is done while the next one waits in the pipe.
  void feed(WorkerProcess& worker) {
    for (; worker.given().size() < 2 && !waiting_.empty(); waiting_.pop_front()) worker.give(waiting_.front());
    if (worker.given().empty()) worker.give_no_more();
  }

  void attend(WorkerProcess& worker) {
    if (worker.receive(done_)) return feed(worker);
    std::deque<size_t> left = worker.given();
    const std::string how = worker.end();
    std::erase_if(workers_, [&](const auto& other) { return other.get() == &worker; });
    if (left.empty()) return;
    RunOutcome crashed;
    crashed.run = left.front(), crashed.status = RunStatus::crashed, crashed.message = how;
    done_(crashed);
    waiting_.insert(waiting_.begin(), left.begin() + 1, left.end());
    if (!waiting_.empty()) start();
  }

  EndSignals signals_;
  std::deque<size_t> waiting_;
  const Work& work_;
  const std::function<void(const RunOutcome&)>& done_;
  std::vector<std::unique_ptr<WorkerProcess>> workers_;
};

}  // namespace

bool run_in_processes(const std::vector<size_t>& runs, size_t jobs, const Work& work,
                      const std::function<void(const RunOutcome&)>& done) {
  return WorkerPool(runs, jobs, work, done).run();
}

}  // namespace flexboom
