#include "reduction/body_file/hdf5.hpp"

#include "fem/base/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>

namespace flexboom {
namespace {

constexpr const char* root = "/";

Handle copy_of(hid_t type) { return {H5Tcopy(type), H5Tclose, "the HDF5 library has no memory"}; }

// How a type is called, what it is in the file and in memory.
template <class T>
struct Type;
template <>
struct Type<double> {
  static constexpr const char* name = "f64";
  static Handle file() { return copy_of(H5T_IEEE_F64LE); }
  static Handle memory() { return copy_of(H5T_NATIVE_DOUBLE); }
};
template <>
struct Type<std::int32_t> {
  static constexpr const char* name = "i32";
  static Handle file() { return copy_of(H5T_STD_I32LE); }
  static Handle memory() { return copy_of(H5T_NATIVE_INT32); }
};
template <>
struct Type<std::uint8_t> {
  static constexpr const char* name = "u8";
  static Handle file() { return copy_of(H5T_STD_U8LE); }
  static Handle memory() { return copy_of(H5T_NATIVE_UINT8); }
};
template <>
struct Type<std::string> {
  static constexpr const char* name = "text";
  static Handle file() { return text_type(); }
  static Handle memory() { return text_type(); }
};

// What HDF5 takes as text.
std::vector<const char*> pointers(const std::vector<std::string>& values) {
  std::vector<const char*> result;
  result.reserve(values.size());
  for (const std::string& value : values) result.push_back(value.c_str());
  return result;
}

// Opens an attribute of one value of a type.
Handle attribute_of(hid_t object, const std::string& name, hid_t type, const std::string& where) {
  require(H5Aexists(object, name.c_str()) > 0, where + "has no attribute \"" + name + "\"");
  Handle attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose,
                   where + "attribute \"" + name + "\" is damaged");
  const Handle found(H5Aget_type(attribute), H5Tclose, where + "attribute \"" + name + "\" is damaged");
  const Handle space(H5Aget_space(attribute), H5Sclose, where + "attribute \"" + name + "\" is damaged");
  require(H5Tequal(found, type) > 0 && H5Sget_simple_extent_npoints(space) == 1,
          where + "attribute \"" + name + "\" has another type than in files of this format");
  return attribute;
}

std::string text_at(hid_t object, const std::string& name, const std::string& where) {
  const Handle type = text_type();
  const Handle space = space_of({});
  const Handle attribute = attribute_of(object, name, type, where);
  TextBuffer buffer(1, type, space);
  check_hdf5(H5Aread(attribute, type, buffer.texts.data()), where + "attribute \"" + name + "\" cannot be read");
  return buffer.strings().front();
}

// Values as they lie in memory; text ends with a zero.
template <class T>
std::string_view bytes_of(const std::vector<T>& values) {
  static_assert(std::endian::native == std::endian::little, "digests are those of little-endian numbers");
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}
std::string bytes_of(const std::vector<std::string>& values) {
  std::string bytes;
  for (const std::string& value : values) bytes.append(value.c_str(), value.size() + 1);
  return bytes;
}

}  // namespace

void ContentDigest::add(const Field& field, std::string_view type, const Shape& shape, std::string_view bytes) {
  Sha256 hash;
  hash.add(fmt::format("{}\n{}\n{}\n{}\n", type, fmt::join(shape, ","), field.units, field.description));
  hash.add(bytes);
  digests_[field.name] = hash.digest();
}

void ContentDigest::add_attribute(const std::string& name, const std::string& value) {
  digests_["@" + name] = sha256(value);
}

std::string ContentDigest::digest() const {
  Sha256 hash;
  for (const auto& [name, digest] : digests_) hash.add(fmt::format("{} {}\n", name, digest));
  return hash.digest();
}

Hdf5Writer::Hdf5Writer(size_t head) : head_(head), file_(new_image(head)) {}

template <class T>
void Hdf5Writer::write(const Field& field, const Shape& shape, const std::vector<T>& values) {
  const std::string fault = "HDF5 cannot write the dataset \"" + field.name + "\"";
  const Handle link = property_list(H5P_LINK_CREATE);
  const Handle creation = property_list(H5P_DATASET_CREATE);
  check_hdf5(H5Pset_create_intermediate_group(link, 1), fault);
  const Handle type = Type<T>::file();
  const Handle memory = Type<T>::memory();
  const Handle space = space_of(shape);
  const Handle dataset(H5Dcreate2(file_, field.name.c_str(), type, space, link, creation, H5P_DEFAULT), H5Dclose,
                       fault);
  if constexpr (std::is_same_v<T, std::string>) {
    for (const std::string& value : values) {
      require(value.find('\0') == std::string::npos,
              "dataset \"" + field.name + "\" cannot hold text with a zero byte");
    }
    check_hdf5(H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, pointers(values).data()), fault);
  } else {
    check_hdf5(H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), fault);
  }
  put_text(dataset, "units", field.units);
  put_text(dataset, "description", field.description);
  content_.add(field, Type<T>::name, shape, bytes_of(values));
}

