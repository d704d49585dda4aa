#include "fem/base/files.hpp"

#include "fem/base/check.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <system_error>

namespace flexboom {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void cannot_read(const fs::path& path, const std::string& reason) {
  throw InputError(fmt::format("cannot read {}: {}", path.string(), reason));
}

std::string reason_of(int code) { return std::generic_category().message(code); }

/// A regular file, open for reading. Nothing of a device is read, and a pipe without a writer is not waited for.
class OpenFile {
 public:
  OpenFile(const fs::path& path, size_t most) : path_(path), most_(most) {
    file_ = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (file_ < 0) cannot_read(path, reason_of(errno));
    struct stat status {};
    const bool known = ::fstat(file_, &status) == 0;
    const int code = errno;
    const bool is_folder = known && S_ISDIR(status.st_mode), is_file = known && S_ISREG(status.st_mode);
    size_ = is_file ? static_cast<size_t>(status.st_size) : 0;
    if (is_file && size_ <= most_) return;
    ::close(file_);
    if (!known) cannot_read(path, reason_of(code));
    if (is_folder) cannot_read(path, reason_of(EISDIR));
    if (!is_file) cannot_read(path, "it is a device, pipe or socket, not a file");
    too_large();
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() { ::close(file_); }

  std::string bytes() const {
    std::string bytes(size_ + 1, '\0');  // one more: a file of the kernel has no size, another one may grow
    for (size_t read = 0;;) {
      const ssize_t count = ::read(file_, bytes.data() + read, bytes.size() - read);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) cannot_read(path_, reason_of(errno));
      read += static_cast<size_t>(count);
      if (read > most_) too_large();
      if (count == 0) {
        bytes.resize(read);
        return bytes;
      }
      if (read == bytes.size()) bytes.resize(2 * read);
    }
  }

 private:
  [[noreturn]] void too_large() const {
    constexpr double mega = 1 << 20;
    cannot_read(path_, fmt::format("it is larger than {:g} MB", static_cast<double>(most_) / mega));
  }

  fs::path path_;
  size_t most_;
  size_t size_ = 0;
  int file_ = -1;
};

}  // namespace

std::string file_bytes(const fs::path& path, size_t most) { return OpenFile(path, most).bytes(); }

void require_regular_file(const fs::path& path, size_t most) { const OpenFile file(path, most); }

void write_file(const fs::path& path, std::string_view text) {
  write_file(path, [&text](std::ostream& out) { out.write(text.data(), static_cast<std::streamsize>(text.size())); });
}

void write_file(const fs::path& path, const std::function<void(std::ostream&)>& write) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  const bool in_place = fs::exists(status) && !fs::is_regular_file(status);  // a device or pipe must not be replaced
  fs::path target = path;
  if (!in_place) target += ".part";
  errno = 0;
  std::ofstream out(target, std::ios::binary | std::ios::trunc);
  write(out);
  out.close();
  if (!out) {
    const std::string reason = errno != 0 ? std::generic_category().message(errno) : "the stream failed";
    if (!in_place) fs::remove(target, error);
    throw InputError(fmt::format("cannot write {}: {}", path.string(), reason));
  }
  if (in_place) return;
  fs::rename(target, path, error);
  if (error) throw InputError(fmt::format("cannot write {}: {}", path.string(), error.message()));
}

}  // namespace flexboom
