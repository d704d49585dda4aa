#include "reduction/exports/exudyn_dictionary.hpp"

#include "fem/base/check.hpp"
#include "fem/base/files.hpp"
#include "reduction/body_file/hdf5_image.hpp"

#include <fmt/format.h>

#include <cstdint>

namespace flexboom {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using IntegerRowMajor = Eigen::Matrix<long, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void check(bool condition, const std::string& what) { require(condition, "HDF5: cannot " + what); }

Handle handle(hid_t id, herr_t (*close)(hid_t), const std::string& what) { return {id, close, "HDF5: cannot " + what}; }

void write_dataset(hid_t parent, const std::string& name, const char* python_type, hid_t file_type, hid_t memory_type,
                   const Shape& shape, const void* data) {
  const Handle space = space_of(shape);
  const Handle properties = property_list(H5P_DATASET_CREATE);
  const Handle dataset =
      handle(H5Dcreate2(parent, name.c_str(), file_type, space, H5P_DEFAULT, properties, H5P_DEFAULT), H5Dclose,
             "make " + name);
  check(H5Dwrite(dataset, memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0, "write " + name);
  put_text(dataset, "datatype", python_type);
}

/// Writes one value under its name.
struct Writer {
  hid_t parent;
  const std::string& name;

  void operator()(long value) const { write_dataset(parent, name, "int", H5T_STD_I64LE, H5T_NATIVE_LONG, {}, &value); }
  void operator()(double value) const {
    write_dataset(parent, name, "float", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, {}, &value);
  }
  void operator()(const std::string& value) const {
    const char* text = value.c_str();
    const Handle type = text_type();
    write_dataset(parent, name, "str", type, type, {}, &text);
  }
  void operator()(const std::vector<std::string>& value) const {
    const Handle list = group("list");
    for (size_t i = 0; i < value.size(); ++i) {
      const std::string item = "item_" + std::to_string(i);
      Writer{list, item}(value[i]);
    }
  }
  void operator()(const Eigen::VectorXd& value) const {
    write_dataset(parent, name, "ndarray", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, shape_of(value), value.data());
  }
  void operator()(const Eigen::MatrixXd& value) const {
    const RowMajor rows = value;
    write_dataset(parent, name, "ndarray", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, shape_of(value), rows.data());
  }
  void operator()(const IntegerVector& value) const {
    write_dataset(parent, name, "ndarray", H5T_STD_I64LE, H5T_NATIVE_LONG, shape_of(value), value.data());
  }
  void operator()(const IntegerMatrix& value) const {
    const IntegerRowMajor rows = value;
    write_dataset(parent, name, "ndarray", H5T_STD_I64LE, H5T_NATIVE_LONG, shape_of(value), rows.data());
  }
  void operator()(EmptyDictionary) const { group("dict"); }

 private:
  template <class Matrix>
  static Shape shape_of(const Matrix& value) {
    if constexpr (Matrix::ColsAtCompileTime == 1) return {static_cast<std::uint64_t>(value.size())};
    return {static_cast<std::uint64_t>(value.rows()), static_cast<std::uint64_t>(value.cols())};
  }

  Handle group(const char* python_type) const {
    const Handle properties = property_list(H5P_GROUP_CREATE);
    Handle made =
        handle(H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, properties, H5P_DEFAULT), H5Gclose, "make " + name);
    put_text(made, "datatype", python_type);
    return made;
  }
};

std::string file_image(const ExudynDictionary& dictionary) {
  const Handle file = new_image(0);
  for (const auto& [name, value] : dictionary) std::visit(Writer{file, name}, value);
  return image_bytes(file, 0);
}

/// Reads the entries of one open file.
class Reader {
 public:
  explicit Reader(const std::string& bytes) : file_(open_image(bytes)), size_(bytes.size()) {}

  ExudynDictionary all() const {
    ExudynDictionary dictionary;
    H5G_info_t info;
    check(H5Gget_info(file_, &info) >= 0, "list the entries");
    for (hsize_t i = 0; i < info.nlinks; ++i) {
      const std::string name = link_name(i);
      const Handle object = handle(H5Oopen(file_, name.c_str(), H5P_DEFAULT), H5Oclose, "open " + name);
      add(dictionary, name, object);
    }
    return dictionary;
  }

