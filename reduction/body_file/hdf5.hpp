#pragma once

#include "reduction/body_file/hdf5_image.hpp"
#include "reduction/body_file/sha256.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

// HDF5 files in memory, as far as body files need them.
namespace flexboom {

/// One dataset: its path in the file and what it says about itself.
struct Field {
  std::string name;         // "Kg/spin"
  std::string units;        // SI; "q": unit of a coordinate, "1": none, empty: text
  std::string description;  // one line
  bool finite = true;       // whether NaN and infinities are faults
};

/// Digest of names, types, shapes, bytes, units and descriptions, whatever the order and the layout of the file.
class ContentDigest {
 public:
  void add(const Field&, std::string_view type, const Shape&, std::string_view bytes);
  void add_attribute(const std::string& name, const std::string& value);
  std::string digest() const;

 private:
  std::map<std::string, std::string> digests_;  // by name
};

/// Entries of a dataset are double, std::int32_t, std::uint8_t (little-endian in the file) or std::string (UTF-8 of
/// variable length), row by row.
class Hdf5Writer {
 public:
  /// A file with `head` free bytes in front (0, or a power of two from 512).
  explicit Hdf5Writer(size_t head);

  template <class T>
  void write(const Field&, const Shape&, const std::vector<T>& values);
  void write_attribute(const std::string& name, const std::string& value);  // of the root group
  void write_attribute(const std::string& name, std::int32_t value);

  const ContentDigest& content() const { return content_; }

  /// The bytes of the file.
  std::string bytes() const;

 private:
  SilentHdf5 silent_;
  size_t head_;
  Handle file_;
  ContentDigest content_;
};

class Hdf5Reader {
 public:
  /// `bytes` of a whole file. @throws InputError if it is not one.
  explicit Hdf5Reader(const std::string& bytes);

  /// @throws InputError if there is no such dataset, or it has more entries than the file has bytes.
  Shape shape(const std::string& name) const;

  /// @throws InputError unless there is a dataset of this type and shape.
  template <class T>
  std::vector<T> read(const Field&, const Shape&);

  std::string text_attribute(const std::string& name);
  std::int32_t integer_attribute(const std::string& name);

  const ContentDigest& content() const { return content_; }

 private:
  Handle dataset(const std::string& name) const;

  SilentHdf5 silent_;
  std::uint64_t size_;
  Handle file_;
  ContentDigest content_;
};

}  // namespace flexboom
