#include "apps/base/folder_lock.hpp"

#include "fem/base/check.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>
#include <system_error>

namespace flexboom {

namespace {

/// Is the open file still the one of that name? The process before may have removed it meanwhile.
bool is_named(int file, const std::filesystem::path& path) {
  struct stat open = {}, named = {};
  return fstat(file, &open) == 0 && stat(path.c_str(), &named) == 0 && open.st_dev == named.st_dev &&
         open.st_ino == named.st_ino;
}

/// What the owner wrote into its lock.
std::string owner_of(int file) {
  std::array<char, 32> text = {};
  const ssize_t size = pread(file, text.data(), text.size() - 1, 0);
  const std::string pid(text.data(), static_cast<size_t>(size > 0 ? size : 0));
  return pid.substr(0, pid.find('\n'));
}

}  // namespace

FolderLock::FolderLock(const std::filesystem::path& folder) : path_(folder / ".flexboom-lock") {
  const auto fail = [&](const std::string& why) {
    if (file_ >= 0) close(file_);
    throw InputError(fmt::format("cannot write into the output folder {}: {}", folder.string(), why));
  };
  const auto reason = [] { return std::generic_category().message(errno); };
  for (;;) {
    file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (file_ < 0) fail(reason());
    if (flock(file_, LOCK_EX | LOCK_NB) != 0)
      fail(errno == EWOULDBLOCK
               ? fmt::format("process {} is writing there; wait for it, or give another folder by --out",
                             owner_of(file_))
               : reason());
    if (is_named(file_, path_)) break;
    close(file_);
  }
  const std::string pid = std::to_string(getpid()) + "\n";
  if (ftruncate(file_, 0) != 0 || pwrite(file_, pid.data(), pid.size(), 0) != static_cast<ssize_t>(pid.size()))
    fail(reason());
}

FolderLock::~FolderLock() {
  unlink(path_.c_str());  // still locked: nobody else has taken it
  close(file_);
}

}  // namespace flexboom