 private:
  std::string link_name(hsize_t i) const {
    const auto get = [&](char* to, size_t size) {
      return H5Lget_name_by_idx(file_, ".", H5_INDEX_NAME, H5_ITER_INC, i, to, size, H5P_DEFAULT);
    };
    const ssize_t size = get(nullptr, 0);
    check(size > 0, "read the name of an entry");
    std::string name(static_cast<size_t>(size), '\0');
    check(get(name.data(), name.size() + 1) == size, "read the name of an entry");
    return name;
  }

  void add(ExudynDictionary& dictionary, const std::string& name, hid_t object) const {
    if (H5Iget_type(object) == H5I_GROUP) {
      if (H5Lexists(object, "item_0", H5P_DEFAULT) > 0) dictionary[name] = list(object, name);
      return;
    }
    if (H5Iget_type(object) != H5I_DATASET) return;
    const Handle type = handle(H5Dget_type(object), H5Tclose, "read the type of " + name);
    const Shape shape = shape_of(object, size_, name);  // nothing in these files is compressed
    check(shape.size() <= 2, fmt::format("use {}: it has {} axes, at most 2 are known", name, shape.size()));
    switch (H5Tget_class(type)) {
      case H5T_STRING:
        if (shape.empty()) dictionary[name] = text(object, name);
        break;
      case H5T_INTEGER:
        dictionary[name] = numbers<long, IntegerVector, IntegerRowMajor, IntegerMatrix>(object, name, shape);
        break;
      case H5T_FLOAT:
        dictionary[name] = numbers<double, Eigen::VectorXd, RowMajor, Eigen::MatrixXd>(object, name, shape);
        break;
      default:
        break;
    }
  }

  template <class Number, class Vector, class Rows, class Matrix>
  static ExudynValue numbers(hid_t dataset, const std::string& name, const Shape& shape) {
    const auto size = [&](size_t axis) { return axis < shape.size() ? static_cast<Eigen::Index>(shape[axis]) : 1; };
    Rows rows(size(0), size(1));
    const hid_t type = std::is_same_v<Number, double> ? H5T_NATIVE_DOUBLE : H5T_NATIVE_LONG;
    check(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows.data()) >= 0, "read " + name);
    if (shape.empty()) return rows(0, 0);
    if (shape.size() == 1) return Vector(rows.col(0));
    return Matrix(rows);
  }

  static std::string text(hid_t dataset, const std::string& name) {
    const Handle stored = handle(H5Dget_type(dataset), H5Tclose, "read the type of " + name);
    check(H5Tis_variable_str(stored) > 0, "read " + name + ": a text of variable length is expected");
    const Handle type = text_type(), space = space_of({});
    TextBuffer buffer(1, type, space);
    check(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, buffer.texts.data()) >= 0, "read " + name);
    return buffer.strings().front();
  }

  static std::vector<std::string> list(hid_t group, const std::string& name) {
    std::vector<std::string> items;
    for (std::string item = "item_0"; H5Lexists(group, item.c_str(), H5P_DEFAULT) > 0;
         item = "item_" + std::to_string(items.size())) {
      std::string full = name;
      full += '/', full += item;
      const Handle dataset = handle(H5Dopen2(group, item.c_str(), H5P_DEFAULT), H5Dclose, "open " + full);
      items.push_back(text(dataset, full));
    }
    return items;
  }

  Handle file_;
  std::uint64_t size_;
};

}  // namespace

void write_exudyn_dictionary(const std::filesystem::path& path, const ExudynDictionary& dictionary) {
  const SilentHdf5 silent;
  write_file(path, file_image(dictionary));
}

ExudynDictionary read_exudyn_dictionary(const std::filesystem::path& path) {
  const SilentHdf5 silent;
  const std::string bytes = file_bytes(path);
  try {
    return Reader(bytes).all();
  } catch (const InputError& fault) {
    throw InputError(path.string() + ": " + fault.what());
  }
}

}  // namespace flexboom
