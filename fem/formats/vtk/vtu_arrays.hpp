#pragma once

#include "fem/base/text_reader.hpp"

#include <pugixml.hpp>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexboom {

class ByteStream;

/// The data arrays of a .vtu file: ASCII, base64 or appended, with or without zlib, of either byte order.
class VtuArrays {
 public:
  /// Parses the XML of a file, appended data apart. @throws InputError unless it is an unstructured grid in one piece.
  VtuArrays(std::string_view text, const std::string& file);

  pugi::xml_node piece() const { return piece_; }

  /// A count of points or cells from an attribute of the piece.
  long count(const char* attribute) const;

  /// Whether Lagrange hexahedra are numbered as before VTK 9.
  bool before_2_1() const { return before_2_1_; }

  /// Array of a name under a node, empty node if there is none.
  static pugi::xml_node find(pugi::xml_node parent, std::string_view name);

  /// Components of an array, 1 if it does not say.
  long components(pugi::xml_node array) const;

  static bool has_integers(pugi::xml_node array);

  /// All `count` values of an array. @throws InputError when there are more or less or one is not finite or not whole.
  std::vector<double> reals(pugi::xml_node array, long count) const;
  std::vector<long> integers(pugi::xml_node array, long count) const;

  /// @throws InputError "file:line:column: message" at a node.
  [[noreturn]] void fail(pugi::xml_node node, const std::string& message) const;

 private:
  void parse();
  void check_root(pugi::xml_node root);
  template <class Number>
  std::vector<Number> values(pugi::xml_node array, long count) const;
  template <class Number>
  std::vector<Number> text_values(pugi::xml_node array, long count) const;
  template <class Number>
  std::vector<Number> binary_values(pugi::xml_node array, std::string_view bytes) const;
  std::string bytes_of(pugi::xml_node array, size_t expected) const;
  std::string compressed_bytes(pugi::xml_node array, ByteStream& stream, size_t expected) const;
  size_t header_number(pugi::xml_node array, ByteStream& stream) const;
  ByteStream stream_of(pugi::xml_node array) const;
  std::string_view content_of(pugi::xml_node array) const;
  std::string_view view_of(pugi::xml_node node) const;

  std::string_view text_;
  TextReader reader_;
  pugi::xml_document document_;
  pugi::xml_node piece_;
  std::optional<std::string_view> appended_;  // after the underscore
  bool appended_base64_ = false;
  bool swapped_ = false;
  bool wide_header_ = false;
  bool compressed_ = false;
  mutable size_t unpacked_ = 0;  // bytes of all compressed arrays that were read
  bool before_2_1_ = true;
};

}  // namespace flexboom
