#pragma once

#include "reduction/sha256.hpp"

#include <hdf5.h>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// HDF5 files in memory, as far as body files need them. The only door to the HDF5 library.
namespace flexboom {

/// One dataset: its path in the file and what it says about itself.
struct Field {
  std::string name;         // "Kg/spin"
  std::string units;        // SI; "q": unit of a coordinate, "1": none, empty: text
  std::string description;  // one line
  bool finite = true;       // whether NaN and infinities are faults
};

using Shape = std::vector<std::uint64_t>;

/// "3 x 4"; "a single value" of an empty shape.
std::string text_of(const Shape&);

/// Number of entries. @throws InputError above `limit`.
std::uint64_t entries(const Shape&, std::uint64_t limit, const std::string& name);

/// A handle of the library and how it is closed.
class Handle {
 public:
  /// @throws InputError with `fault` if the library gave no handle.
  Handle(hid_t id, herr_t (*close)(hid_t), const std::string& fault);
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle& operator=(Handle&&) = delete;
  operator hid_t() const { return id_; }  // for the C functions

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// While it lives, the library prints no errors of its own.
class SilentHdf5 {
 public:
  SilentHdf5();
  ~SilentHdf5();
  SilentHdf5(const SilentHdf5&) = delete;
  SilentHdf5& operator=(const SilentHdf5&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
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
  Handle access_;
  Handle creation_;
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
  Handle access_;
  Handle file_;
  ContentDigest content_;
};

}  // namespace flexboom
