#include "reduction/body_file_hdf5.hpp"

#include "fem/check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>

namespace flexboom {
namespace {

constexpr const char* root = "/";

void check(herr_t status, const std::string& fault) { require(status >= 0, fault); }

Handle property_list(hid_t kind) { return {H5Pcreate(kind), H5Pclose, "the HDF5 library has no memory"}; }

// Text of variable length, UTF-8.
Handle text_type() {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "the HDF5 library has no memory");
  check(H5Tset_size(type, H5T_VARIABLE), "the HDF5 library knows no text of variable length");
  check(H5Tset_cset(type, H5T_CSET_UTF8), "the HDF5 library knows no UTF-8");
  return type;
}

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

Handle space_of(const Shape& shape) {
  const std::vector<hsize_t> dims(shape.begin(), shape.end());
  return {dims.empty() ? H5Screate(H5S_SCALAR) : H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr),
          H5Sclose, "HDF5 cannot make the shape " + text_of(shape)};
}

// What HDF5 takes and gives as text.
std::vector<const char*> pointers(const std::vector<std::string>& values) {
  std::vector<const char*> result;
  result.reserve(values.size());
  for (const std::string& value : values) result.push_back(value.c_str());
  return result;
}

// Pointers that HDF5 allocated, and frees again.
struct TextBuffer {
  std::vector<char*> texts;
  hid_t type, space;
  TextBuffer(size_t count, hid_t t, hid_t s) : texts(count, nullptr), type(t), space(s) {}
  ~TextBuffer() { H5Dvlen_reclaim(type, space, H5P_DEFAULT, texts.data()); }
  TextBuffer(const TextBuffer&) = delete;
  TextBuffer& operator=(const TextBuffer&) = delete;
  std::vector<std::string> strings() const {
    std::vector<std::string> result;
    for (const char* text : texts) result.emplace_back(text ? text : "");  // none: empty text
    return result;
  }
};

// An attribute of one text.
void put_text(hid_t object, const std::string& name, const std::string& value) {
  const Handle type = text_type();
  const Handle space = space_of({});
  const Handle attribute(H5Acreate2(object, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         "HDF5 cannot make the attribute \"" + name + "\"");
  const char* text = value.c_str();
  check(H5Awrite(attribute, type, &text), "HDF5 cannot write the attribute \"" + name + "\"");
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
  check(H5Aread(attribute, type, buffer.texts.data()), where + "attribute \"" + name + "\" cannot be read");
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

Handle::Handle(hid_t id, herr_t (*close)(hid_t), const std::string& fault) : id_(id), close_(close) {
  require(id >= 0, fault);
}

SilentHdf5::SilentHdf5() {
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

SilentHdf5::~SilentHdf5() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

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

Hdf5Writer::Hdf5Writer(size_t head)
    : head_(head),
      access_(property_list(H5P_FILE_ACCESS)),
      creation_(property_list(H5P_FILE_CREATE)),
      file_(
          [&] {
            constexpr size_t growth = 1 << 20;
            check(H5Pset_fapl_core(access_, growth, false), "the HDF5 library cannot keep a file in memory");
            check(H5Pset_userblock(creation_, head), "HDF5 cannot leave free bytes at the head of a file");
            return H5Fcreate("body", H5F_ACC_TRUNC, creation_, access_);
          }(),
          H5Fclose, "the HDF5 library cannot make a file in memory") {}

template <class T>
void Hdf5Writer::write(const Field& field, const Shape& shape, const std::vector<T>& values) {
  const std::string fault = "HDF5 cannot write the dataset \"" + field.name + "\"";
  const Handle link = property_list(H5P_LINK_CREATE);
  const Handle creation = property_list(H5P_DATASET_CREATE);
  check(H5Pset_create_intermediate_group(link, 1), fault);
  check(H5Pset_obj_track_times(creation, false), fault);  // equal bodies make equal files
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
    check(H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, pointers(values).data()), fault);
  } else {
    check(H5Dwrite(dataset, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), fault);
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
  check(H5Awrite(attribute, H5T_NATIVE_INT32, &value), fault);
  content_.add_attribute(name, fmt::format("{}", value));
}

std::string Hdf5Writer::bytes() const {
  constexpr const char* fault = "the HDF5 library cannot give the file it made";
  check(H5Fflush(file_, H5F_SCOPE_LOCAL), fault);
  const ssize_t size = H5Fget_file_image(file_, nullptr, 0);  // without the head
  require(size > 0, fault);
  std::string result(head_ + static_cast<size_t>(size), '\0');
  require(H5Fget_file_image(file_, &result[head_], static_cast<size_t>(size)) == size, fault);
  return result;
}

Hdf5Reader::Hdf5Reader(const std::string& bytes)
    : size_(bytes.size()),
      access_(property_list(H5P_FILE_ACCESS)),
      file_(
          [&] {
            constexpr size_t growth = 1 << 16;
            check(H5Pset_fapl_core(access_, growth, false), "the HDF5 library cannot keep a file in memory");
            // The library copies the bytes.
            check(H5Pset_file_image(access_, const_cast<char*>(bytes.data()), bytes.size()),
                  "the HDF5 library has no memory");
            return H5Fopen("body", H5F_ACC_RDONLY, access_);
          }(),
          H5Fclose, "not an HDF5 file, or damaged") {}

Handle Hdf5Reader::dataset(const std::string& name) const {
  // A link is looked for in a group that is there: part by part.
  for (size_t end = 0; end != std::string::npos;) {
    end = name.find('/', end + 1);
    require(H5Lexists(file_, name.substr(0, end).c_str(), H5P_DEFAULT) > 0, "dataset \"" + name + "\" is missing");
  }
  return {H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose, "\"" + name + "\" is not a dataset, or damaged"};
}

Shape Hdf5Reader::shape(const std::string& name) const {
  const Handle data = dataset(name);
  const Handle space(H5Dget_space(data), H5Sclose, "dataset \"" + name + "\" is damaged");
  std::vector<hsize_t> extents(H5S_MAX_RANK);
  const int rank = H5Sget_simple_extent_dims(space, extents.data(), nullptr);
  require(rank >= 0 && H5Sget_simple_extent_type(space) != H5S_NULL, "dataset \"" + name + "\" has no shape");
  Shape result(extents.begin(), extents.begin() + rank);
  entries(result, size_, name);
  return result;
}

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
      check(H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, buffer.texts.data()), where + "cannot be read");
    }
    values = buffer.strings();
  } else {
    check(H5Dread(data, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), where + "cannot be read");
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
  check(H5Aread(attribute, H5T_NATIVE_INT32, &value), "attribute \"" + name + "\" cannot be read");
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
