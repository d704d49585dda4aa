#include "reduction/body_file/hdf5_image.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>

namespace flexboom {

Handle::Handle(hid_t id, herr_t (*close)(hid_t), const std::string& fault) : id_(id), close_(close) {
  require(id >= 0, fault);
}

SilentHdf5::SilentHdf5() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

SilentHdf5::~SilentHdf5() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

void check_hdf5(herr_t status, const std::string& fault) { require(status >= 0, fault); }

std::string text_of(const Shape& shape) {
  return shape.empty() ? "a single value" : fmt::format("{}", fmt::join(shape, " x "));
}

std::uint64_t entries(const Shape& shape, std::uint64_t limit, const std::string& name) {
  std::uint64_t count = 1;
  for (const std::uint64_t extent : shape) {
    require(extent == 0 || count <= limit / extent,
            fmt::format("dataset \"{}\" is {}: more than the file can hold", name, text_of(shape)));
    count *= extent;
  }
  return count;
}

Shape shape_of(hid_t dataset, std::uint64_t limit, const std::string& name) {
  const Handle space(H5Dget_space(dataset), H5Sclose, "dataset \"" + name + "\" is damaged");
  std::array<hsize_t, H5S_MAX_RANK> extents{};
  const int rank = H5Sget_simple_extent_dims(space, extents.data(), nullptr);
  require(rank >= 0 && H5Sget_simple_extent_type(space) != H5S_NULL, "dataset \"" + name + "\" has no shape");
  Shape shape(extents.begin(), extents.begin() + rank);
  entries(shape, limit, name);
  return shape;
}

Handle space_of(const Shape& shape) {
  const std::vector<hsize_t> dims(shape.begin(), shape.end());
  return {dims.empty() ? H5Screate(H5S_SCALAR) : H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr),
          H5Sclose, "HDF5 cannot make the shape " + text_of(shape)};
}

Handle text_type() {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "the HDF5 library has no memory");
  check_hdf5(H5Tset_size(type, H5T_VARIABLE), "the HDF5 library knows no text of variable length");
  check_hdf5(H5Tset_cset(type, H5T_CSET_UTF8), "the HDF5 library knows no UTF-8");
  return type;
}

Handle property_list(hid_t kind) {
  Handle list(H5Pcreate(kind), H5Pclose, "the HDF5 library has no memory");
  if (H5Pisa_class(list, H5P_OBJECT_CREATE) > 0)
    check_hdf5(H5Pset_obj_track_times(list, false), "HDF5 cannot leave out times");
  return list;
}

Handle new_image(std::size_t head) {
  constexpr std::size_t growth = 1 << 20;
  const Handle access = property_list(H5P_FILE_ACCESS);
  const Handle creation = property_list(H5P_FILE_CREATE);
  check_hdf5(H5Pset_fapl_core(access, growth, false), "the HDF5 library cannot keep a file in memory");
  check_hdf5(H5Pset_userblock(creation, head), "HDF5 cannot leave free bytes at the head of a file");
  return {H5Fcreate("memory", H5F_ACC_TRUNC, creation, access), H5Fclose,
          "the HDF5 library cannot make a file in memory"};
}

Handle open_image(const std::string& bytes) {
  constexpr std::size_t growth = 1 << 16;
  const Handle access = property_list(H5P_FILE_ACCESS);
  check_hdf5(H5Pset_fapl_core(access, growth, false), "the HDF5 library cannot keep a file in memory");
  // The library copies the bytes.
  check_hdf5(H5Pset_file_image(access, const_cast<char*>(bytes.data()), bytes.size()),
             "the HDF5 library has no memory");
  return {H5Fopen("memory", H5F_ACC_RDONLY, access), H5Fclose, "not an HDF5 file, or damaged"};
}

std::string image_bytes(hid_t file, std::size_t head) {
  constexpr const char* fault = "the HDF5 library cannot give the file it made";
  check_hdf5(H5Fflush(file, H5F_SCOPE_LOCAL), fault);
  const ssize_t size = H5Fget_file_image(file, nullptr, 0);  // without the head
  require(size > 0, fault);
  std::string result(head + static_cast<std::size_t>(size), '\0');
  require(H5Fget_file_image(file, &result[head], static_cast<std::size_t>(size)) == size, fault);
  return result;
}

void put_text(hid_t object, const std::string& name, const std::string& value) {
  const Handle type = text_type();
  const Handle space = space_of({});
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         "HDF5 cannot make the attribute \"" + name + "\"");
  const char* text = value.c_str();
  check_hdf5(H5Awrite(attribute, type, &text), "HDF5 cannot write the attribute \"" + name + "\"");
}

std::vector<std::string> TextBuffer::strings() const {
  std::vector<std::string> result;
  result.reserve(texts.size());
  for (const char* text : texts) result.emplace_back(text ? text : "");
  return result;
}

}  // namespace flexboom
