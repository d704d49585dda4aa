#include "reduction/body_file/seal.hpp"

#include "fem/base/check.hpp"
#include "fem/base/text_reader.hpp"
#include "reduction/body_file/sha256.hpp"

#include <fmt/format.h>

namespace flexboom {
namespace {

constexpr std::string_view format_word = "flexboom-body ";
constexpr std::string_view hdf5_signature = "\x89HDF\r\n\x1a\n";

std::string seal_of(std::string_view bytes, long version) {
  std::string head = fmt::format("{}{} sha256 {}\n", format_word, version, sha256(bytes.substr(seal_size)));
  head.resize(seal_size, '\0');
  return head;
}

}  // namespace

void seal(std::string& bytes, int version) { bytes.replace(0, seal_size, seal_of(bytes, version)); }

int check_seal(std::string_view bytes) {
  require(!bytes.empty(), "the file is empty");
  require(!bytes.starts_with(hdf5_signature),
          "an HDF5 file, but not a reduced body of flexboom, which begins with a line \"flexboom-body VERSION sha256 "
          "...\"");
  require(bytes.starts_with(format_word), "not a reduced body of flexboom (an HDF5 file of `flexboom reduce`)");
  const std::string_view text = bytes.substr(format_word.size(), seal_size);
  const std::string_view number = text.substr(0, text.find(' '));
  const std::optional<long> version = to_integer(number);
  require(!version || *version <= body_file_version,
          fmt::format("version {} of the format, this program reads version {}: a newer flexboom wrote it", number,
                      body_file_version));
  require(bytes.size() > seal_size, "the file was cut off");
  require(version && bytes.starts_with(seal_of(bytes, *version)),
          "checksum does not match: the file was changed after it was written");
  return static_cast<int>(*version);
}

}  // namespace flexboom
