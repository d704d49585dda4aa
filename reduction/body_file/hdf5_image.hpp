#pragma once

#include <hdf5.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

// Files of HDF5 in memory, as a few C++ values: handles, shapes, texts. The only door to the HDF5 library; what a file
// holds is said where it is written (body_file_hdf5, exudyn_dictionary).
namespace flexboom {

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

/// @throws InputError with `fault` if the library says that something failed.
void check_hdf5(herr_t status, const std::string& fault);

/// Extents of a dataset, none for a single value.
using Shape = std::vector<std::uint64_t>;

/// "3 x 4"; "a single value" of an empty shape.
std::string text_of(const Shape&);

/// Number of entries. @throws InputError above `limit`.
std::uint64_t entries(const Shape&, std::uint64_t limit, const std::string& name);

/// Extents of a dataset. @throws InputError if it has none, or more entries than `limit`.
Shape shape_of(hid_t dataset, std::uint64_t limit, const std::string& name);

/// A dataspace of this shape.
Handle space_of(const Shape&);

/// Text of variable length, UTF-8.
Handle text_type();

/// Properties of what is made. Objects keep no times: equal content makes equal files.
Handle property_list(hid_t kind);

/// An empty file with `head` free bytes in front (0, or a power of two from 512).
Handle new_image(std::size_t head);

/// The file that these bytes are. @throws InputError if they are none.
Handle open_image(const std::string& bytes);

/// The bytes of a file, the free ones in front with it.
std::string image_bytes(hid_t file, std::size_t head);

/// Writes an attribute of one text.
void put_text(hid_t object, const std::string& name, const std::string& value);

/// Pointers that the library allocated, and frees again.
struct TextBuffer {
  std::vector<char*> texts;
  hid_t type, space;
  TextBuffer(std::size_t count, hid_t t, hid_t s) : texts(count, nullptr), type(t), space(s) {}
  ~TextBuffer() { H5Dvlen_reclaim(type, space, H5P_DEFAULT, texts.data()); }
  TextBuffer(const TextBuffer&) = delete;
  TextBuffer& operator=(const TextBuffer&) = delete;
  /// No text counts as an empty one.
  std::vector<std::string> strings() const;
};

}  // namespace flexboom