void Hdf5Writer::write_attribute(const std::string& name, const std::string& value) {
  require(value.find('\0') == std::string::npos, name + " cannot hold text with a zero byte");
  const Handle group(H5Gopen2(file_, root, H5P_DEFAULT), H5Gclose, "HDF5 cannot open the root group");
  put_text(group, name, value);
  content_.add_attribute(name, value);
}

void Hdf5Writer::write_attribute(const std::string& name, std::int32_t value) {
  const std::string fault = "HDF5 cannot write the attribute \"" + name + "\"";
  const Handle group(H5Gopen2(file_, root, H5P_DEFAULT), H5Gclose, "HDF5 cannot open the root group");
  const Handle space = space_of({});
  const Handle attribute(H5Acreate2(group, name.c_str(), H5T_STD_I32LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         fault);
  check_hdf5(H5Awrite(attribute, H5T_NATIVE_INT32, &value), fault);
  content_.add_attribute(name, fmt::format("{}", value));
}

std::string Hdf5Writer::bytes() const { return image_bytes(file_, head_); }

Hdf5Reader::Hdf5Reader(const std::string& bytes) : size_(bytes.size()), file_(open_image(bytes)) {}

Handle Hdf5Reader::dataset(const std::string& name) const {
  // A link is looked for in a group that is there: part by part.
  for (size_t end = 0; end != std::string::npos;) {
    end = name.find('/', end + 1);
    require(H5Lexists(file_, name.substr(0, end).c_str(), H5P_DEFAULT) > 0, "dataset \"" + name + "\" is missing");
  }
  return {H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose, "\"" + name + "\" is not a dataset, or damaged"};
}

Shape Hdf5Reader::shape(const std::string& name) const { return shape_of(dataset(name), size_, name); }

template <class T>
std::vector<T> Hdf5Reader::read(const Field& field, const Shape& expected) {
  const std::string where = "dataset \"" + field.name + "\" ";
  const Shape found = shape(field.name);
  require(found == expected, fmt::format("{}is {}, must be {}", where, text_of(found), text_of(expected)));
  const Handle data = dataset(field.name);
  const Handle type(H5Dget_type(data), H5Tclose, where + "is damaged");
  const Handle wanted = Type<T>::file();
  require(H5Tequal(type, wanted) > 0, fmt::format("{}has another type, must be {}", where, Type<T>::name));
  const Handle space(H5Dget_space(data), H5Sclose, where + "is damaged");
  const Handle memory = Type<T>::memory();
  std::vector<T> values(entries(found, size_, field.name));
  if constexpr (std::is_same_v<T, std::string>) {
    TextBuffer buffer(values.size(), memory, space);
    if (!values.empty()) {
      check_hdf5(H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, buffer.texts.data()), where + "cannot be read");
    }
    values = buffer.strings();
  } else {
    check_hdf5(H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), where + "cannot be read");
  }
  const Field written = {field.name, text_at(data, "units", where), text_at(data, "description", where)};
  require(written.units == field.units,
          fmt::format(R"({}has units "{}", must have "{}")", where, written.units, field.units));
  content_.add(written, Type<T>::name, found, bytes_of(values));
  return values;
}

std::string Hdf5Reader::text_attribute(const std::string& name) {
  const Handle group(H5Gopen2(file_, root, H5P_DEFAULT), H5Gclose, "the root group is damaged");
  std::string value = text_at(group, name, "the file ");
  content_.add_attribute(name, value);
  return value;
}

std::int32_t Hdf5Reader::integer_attribute(const std::string& name) {
  const Handle group(H5Gopen2(file_, root, H5P_DEFAULT), H5Gclose, "the root group is damaged");
  const Handle attribute = attribute_of(group, name, H5T_STD_I32LE, "the file ");
  std::int32_t value = 0;
  check_hdf5(H5Aread(attribute, H5T_NATIVE_INT32, &value), "attribute \"" + name + "\" cannot be read");
  content_.add_attribute(name, fmt::format("{}", value));
  return value;
}

template void Hdf5Writer::write(const Field&, const Shape&, const std::vector<double>&);
template void Hdf5Writer::write(const Field&, const Shape&, const std::vector<std::int32_t>&);
template void Hdf5Writer::write(const Field&, const Shape&, const std::vector<std::uint8_t>&);
template void Hdf5Writer::write(const Field&, const Shape&, const std::vector<std::string>&);
template std::vector<double> Hdf5Reader::read(const Field&, const Shape&);
template std::vector<std::int32_t> Hdf5Reader::read(const Field&, const Shape&);
template std::vector<std::uint8_t> Hdf5Reader::read(const Field&, const Shape&);
template std::vector<std::string> Hdf5Reader::read(const Field&, const Shape&);

}  // namespace flexboom
