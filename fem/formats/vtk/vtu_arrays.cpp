#include "fem/formats/vtk/vtu_arrays.hpp"

#include "fem/base/base64.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

namespace flexboom {
namespace {

// zlib cannot make more of a byte (its technical details: 1032 to 1).
constexpr size_t highest_expansion = 1032;
// What all arrays may become for each byte of the file, and of any file. Meshes are packed to a tenth, a constant array
// to a thousandth.
constexpr size_t most_expansion = 64;
constexpr size_t always_expanded = size_t{64} << 20;
constexpr double largest_whole = 9007199254740992;  // 2^53

struct NumberType {
  std::string_view name;
  size_t size;
  bool integer;
  double (*real)(const char*);
  std::optional<long> (*whole)(const char*);
};

template <class Number>
Number number_at(const char* bytes) {
  Number value;
  std::memcpy(&value, bytes, sizeof(Number));
  return value;
}

template <class Number>
double real_at(const char* bytes) {
  return static_cast<double>(number_at<Number>(bytes));
}

template <class Number>
std::optional<long> whole_at(const char* bytes) {
  const auto value = number_at<Number>(bytes);
  if constexpr (std::is_floating_point_v<Number>) {
    if (!(std::abs(value) <= largest_whole) || std::trunc(value) != value) return {};
  } else if constexpr (std::is_same_v<Number, std::uint64_t>) {
    if (value > static_cast<std::uint64_t>(std::numeric_limits<long>::max())) return {};
  }
  return static_cast<long>(value);
}

template <class Number>
constexpr NumberType number_type(std::string_view name) {
  return {name, sizeof(Number), std::is_integral_v<Number>, real_at<Number>, whole_at<Number>};
}

constexpr std::array<NumberType, 10> number_types = {{
    number_type<std::int8_t>("Int8"),
    number_type<std::uint8_t>("UInt8"),
    number_type<std::int16_t>("Int16"),
    number_type<std::uint16_t>("UInt16"),
    number_type<std::int32_t>("Int32"),
    number_type<std::uint32_t>("UInt32"),
    number_type<std::int64_t>("Int64"),
    number_type<std::uint64_t>("UInt64"),
    number_type<float>("Float32"),
    number_type<double>("Float64"),
}};

const NumberType* type_of_array(pugi::xml_node array) {
  const auto* const found =
      std::ranges::find(number_types, std::string_view(array.attribute("type").value()), &NumberType::name);
  return found == number_types.end() ? nullptr : &*found;
}

void swap_bytes(std::string& bytes, size_t size) {
  for (size_t i = 0; i + size <= bytes.size(); i += size) std::reverse(bytes.data() + i, bytes.data() + i + size);
}

// Of zlib, at most `room` bytes; nothing if it is damaged.
std::optional<std::string> inflated(std::string_view packed, size_t room) {
  std::string bytes(room, '\0');
  auto size = static_cast<uLongf>(room);
  const int code = uncompress(reinterpret_cast<Bytef*>(bytes.data()), &size,
                              reinterpret_cast<const Bytef*>(packed.data()), static_cast<uLong>(packed.size()));
  if (code != Z_OK) return {};
  bytes.resize(size);
  return bytes;
}

}  // namespace

VtuArrays::VtuArrays(std::string_view text, const std::string& file)
    : text_(without_byte_order_mark(text)), reader_(text, file) {
  parse();
  const pugi::xml_node root = document_.child("VTKFile");
  if (!root) reader_.fail(text_, "a .vtu file has the root element VTKFile, this one not");
  check_root(root);
  const pugi::xml_node grid = root.child("UnstructuredGrid");
  piece_ = grid.child("Piece");
  if (!piece_) fail(grid ? grid : root, "there is no UnstructuredGrid with a Piece");
  if (const pugi::xml_node second = piece_.next_sibling("Piece"))
    fail(second, "a second Piece; save the grid in one piece");
}

// Appended raw data are no XML: what comes before them is closed and parsed.
void VtuArrays::parse() {
  const size_t mark = text_.find("<AppendedData");
  const size_t mark_end = mark == std::string_view::npos ? mark : text_.find('>', mark);
  std::string whole(text_.substr(0, mark_end == std::string_view::npos ? mark_end : mark_end + 1));
  if (mark_end != std::string_view::npos) {
    const size_t underscore = text_.find('_', mark_end);
    if (underscore == std::string_view::npos)
      reader_.fail(text_.substr(mark), "the data of AppendedData must begin with an underscore");
    appended_ = text_.substr(underscore + 1);
    whole += "</AppendedData></VTKFile>";
  }
  const pugi::xml_parse_result result = document_.load_buffer(whole.data(), whole.size());
  if (!result) {
    const auto offset = std::min(static_cast<size_t>(std::max<ptrdiff_t>(result.offset, 0)), text_.size());
    reader_.fail(text_.substr(offset), fmt::format("is not well-formed XML: {}", result.description()));
  }
}

void VtuArrays::check_root(pugi::xml_node root) {
  const auto is = [root](const char* attribute, std::string_view value) {
    return root.attribute(attribute).value() == value;
  };
  const auto refuse = [&](const char* attribute, const char* right) {
    fail(root, fmt::format("{} is {}; it must be {}", attribute, quoted(root.attribute(attribute).value()), right));
  };
  if (!is("type", "UnstructuredGrid")) refuse("type", "\"UnstructuredGrid\" (of ParaView: save as .vtu)");
  const bool big = is("byte_order", "BigEndian");
  if (!big && !is("byte_order", "LittleEndian") && !is("byte_order", ""))
    refuse("byte_order", R"("LittleEndian" or "BigEndian")");
  swapped_ = big != (std::endian::native == std::endian::big);
  wide_header_ = is("header_type", "UInt64");
  if (!wide_header_ && !is("header_type", "UInt32") && !is("header_type", ""))
    refuse("header_type", R"("UInt32" or "UInt64")");
  compressed_ = is("compressor", "vtkZLibDataCompressor");
  if (!compressed_ && !is("compressor", "")) refuse("compressor", "\"vtkZLibDataCompressor\", or there must be none");
  if (const pugi::xml_node data = root.child("AppendedData"))
    appended_base64_ = std::string_view(data.attribute("encoding").value()) == "base64";
  const double version = to_real(root.attribute("version").value()).value_or(0.1);
  before_2_1_ = version < 2.1;
}

long VtuArrays::count(const char* attribute) const {
  const char* value = piece_.attribute(attribute).value();
  const std::optional<long> number = to_integer(trimmed(value));
  // Every point and cell takes at least a bit of a compressed file.
  const auto most = static_cast<long>(std::min<size_t>(text_.size(), 1UL << 40) * highest_expansion);
  if (!number || *number < 0) fail(piece_, fmt::format("{} is {}; it must be a count", attribute, quoted(value)));
  if (*number > most || *number > std::numeric_limits<int>::max() / 3)
    fail(piece_, fmt::format("{} is {}; the file cannot hold so many", attribute, *number));
  return *number;
}

pugi::xml_node VtuArrays::find(pugi::xml_node parent, std::string_view name) {
  return parent.find_child([name](pugi::xml_node child) {
    return std::string_view(child.name()) == "DataArray" && child.attribute("Name").value() == name;
  });
}

long VtuArrays::components(pugi::xml_node array) const {
  const std::string_view value = array.attribute("NumberOfComponents").value();
  const std::optional<long> number = value.empty() ? 1 : to_integer(value);
  if (number && *number > 0 && *number <= 1000) return *number;
  fail(array, fmt::format("NumberOfComponents is {}; it must be a count", quoted(value)));
}

bool VtuArrays::has_integers(pugi::xml_node array) {
  const NumberType* type = type_of_array(array);
  return type != nullptr && type->integer;
}

std::vector<double> VtuArrays::reals(pugi::xml_node array, long count) const { return values<double>(array, count); }

std::vector<long> VtuArrays::integers(pugi::xml_node array, long count) const { return values<long>(array, count); }

template <class Number>
std::vector<Number> VtuArrays::values(pugi::xml_node array, long count) const {
  const NumberType* type = type_of_array(array);
  if (type == nullptr)
    fail(array, fmt::format("type {} of a DataArray is not known", quoted(array.attribute("type").value())));
  const std::string_view format = array.attribute("format").value();
  if (format == "ascii") return text_values<Number>(array, count);
  if (format != "binary" && format != "appended")
    fail(array, fmt::format(R"(format {} is not "ascii", "binary" or "appended")", quoted(format)));
  const size_t expected = static_cast<size_t>(count) * type->size;
  std::string bytes = bytes_of(array, expected);
  if (bytes.size() != expected)
    fail(array, fmt::format("the array has {} bytes; {} {} take {}", bytes.size(), count, type->name, expected));
  if (swapped_) swap_bytes(bytes, type->size);
  return binary_values<Number>(array, bytes);
}

template <class Number>
std::vector<Number> VtuArrays::text_values(pugi::xml_node array, long count) const {
  const std::string_view content = content_of(array);
  if (static_cast<size_t>(count) > (content.size() + 1) / 2)
    fail(array, fmt::format("the array should have {} values; its text is too short for that", count));
  std::string_view name = array.attribute("Name").value();
  if (name.empty()) name = "a value";
  TextReader reader(text_.substr(0, static_cast<size_t>(content.data() - text_.data()) + content.size()),
                    reader_.file());
  reader.seek(static_cast<size_t>(content.data() - text_.data()));
  std::vector<Number> result(static_cast<size_t>(count));
  for (Number& value : result) {
    if constexpr (std::is_same_v<Number, double>)
      value = reader.real(name);
    else
      value = reader.integer(name);
  }
  if (const std::string_view more = reader.next_token(); !more.empty())
    reader.fail(more, fmt::format("there are more than {} values", count));
  return result;
}

template <class Number>
std::vector<Number> VtuArrays::binary_values(pugi::xml_node array, std::string_view bytes) const {
  const NumberType& type = *type_of_array(array);
  const size_t count = bytes.size() / type.size;
  std::vector<Number> result(count);
  for (size_t i = 0; i < count; ++i) {
    const char* at = bytes.data() + i * type.size;
    if constexpr (std::is_same_v<Number, double>) {
      result[i] = type.real(at);
      if (!std::isfinite(result[i])) fail(array, fmt::format("value {} is not finite", i));
    } else {
      const std::optional<long> value = type.whole(at);
      if (!value) fail(array, fmt::format("value {} is not a whole number", i));
      result[i] = *value;
    }
  }
  return result;
}

// The bytes of an array, of which there should be `expected`.
std::string VtuArrays::bytes_of(pugi::xml_node array, size_t expected) const {
  ByteStream stream = stream_of(array);
  if (compressed_) return compressed_bytes(array, stream, expected);
  const size_t size = header_number(array, stream);
  std::optional<std::string> bytes = stream.take(size);
  if (!bytes) fail(array, fmt::format("the array announces {} bytes and ends before, or is no base64", size));
  return std::move(*bytes);
}

// Number of blocks, size of a block, size of the last one if it is shorter, compressed sizes, blocks.
std::string VtuArrays::compressed_bytes(pugi::xml_node array, ByteStream& stream, size_t expected) const {
  const size_t blocks = header_number(array, stream);
  const size_t block_size = blocks > 0 ? header_number(array, stream) : 0;
  const size_t last_size = blocks > 0 ? header_number(array, stream) : 0;
  if (blocks > expected || last_size > block_size)
    fail(array, fmt::format("{} blocks of {} bytes cannot make the {} bytes expected", blocks, block_size, expected));
  unpacked_ += expected;
  if (unpacked_ > always_expanded + most_expansion * text_.size())
    fail(array, fmt::format("the arrays up to here unpack to {} bytes, more than {} times the file", unpacked_,
                            most_expansion));
  std::vector<size_t> sizes;
  for (size_t i = 0; i < blocks; ++i) sizes.push_back(header_number(array, stream));
  std::string bytes;
  for (size_t i = 0; i < blocks; ++i) {
    const std::optional<std::string> packed = stream.take(sizes[i]);
    if (!packed) fail(array, fmt::format("the array ends in block {} of {}", i + 1, blocks));
    const size_t size = i + 1 == blocks && last_size > 0 ? last_size : block_size;
    const bool possible = size <= (packed->size() + 1) * highest_expansion && bytes.size() + size <= expected;
    const std::optional<std::string> block = possible ? inflated(*packed, size) : std::nullopt;
    if (!block) fail(array, fmt::format("block {} of {} is damaged (zlib)", i + 1, blocks));
    bytes += *block;
  }
  return bytes;
}

size_t VtuArrays::header_number(pugi::xml_node array, ByteStream& stream) const {
  std::optional<std::string> bytes = stream.take(wide_header_ ? 8 : 4);
  if (!bytes) fail(array, "the array ends before its header, or is no base64");
  if (swapped_) std::ranges::reverse(*bytes);
  return wide_header_ ? number_at<std::uint64_t>(bytes->data()) : number_at<std::uint32_t>(bytes->data());
}

ByteStream VtuArrays::stream_of(pugi::xml_node array) const {
  if (std::string_view(array.attribute("format").value()) == "binary") return {content_of(array), true};
  const std::optional<long> offset = to_integer(trimmed(array.attribute("offset").value()));
  if (!appended_) fail(array, "the array is appended, and there is no AppendedData");
  if (!offset || *offset < 0 || static_cast<size_t>(*offset) > appended_->size())
    fail(array, fmt::format("offset {} is not inside AppendedData", quoted(array.attribute("offset").value())));
  return {appended_->substr(static_cast<size_t>(*offset)), appended_base64_};
}

// What stands between the tags of an array, in the text of the file.
std::string_view VtuArrays::content_of(pugi::xml_node array) const {
  const std::string_view from = view_of(array);
  const size_t begin = from.find('>');
  if (begin == std::string_view::npos || (begin > 0 && from[begin - 1] == '/')) return from.substr(0, 0);
  return from.substr(begin + 1, from.find('<', begin) - begin - 1);
}

// The text from a node on.
std::string_view VtuArrays::view_of(pugi::xml_node node) const {
  const auto offset = static_cast<size_t>(std::max<ptrdiff_t>(node.offset_debug(), 0));
  return text_.substr(std::min(offset, text_.size()));
}

void VtuArrays::fail(pugi::xml_node node, const std::string& message) const {
  const char* name = node.attribute("Name").value();
  reader_.fail(view_of(node), *name == '\0' ? message : fmt::format("{}: {}", quoted(name), message));
}

}  // namespace flexboom
