#include "fem/files.hpp"

#include "fem/check.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <fstream>
#include <system_error>

namespace flexboom {

namespace fs = std::filesystem;

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
